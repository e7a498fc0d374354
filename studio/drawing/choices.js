// How a drawing is moved: planes from which limbs are seen, how the motion comes onto the picture, and the picture itself.

import { getJson } from "../api/client.js";
import { el, words } from "../dom.js";
import { field } from "../ops/form.js";
import { drawn, editDrawn, onDrawn } from "./live.js";

/** @typedef {Record<string, any>} Config */

/** @type {Record<string, string>} */
const PLANES = { frontal: "from the front", sagittal: "from the side", pca: "what shows more" };
/** Fields that are asked for, of which part of the spec. @type {[string, string, string[]][]} */
const PARTS = [
  ["How it moves", "project", ["damping", "foreshorten", "turn", "plant", "stay"]], ["How it bends", "drawing", ["deform", "rigid"]],
  ["The clip", "edit", ["range", "fps", "speed", "mirror"]], ["The picture", "view", ["size", "background"]],
];
const LAYERS = ["texture", "colors", "mesh", "rig", "floor", "source"];

/** @type {any} */
let schema = null;

/** @param {HTMLElement} place */
export function choicesPanel(place) {
  const planes = el("div", { class: "fields" });
  const parts = PARTS.map(([title, part, names]) => ({ part, names, fields: el("div", { class: "fields" }), title }));
  const layers = el("div", { class: "choices", role: "group", "aria-label": "What is drawn" });
  place.append(
    el("details", { open: true }, el("summary", {}, "Planes"), el("p", { class: "about" }, "From where the clip's limbs are seen before they are laid onto the paper."), planes),
    ...parts.map(({ title, fields, part }) => el("details", {}, el("summary", {}, title), fields, part === "view" ? layers : null)));
  const draw = () => {
    const active = document.activeElement;
    if (active instanceof HTMLInputElement && active.type === "range" && place.contains(active)) return;
    const at = focusAt(place);
    planes.replaceChildren(...planeFields());
    if (schema) {
      for (const { part, names, fields } of parts) fields.replaceChildren(...names.map((name) => partField(part, name)));
      layers.replaceChildren(...LAYERS.map(layer));
    }
    if (at >= 0) focusables(place)[at]?.focus();
  };
  onDrawn(draw);
  void getJson("/v1/schemas/draw-spec").then((found) => {
    schema = found;
    draw();
  });
  draw();
}

/** @param {HTMLElement} place @returns {HTMLElement[]} */
function focusables(place) {
  return [...place.querySelectorAll("input, select, textarea, button, summary")].map((of) => /** @type {HTMLElement} */ (of));
}

/** Where the focus is, so that it can be put there again. @param {HTMLElement} place */
function focusAt(place) {
  return focusables(place).indexOf(/** @type {HTMLElement} */ (document.activeElement));
}

function planeFields() {
  const groups = (drawn.config.retarget ?? drawn.resolved?.retarget)?.bvh_projection_bodypart_groups ?? [];
  if (!groups.length) return [el("p", { class: "empty" }, "They are here as soon as it has moved once.")];
  const fields = groups.map((/** @type {any} */ group, /** @type {number} */ index) => {
    const box = el("select", { "aria-label": `Plane of ${words(group.name)}`, onchange: () => choosePlane(index, box.value) }, ...Object.entries(PLANES).map(([value, text]) => el("option", { value, ".selected": value === group.method }, text)));
    return el("div", { class: "field" }, el("span", { class: "label", title: group.bvh_joint_names.join(", ") }, words(group.name)), box);
  });
  const reset = el("button", { type: "button", ".disabled": drawn.config.retarget === undefined, onclick: () => editDrawn((config) => { delete config.retarget; }) }, "Choose planes by itself");
  return [...fields, el("div", { class: "row" }, reset)];
}

/** @param {number} index @param {string} method */
function choosePlane(index, method) {
  editDrawn((config) => {
    config.retarget = structuredClone(config.retarget ?? drawn.resolved?.retarget);
    config.retarget.bvh_projection_bodypart_groups[index].method = method;
  });
}

/** @param {string} part */
function schemaOf(part) {
  let of = schema.properties[part];
  while (of?.$ref || of?.allOf) of = of.$ref ? schema.$defs[of.$ref.slice("#/$defs/".length)] : of.allOf[0];
  return of;
}

/** @param {string} part @param {string} name */
function partField(part, name) {
  return field(name, schemaOf(part).properties[name], drawn.config[part]?.[name], (value) => editDrawn((config) => {
    config[part] = { ...config[part] };
    if (value === undefined) delete config[part][name];
    else config[part][name] = value;
  }), schema);
}

/** @param {string} name */
function layer(name) {
  const now = /** @type {string[]} */ (drawn.config.view?.draw ?? ["texture"]);
  const toggle = () => editDrawn((config) => {
    const draw = now.includes(name) ? now.filter((of) => of !== name) : [...now, name];
    config.view = { ...config.view, draw };
    if (!draw.length || (draw.length === 1 && draw[0] === "texture")) delete config.view.draw;
  });
  return el("button", { type: "button", "aria-pressed": String(now.includes(name)), onclick: toggle }, words(name));
}

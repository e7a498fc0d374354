// Edits of the clip: what of it is used, how fast, which side; and what they do to the source that is shown beside.

import { el } from "../dom.js";
import { edit, state, watch } from "../state.js";
import { field } from "./form.js";
import { resolved } from "./schema.js";

const COMMON = ["speed", "reverse", "mirror", "fps", "filter", "loop"];
/** Fields whose objects are shown as fields of their own. */
const OBJECTS = ["filter", "loop"];

/**
 * @param {string} name
 * @param {any} value
 */
function change(name, value) {
  edit((config) => {
    config.edit = { ...config.edit };
    if (value === undefined) delete config.edit[name];
    else config.edit[name] = value;
  });
}

/** @param {HTMLElement} panel */
export function editsPanel(panel) {
  const fields = el("div", { class: "fields" });
  const more = el("details", {}, el("summary", {}, "More"), el("div", { class: "fields" }));
  const reset = el("button", { type: "button", onclick: () => edit((config) => { delete config.edit; }) }, "Take all edits back");
  panel.append(el("p", { class: "lead" }, "Changes of the clip before it is retargeted. Trim it with the handles above the time line, or with [ and ]."), el("div", { class: "row" }, reset), fields, more);
  const draw = () => {
    reset.disabled = state.config.edit === undefined;
    if (!state.schema || panel.contains(document.activeElement) && document.activeElement instanceof HTMLInputElement && document.activeElement.type === "range") return;
    const spec = state.schema.$defs.EditSpec.properties;
    const rows = (/** @type {string[]} */ names) => names.flatMap((name) => (OBJECTS.includes(name) ? objectField(name, spec[name]) : [field(name, spec[name], shown(name), (value) => change(name, value), state.schema)]));
    fields.replaceChildren(...rows(COMMON));
    more.lastElementChild?.replaceChildren(...rows(Object.keys(spec).filter((name) => !COMMON.includes(name))));
  };
  watch(["config", "schema"], draw);
  draw();
}

/** @param {string} name */
function shown(name) {
  return state.config.edit?.[name];
}

/**
 * A switch for the object, and where it is on, its fields.
 * @param {string} name
 * @param {any} schema
 * @returns {HTMLElement[]}
 */
function objectField(name, schema) {
  const value = shown(name);
  const own = resolved(schema, state.schema);
  const isOn = value !== undefined && value !== null;
  const toggle = field(name, { type: "boolean", default: false, description: own.description }, isOn || undefined, (on) => change(name, on ? startOf(name) : undefined), state.schema);
  if (!isOn) return [toggle];
  const parts = Object.entries(own.properties).filter(([part]) => !["enabled", "frames", "mask", "alpha"].includes(part));
  return [toggle, el("div", { class: "inner" }, ...parts.map(([part, of]) => field(part, /** @type {any} */ (of), value[part], (changed) => {
    const next = { ...value };
    if (changed === undefined) delete next[part];
    else next[part] = changed;
    change(name, next);
  }, state.schema)))];
}

/** @param {string} name */
function startOf(name) {
  return name === "loop" ? { times: 2 } : { kind: "bell" };
}

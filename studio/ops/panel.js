// The stack of ops: which run, in which order, with which parameters. The forms come from the schema that the service has.

import { getJson } from "../api/client.js";
import { el, words } from "../dom.js";
import { edit, state, watch } from "../state.js";
import { field } from "./form.js";
import { opNames, schemaOfOp } from "./schema.js";

/** @typedef {Record<string, any>} Op */

/** @type {Set<string>} ops whose parameters are shown */
const opened = new Set();

/** The ops that run: those of the config, or those that the service would take. */
function ops() {
  return /** @type {Op[]} */ (state.config.ops ?? state.proposal?.resolved_spec.ops ?? []);
}

/**
 * Changes the list; from then on it is the config's own.
 * @param {(list: Op[]) => void} change
 */
function changeOps(change) {
  const list = structuredClone(ops());
  change(list);
  edit((config) => { config.ops = list; });
}

/** @param {HTMLElement} panel */
export function opsPanel(panel) {
  const list = el("ol", { class: "ops" });
  const add = el("select", { "aria-label": "Add an op", onchange: () => { addOp(add.value); add.value = ""; } });
  const presets = el("select", { "aria-label": "Preset", onchange: () => void takePreset(presets.value) });
  const reset = el("button", { type: "button", title: "Back to what the service does by itself", onclick: () => edit((config) => { delete config.ops; }) }, "Reset");
  panel.append(
    el("p", { class: "lead" }, "What is done, from the top to the bottom. Switch an op off to see what it does."),
    el("div", { class: "row" }, presets, add, reset), list,
  );
  void getJson("/v1/presets").then(({ items }) => {
    presets.append(el("option", { value: "" }, "Preset…"), ...(items ?? []).map((/** @type {any} */ preset) => el("option", { value: preset.name, title: preset.description ?? "" }, preset.name)));
  }).catch(() => presets.remove());
  const draw = () => {
    if (panel.contains(document.activeElement) && document.activeElement instanceof HTMLInputElement && document.activeElement.type === "range") return;
    if (state.schema && add.options.length === 0) add.append(el("option", { value: "" }, "Add an op…"), ...opNames(state.schema).map((/** @type {string} */ name) => el("option", { value: name }, words(name))));
    reset.disabled = state.config.ops === undefined;
    const focused = focusedPlace(list);
    list.replaceChildren(...ops().map(row));
    if (!ops().length) list.replaceChildren(el("li", { class: "empty" }, "Open a clip and a character, and their ops are here."));
    focusAgain(list, focused);
  };
  watch(["config", "proposal", "schema"], draw);
  draw();
}

/**
 * @param {Op} op
 * @param {number} index
 */
function row(op, index) {
  const key = `${index} ${op.op}`;
  const isOn = op.enabled !== false;
  const schema = state.schema && schemaOfOp(state.schema, op.op);
  const move = (/** @type {number} */ by) => changeOps((list) => {
    const to = index + by;
    if (to < 0 || to >= list.length) return;
    list.splice(to, 0, ...list.splice(index, 1));
  });
  const head = el("div", { class: "head" },
    el("input", { type: "checkbox", ".checked": isOn, "aria-label": `${op.op} runs`, "data-focus": `${key} on`, onchange: (/** @type {any} */ event) => changeOps((list) => { list[index].enabled = event.target.checked; }) }),
    el("button", { type: "button", class: "name", "aria-expanded": String(opened.has(key)), "data-focus": `${key} name`, onclick: (/** @type {any} */ event) => {
      if (!opened.delete(key)) opened.add(key);
      event.target.closest("li").replaceWith(row(op, index));
    } }, words(op.op), schema?.description && !opened.has(key) ? el("span", { class: "brief" }, plainText(schema.description).split(/\.\s|;|:\s/)[0]) : null),
    el("button", { type: "button", class: "icon", "aria-label": `${op.op}: earlier`, title: "Earlier", ".disabled": index === 0, "data-focus": `${key} up`, onclick: () => move(-1) }, "↑"),
    el("button", { type: "button", class: "icon", "aria-label": `${op.op}: later`, title: "Later", ".disabled": index === ops().length - 1, "data-focus": `${key} down`, onclick: () => move(1) }, "↓"),
    el("button", { type: "button", class: "icon", "aria-label": `${op.op}: remove`, title: "Remove", "data-focus": `${key} remove`, onclick: () => changeOps((list) => { list.splice(index, 1); }) }, "×"));
  const item = el("li", { class: isOn ? "" : "off" }, head);
  if (!opened.has(key) || !schema) return item;
  const about = schema.description ? el("p", { class: "about" }, plainText(schema.description)) : null;
  const fields = Object.entries(schema.properties).filter(([name]) => name !== "op" && name !== "enabled").map(([name, of]) => field(name, /** @type {any} */ (of), op[name], (value) => changeOps((list) => {
    if (value === undefined) delete list[index][name];
    else list[index][name] = value;
  }), state.schema));
  item.append(el("div", { class: "fields" }, about, ...fields));
  return item;
}

/** @param {string} text of the schema */
function plainText(text) {
  return text.replaceAll("`", "").replaceAll("\n", " ");
}

/** @param {string} name */
function addOp(name) {
  if (!name) return;
  opened.add(`${ops().length} ${name}`);
  changeOps((list) => { list.push({ op: name }); });
}

/** @param {string} name */
async function takePreset(name) {
  if (!name) return;
  const preset = await getJson(`/v1/presets/${encodeURIComponent(name)}`);
  const config = preset.config ?? preset.content ?? preset;
  edit((draft) => Object.assign(draft, structuredClone(config)));
}

/** @param {HTMLElement} list */
function focusedPlace(list) {
  const focused = document.activeElement;
  return list.contains(focused) ? focused?.getAttribute("data-focus") ?? null : null;
}

/**
 * @param {HTMLElement} list
 * @param {string|null} place
 */
function focusAgain(list, place) {
  if (place) /** @type {HTMLElement|null} */ (list.querySelector(`[data-focus="${place}"]`))?.focus();
}

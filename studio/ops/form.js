// A field of a form for anything that the schema describes: new ops and parameters need no work here.

import { el, words } from "../dom.js";
import { choices, numberAmong, resolved } from "./schema.js";

/** @typedef {import("./schema.js").Schema} Schema */
/** @typedef {(value: any) => void} Change undefined takes the field out, so that the default stands */

let made = 0;

/**
 * @param {string} name
 * @param {Schema} schema
 * @param {any} value what stands there now; undefined is the default
 * @param {Change} change
 * @param {Schema} root
 * @returns {HTMLElement}
 */
export function field(name, schema, value, change, root) {
  const own = resolved(schema, root);
  const id = `field-${made += 1}`;
  const isDefault = value === undefined || JSON.stringify(value) === JSON.stringify(own.default);
  const about = (own.description ?? schema.description ?? "").replaceAll("`", "").replaceAll("\n", " ");
  const control = controlOf(own, value ?? own.default, change, root, id);
  const reset = !isDefault && el("button", { type: "button", class: "icon reset", title: "Back to the default", "aria-label": `${words(name)}: back to the default`, onclick: () => change(undefined) }, "⟲");
  return el("div", { class: `field${isDefault ? "" : " changed"}`, title: about }, el("label", { for: id }, words(name)), control, reset);
}

/**
 * @param {Schema} schema
 * @param {any} value
 * @param {Change} change
 * @param {Schema} root
 * @param {string} id
 * @returns {HTMLElement}
 */
function controlOf(schema, value, change, root, id) {
  if (schema.type === "boolean") {
    return el("input", { id, type: "checkbox", ".checked": value === true, onchange: (/** @type {any} */ event) => change(event.target.checked) });
  }
  if (["boolean", "undefined"].includes(typeof value) && schema.anyOf?.some((/** @type {Schema} */ kind) => resolved(kind, root).type === "boolean")) {
    return el("input", { id, type: "checkbox", ".checked": value === true, onchange: (/** @type {any} */ event) => change(event.target.checked || undefined) });
  }
  const words = choices(schema, root);
  if (words) return select(words, value, change, schema, id);
  const among = schema.type === "number" || schema.type === "integer" ? schema : numberAmong(schema, root);
  if (among && (value === undefined || value === null || typeof value === "number")) return number(among, value, change, id);
  if (schema.type === "array" && schema.minItems === schema.maxItems && ["number", "integer"].includes(resolved(schema.items ?? {}, root).type)) return vector(schema, value, change, id);
  if (schema.type === "array" && resolved(schema.items ?? {}, root).type === "string") return list(value, change, id);
  if (schema.type === "string") return el("input", { id, type: "text", ".value": value ?? "", onchange: (/** @type {any} */ event) => change(event.target.value || undefined) });
  return json(value, change, id);
}

/**
 * @param {{value: string, about: string}[]} words
 * @param {any} value
 * @param {Change} change
 * @param {Schema} schema
 * @param {string} id
 */
function select(words, value, change, schema, id) {
  const known = words.some((word) => word.value === value);
  const options = words.map(({ value: word, about }) => el("option", { value: word, title: about, ".selected": word === value }, word));
  if (!known) options.unshift(el("option", { value: "", ".selected": true }, value === undefined || value === null ? "–" : JSON.stringify(value)));
  return el("select", { id, onchange: (/** @type {any} */ event) => change(event.target.value === "" && schema.isOptional ? undefined : event.target.value) }, ...options);
}

/**
 * A slider where both ends are known, beside the number itself.
 * @param {Schema} schema
 * @param {number|undefined} value
 * @param {Change} change
 * @param {string} id
 */
function number(schema, value, change, id) {
  const { minimum, maximum, type } = schema;
  const step = type === "integer" ? 1 : "any";
  const box = el("input", {
    id, type: "number", step, min: minimum, max: maximum, ".value": value ?? "", placeholder: "–",
    onchange: (/** @type {any} */ event) => change(event.target.value === "" ? undefined : Number(event.target.value)),
  });
  if (minimum === undefined || maximum === undefined || maximum - minimum > 60) return box;
  const slider = el("input", {
    type: "range", min: minimum, max: maximum, step: type === "integer" ? 1 : (maximum - minimum) / 200, ".value": value ?? minimum, "aria-label": "slider",
    oninput: (/** @type {any} */ event) => { box.value = String(Number(Number(event.target.value).toFixed(4))); change(Number(box.value)); },
  });
  return el("span", { class: "pair" }, slider, box);
}

/**
 * @param {Schema} schema
 * @param {number[]|undefined} value
 * @param {Change} change
 * @param {string} id
 */
function vector(schema, value, change, id) {
  /** @type {(number|string)[]} */
  const values = value ?? Array(schema.minItems).fill("");
  const boxes = values.map((part, index) => el("input", {
    id: index === 0 ? id : undefined, type: "number", step: "any", ".value": part, "aria-label": `part ${index + 1}`, onchange: () => {
      const read = boxes.map((box) => (box.value === "" ? NaN : Number(box.value)));
      if (read.every(Number.isNaN)) change(undefined);
      else if (read.every(Number.isFinite)) change(read);
    },
  }));
  return el("span", { class: "vector" }, ...boxes);
}

/**
 * @param {string[]|undefined} value
 * @param {Change} change
 * @param {string} id
 */
function list(value, change, id) {
  return el("input", {
    id, type: "text", ".value": (value ?? []).join(", "), placeholder: "all", onchange: (/** @type {any} */ event) => {
      const names = event.target.value.split(",").map((/** @type {string} */ name) => name.trim()).filter(Boolean);
      change(names.length ? names : undefined);
    },
  });
}

/**
 * Anything else, as it is in the config.
 * @param {any} value
 * @param {Change} change
 * @param {string} id
 */
function json(value, change, id) {
  const text = value === undefined || value === null ? "" : JSON.stringify(value);
  return el("textarea", {
    id, rows: text.length > 40 ? 3 : 1, ".value": text, placeholder: "JSON", spellcheck: "false", onchange: (/** @type {any} */ event) => {
      const box = event.target;
      try {
        change(box.value.trim() === "" ? undefined : JSON.parse(box.value));
        box.setCustomValidity("");
      } catch {
        box.setCustomValidity("This is no JSON.");
        box.reportValidity();
      }
    },
  });
}

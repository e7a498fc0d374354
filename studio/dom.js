// Small helpers to build what is on the page. Text goes in as text, never as markup.

/**
 * Makes an element: attributes, properties (`.value`) and listeners (`onclick`) by name, then its children.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, any>} [attributes]
 * @param {...(Node|string|null|undefined|false)} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name.startsWith(".")) /** @type {any} */ (element)[name.slice(1)] = value;
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child !== null && child !== undefined && child !== false) element.append(child);
  return element;
}

/**
 * The element of that id; it is in the page.
 * @param {string} id
 * @returns {HTMLElement}
 */
export function byId(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`there is no #${id}`);
  return element;
}

/** @param {string} id */
export function canvasById(id) {
  return /** @type {HTMLCanvasElement} */ (byId(id));
}

/**
 * A name of the wire for people: `left_upper_arm` is "left upper arm".
 * @param {string} name
 */
export function words(name) {
  return name.replaceAll("_", " ");
}

/**
 * A number for people.
 * @param {number|null|undefined} value
 */
export function short(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size < 5e-4) return "0";
  return size >= 100 ? value.toFixed(0) : size >= 10 ? value.toFixed(1) : size >= 0.095 ? value.toFixed(2) : value.toFixed(3);
}

/** @type {Record<string, string>} */
const UNITS = { degrees: "°", percent: " %", count: "", ratio: "×" };

/**
 * A measured value with its unit, for people.
 * @param {number|null|undefined} value
 * @param {string} unit as the report has it
 */
export function measured(value, unit) {
  if (value === null || value === undefined) return "–";
  if (unit === "share") return `${short(value * 100)} %`;
  return `${short(value)}${UNITS[unit] ?? ` ${unit.replace("degrees", "°").replace("frame", "f")}`}`;
}

/**
 * A drawn sign, for buttons.
 * @param {string} path of an SVG of 16 by 16
 */
export function icon(path) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
  line.setAttribute("d", path);
  svg.append(line);
  return svg;
}

/** @type {Map<string, string>} */
const colors = new Map();

/**
 * A color of the style sheet.
 * @param {string} name
 */
export function color(name) {
  const known = colors.get(name) ?? getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  colors.set(name, known);
  return known;
}

/** Has colors read anew, after a change of the theme. */
export function forgetColors() {
  colors.clear();
}

/**
 * Calls once things have been quiet for so long.
 * @template {any[]} A
 * @param {number} milliseconds
 * @param {(...args: A) => void} call
 * @returns {(...args: A) => void}
 */
export function debounced(milliseconds, call) {
  let timer = 0;
  return (...args) => {
    clearTimeout(timer);
    timer = window.setTimeout(() => call(...args), milliseconds);
  };
}

/**
 * Gives a file to the person.
 * @param {Blob} blob
 * @param {string} name
 */
export function save(blob, name) {
  const url = URL.createObjectURL(blob);
  const link = el("a", { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

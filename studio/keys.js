// Everything by keyboard: what each key does, and the list of them.

import { byId, el } from "./dom.js";

/** @typedef {{keys: string, about: string, run: (event: KeyboardEvent) => void, on: (event: KeyboardEvent) => boolean}} Key */

/** @type {Key[]} */
const known = [];

/** @type {() => boolean} */
let areWanted = () => true;

/** Says when keys do something that do not say it themselves. @param {() => boolean} are */
export function keysAreFor(are) {
  areWanted = are;
}

/**
 * @param {string} keys as they are shown, such as "Ctrl+Z"
 * @param {string} about
 * @param {(event: KeyboardEvent) => void} run
 * @param {() => boolean} [isWanted] else the key does what it always does
 */
export function key(keys, about, run, isWanted = () => areWanted()) {
  const wanted = keys.split(" or ").map((combination) => {
    const parts = combination.split("+");
    const last = parts.pop() ?? "";
    return { last: /** @type {Record<string, string>} */ ({ Space: " ", "←": "ArrowLeft", "→": "ArrowRight", Esc: "Escape" })[last] ?? last, ctrl: parts.includes("Ctrl"), shift: parts.includes("Shift") };
  });
  const on = (/** @type {KeyboardEvent} */ event) => isWanted() && wanted.some(({ last, ctrl, shift }) => {
    const isKey = event.key.toLowerCase() === last.toLowerCase();
    const isShift = event.shiftKey === shift || (last.length === 1 && !/[a-z0-9]/i.test(last));
    return isKey && (event.ctrlKey || event.metaKey) === ctrl && isShift && !event.altKey;
  });
  known.push({ keys, about, run, on });
}

/** Whether a key is for the box that has the focus. @param {KeyboardEvent} event */
function isTyping(event) {
  const { target } = event;
  if (event.ctrlKey || event.metaKey) return target instanceof HTMLTextAreaElement && event.key.toLowerCase() === "z";
  if (target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement) return event.key !== "Escape";
  if (target instanceof HTMLInputElement) return target.type === "checkbox" ? event.key === " " : event.key !== "Escape";
  if (target instanceof HTMLButtonElement || target instanceof HTMLAnchorElement) return event.key === " " || event.key === "Enter";
  return target instanceof HTMLElement && target.getAttribute("role") === "tab" && event.key.startsWith("Arrow");
}

export function listen() {
  document.addEventListener("keydown", (event) => {
    if (/** @type {HTMLDialogElement} */ (byId("dialog")).open) return;
    if (isTyping(event)) return;
    const found = known.find((of) => of.on(event));
    if (!found) return;
    event.preventDefault();
    found.run(event);
  });
}

export function showKeys() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("dialog"));
  dialog.replaceChildren(
    el("form", { method: "dialog", class: "dialog-head" }, el("h2", {}, "Keys"), el("button", { class: "icon", "aria-label": "Close" }, "×")),
    el("dl", { class: "keys" }, ...known.flatMap(({ keys, about }) => [el("dt", {}, ...keys.split(" or ").flatMap((text, index) => [index ? " or " : "", el("kbd", {}, text)])), el("dd", {}, about)])),
    el("p", { class: "hint" }, "In the picture: left drag turns, right or Shift and drag moves, the wheel zooms, a click selects a joint, a double click goes to it."),
    el("p", { class: "hint" }, el("a", { href: "/docs/guide/studio", target: "_blank", rel: "noopener" }, "The guide"), " tells more."),
  );
  dialog.showModal();
}

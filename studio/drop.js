// Files by dropping them anywhere, or by a button.

import { byId } from "./dom.js";

/** @typedef {"source"|"target"} Slot */

/**
 * @param {(slot: Slot, files: File[]) => void} take
 * @param {() => boolean} hasSource
 */
export function dropping(take, hasSource) {
  const zones = byId("zones");
  let depth = 0;
  const isOfFiles = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files") ?? false;
  const end = () => {
    depth = 0;
    zones.hidden = true;
    for (const zone of zones.children) zone.classList.remove("over");
  };
  const zoneAt = (/** @type {DragEvent} */ event) => /** @type {HTMLElement|null} */ (event.target instanceof Element ? event.target.closest("[data-zone]") : null);
  addEventListener("dragenter", (event) => {
    if (!isOfFiles(event)) return;
    depth += 1;
    zones.hidden = false;
  });
  addEventListener("dragleave", () => {
    depth -= 1;
    if (depth <= 0) end();
  });
  addEventListener("dragover", (event) => {
    if (!isOfFiles(event)) return;
    event.preventDefault();
    const over = zoneAt(event);
    for (const zone of zones.children) zone.classList.toggle("over", zone === over);
  });
  addEventListener("drop", (event) => {
    if (!isOfFiles(event)) return;
    event.preventDefault();
    const files = [...event.dataTransfer?.files ?? []];
    const zone = zoneAt(event)?.dataset.zone;
    end();
    if (zone) take(/** @type {Slot} */ (zone), files);
    // Beside the zones: two files are a clip and a character, one is what is missing.
    else if (files.length === 2) for (const [index, file] of byKind(files).entries()) take(index === 0 ? "source" : "target", [file]);
    else take(hasSource() ? "target" : "source", files);
  });
}

/** Endings that hold clips and no character come first. */
const CLIPS = ["bvh", "vrma", "npz", "csv"];

/** @param {File[]} files */
function byKind(files) {
  const isClip = (/** @type {File} */ file) => CLIPS.includes(file.name.split(".").pop()?.toLowerCase() ?? "");
  return [...files].sort((one, other) => Number(isClip(other)) - Number(isClip(one)));
}

/**
 * Lets the person choose files.
 * @param {boolean} isMany
 * @returns {Promise<File[]>}
 */
export function choose(isMany = false) {
  const picker = /** @type {HTMLInputElement} */ (byId("picker"));
  picker.multiple = isMany;
  picker.value = "";
  return new Promise((resolve) => {
    picker.onchange = () => resolve([...picker.files ?? []]);
    picker.click();
  });
}

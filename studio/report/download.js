// What can be taken away: the result in any format, the config, the report, a picture, and how to do it again.

import { getBytes, getJson, Refused } from "../api/client.js";
import { attempt, pair } from "../api/live.js";
import { byId, el, save } from "../dom.js";
import { state } from "../state.js";
import { commandLine, curl, python } from "./recipes.js";

/** @typedef {{name: string, endings: string[], media_type: string, writes: boolean, description: string}} Format */

/** Formats that are offered first. */
const FIRST = ["glb", "fbx", "bvh", "vrma", "vrm", "poses_npz"];
const PICTURES = ["png", "webp", "gif", "apng", "mp4"];
/** What only drawings are written as. */
const FLAT = ["png_zip", "poses2d_npz", "poses2d_json", "drawing"];
/** @type {Format[]} */
let formats = [];

/** @param {string} name */
function stem(name) {
  return name.replace(/\.[^.]+$/, "");
}

function resultName() {
  return `${stem(state.source?.file_name ?? "clip")}_on_${stem(state.target?.file_name ?? "character")}`;
}

/**
 * The result in a format, as the command line makes it from the same config.
 * @param {Format} format
 */
async function downloadResult({ name, endings, media_type }) {
  // The format is no part of the config, so that the file is the one that the command line makes of it.
  let job = await getJson("/v1/jobs", { json: { ...pair(), output: [name] }, headers: { prefer: "wait=60" } });
  while (["queued", "running"].includes(job.state)) job = await getJson(`/v1/jobs/${job.id}`, { headers: { prefer: "wait=60" } });
  if (!job.results?.length) throw new Refused(job.problem ?? { code: "canceled", title: "The job was stopped", detail: `The job ${job.id} was stopped.`, status: 0 });
  save(new Blob([await getBytes(`/v1/results/${job.results[0].id}/content`)], { type: media_type }), `${resultName()}.${endings[0]}`);
}

/** What the command line is given: nothing that is the page's own. */
export function exportedConfig() {
  return state.config;
}

export async function saveConfig(isFull = false) {
  const config = isFull ? await getJson(`/v1/jobs/${state.job}/config`) : exportedConfig();
  save(new Blob([`${JSON.stringify(config, null, 2)}\n`], { type: "application/json" }), isFull ? "config.full.json" : "config.json");
}

/** @param {(origin: any) => string} recipe */
async function copy(recipe) {
  if (!state.source || !state.target) return;
  const format = formats.find(({ name }) => name === "glb");
  const text = recipe({ origin: location.origin, source: state.source, target: state.target, config: exportedConfig(), ending: "glb", mediaType: format?.media_type ?? "model/gltf-binary" });
  const place = byId("recipe");
  place.textContent = text;
  place.hidden = false;
  await navigator.clipboard?.writeText(text).catch(() => {});
}

export async function openDownloads() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("dialog"));
  formats = formats.length ? formats : (await getJson("/v1/formats")).formats;
  const has = Boolean(state.source && state.target);
  const written = formats.filter(({ writes, name }) => writes && !PICTURES.includes(name) && !FLAT.includes(name));
  written.sort((one, other) => place(one.name) - place(other.name));
  const pictures = formats.filter(({ writes, name }) => writes && PICTURES.includes(name));
  const of = (/** @type {Format} */ format) => el("button", { type: "button", ".disabled": !has, title: format.description, "data-format": format.name, onclick: () => void attempt(() => downloadResult(format)) }, format.name.replaceAll("_", " "));
  dialog.replaceChildren(
    el("form", { method: "dialog", class: "dialog-head" }, el("h2", {}, "Take it away"), el("button", { class: "icon", "aria-label": "Close" }, "×")),
    has ? "" : el("p", { class: "empty" }, "Open a clip and a character first."),
    el("h3", {}, "The result"), el("div", { class: "choices" }, ...written.map(of)),
    el("h3", {}, "As a picture"), el("div", { class: "choices" }, ...pictures.map(of)),
    el("h3", {}, "The config"), el("div", { class: "choices" },
      el("button", { type: "button", id: "save-config", onclick: () => void saveConfig() }, "What I changed"),
      el("button", { type: "button", ".disabled": !state.job, onclick: () => void attempt(() => saveConfig(true)) }, "Everything filled in"),
      el("button", { type: "button", ".disabled": !state.report, onclick: () => save(new Blob([JSON.stringify(state.report, null, 2)], { type: "application/json" }), "report.json") }, "The report")),
    el("h3", {}, "How to do it again"), el("div", { class: "choices" },
      el("button", { type: "button", ".disabled": !has, onclick: () => void copy(curl) }, "Copy curl"),
      el("button", { type: "button", ".disabled": !has, onclick: () => void copy(commandLine) }, "Copy command line"),
      el("button", { type: "button", ".disabled": !has, onclick: () => void copy(python) }, "Copy Python")),
    el("pre", { id: "recipe", hidden: true, tabindex: 0 }),
  );
  dialog.showModal();
}

/** @param {string} name */
function place(name) {
  const at = FIRST.indexOf(name);
  return at < 0 ? FIRST.length : at;
}

// What of a drawing can be taken away: the moving picture in any format, the drawing itself, the config, and how to do it again.

import { getBytes, getJson } from "../api/client.js";
import { attempt } from "../api/live.js";
import { el, save } from "../dom.js";
import { quoted } from "../report/recipes.js";
import { state } from "../state.js";
import { archiveOf } from "./character.js";
import { drawn, lastArchive, moved } from "./live.js";

const FORMATS = ["gif", "webp", "apng", "mp4", "png_zip", "glb", "poses2d_npz", "poses2d_json"];

/** What the command line is given. */
function config() {
  return { task: "draw", ...drawn.config };
}

/** @param {string} format */
async function download(format) {
  const job = await moved([format]);
  const [result] = job.results;
  const bytes = await getBytes(`/v1/results/${result.id}/content`);
  const ending = result.file_name.split(".").pop();
  save(new Blob([bytes]), `${drawn.drawing?.name ?? "drawing"}_moves.${ending}`);
}

function commandLine() {
  const name = `${drawn.drawing?.name ?? "drawing"}.zip`;
  return [
    "cat >config.json <<'EOF'", JSON.stringify(config(), null, 2), "EOF",
    `retargetd draw --drawing ${quoted(name)} --source ${quoted(state.source?.file_name ?? "")} --config config.json --output moves.gif`,
  ].join("\n");
}

function curl() {
  const body = JSON.stringify({ source: { asset: state.source?.id }, target: { asset: lastArchive() }, config: config(), output: ["gif"] });
  return [`curl --fail-with-body ${location.origin}/v1/jobs \\`, "  -H 'content-type: application/json' -H 'prefer: wait=60' \\", `  -d ${quoted(body)}`].join("\n");
}

/** @returns {HTMLElement} */
export function takeAway() {
  const recipe = el("pre", { hidden: true, tabindex: 0 });
  const formats = el("div", { class: "choices" });
  const copy = async (/** @type {string} */ text) => {
    recipe.textContent = text;
    recipe.hidden = false;
    await navigator.clipboard?.writeText(text).catch(() => {});
  };
  void getJson("/v1/formats").then(({ formats: known }) => {
    const written = known.filter((/** @type {any} */ { name, writes }) => writes && FORMATS.includes(name));
    written.sort((/** @type {any} */ one, /** @type {any} */ other) => FORMATS.indexOf(one.name) - FORMATS.indexOf(other.name));
    formats.append(...written.map((/** @type {any} */ { name, description }) => el("button", { type: "button", title: description, "data-drawn": name, onclick: () => void attempt(() => download(name)) }, name.replaceAll("_", " "))));
  });
  return el("div", {}, formats, el("div", { class: "choices" },
    el("button", { type: "button", id: "save-drawing", title: "Picture, mask and joints, as Animated Drawings has them", onclick: () => void attempt(async () => { if (drawn.drawing) save(await archiveOf(drawn.drawing), `${drawn.drawing.name}.zip`); }) }, "The drawing"),
    el("button", { type: "button", id: "save-draw-config", onclick: () => save(new Blob([`${JSON.stringify(config(), null, 2)}\n`], { type: "application/json" }), "config.json") }, "What I changed"),
    el("button", { type: "button", onclick: () => void copy(curl()) }, "Copy curl"),
    el("button", { type: "button", onclick: () => void copy(commandLine()) }, "Copy command line")), recipe);
}

// The page: what is where, and what begins.

import { getJson, onKeyNeeded, request, setKey } from "./api/client.js";
import { attempt, figures, onFigure, open, showSourceClip, useAsset } from "./api/live.js";
import { addToBatch, setUpBatch, showBatch } from "./batch/panel.js";
import { byId, canvasById, el, forgetColors } from "./dom.js";
import { choose, dropping } from "./drop.js";
import { listenToParent, openFromAddress, showDrawingsBy } from "./embed.js";
import { key, keysAreFor, listen, showKeys } from "./keys.js";
import { mappingPanel } from "./mapping/panel.js";
import { editsPanel } from "./ops/edits.js";
import { opsPanel } from "./ops/panel.js";
import { posePanel } from "./pose/panel.js";
import { openDownloads, saveConfig } from "./report/download.js";
import { pin, reportPanel } from "./report/panel.js";
import { canRedo, canUndo, edit, redo, resetConfig, set, state, undo, watch } from "./state.js";
import { tabs } from "./tabs.js";
import { faster, pause, play, player, seek, seekFrame, slower, step, toggle } from "./timeline/player.js";
import { Timeline } from "./timeline/timeline.js";
import { transport, trimHere, trimStrip } from "./timeline/transport.js";
import { viewTools } from "./view/tools.js";
import { Viewer } from "./view/viewer.js";

/** @param {import("./api/types.js").Worst} worst */
function goTo(worst) {
  pause();
  set({ posing: false });
  if (worst.frame >= 0) seekFrame(worst.frame);
  else seek(worst.time_seconds);
  if (worst.joint) {
    set({ joint: worst.joint });
    viewer.focus(worst.joint);
  }
}

const timeline = new Timeline(canvasById("timeline"), ({ worst }) => goTo(worst));
const viewer = new Viewer(timeline);
viewTools(byId("tools"), viewer);
transport(byId("transport"), timeline);
trimStrip(byId("trim"));
const showTab = tabs(byId("tabs"), byId("panels"), [
  ["report", "Report", (panel) => reportPanel(panel, goTo)],
  ["mapping", "Mapping", mappingPanel],
  ["pose", "Rest pose", posePanel],
  ["ops", "Ops", opsPanel],
  ["edits", "Edits", editsPanel],
]);

/** @param {"source"|"target"} slot @param {File[]} files */
function take(slot, files) {
  if (page === "batch") return void addToBatch(slot === "source" ? "sources" : "targets", files);
  if (files.length > 1) {
    void showPage("batch");
    return void addToBatch(slot === "source" ? "sources" : "targets", files);
  }
  if (files[0]) void open(slot, files[0], files[0].name, showDrawing).then(begin);
}

function begin() {
  if (!player.isPlaying && !state.posing) play();
}

async function openSample() {
  resetConfig();
  await attempt(async () => {
    const [walk, mannequin] = await Promise.all(["walk.glb", "mannequin.glb"].map(sampleAsset));
    await Promise.all([useAsset("source", walk), useAsset("target", mannequin)]);
    begin();
  });
}

/** @typedef {"stage"|"batch"|"drawing"} Page */
/** @type {Page} */
let page = "stage";

/** @param {Page} wanted */
async function showPage(wanted) {
  page = wanted;
  for (const name of /** @type {Page[]} */ (["stage", "batch", "drawing"])) byId(name).hidden = name !== wanted;
  for (const name of ["batch", "drawing"]) byId(`show-${name}`).setAttribute("aria-pressed", String(name === wanted));
  drawBar();
  if (wanted === "batch") showBatch((slot) => void choose(true).then((files) => addToBatch(slot, files)));
  if (wanted === "drawing") (await drawingPage()).draw();
}

/** @type {Promise<ReturnType<typeof import("./drawing/panel.js").drawingPage>>|null} fetched when somebody wants it */
let drawing = null;
function drawingPage() {
  return drawing ??= import("./drawing/panel.js").then((module) => module.drawingPage({
    file: () => void choose().then((files) => take("target", files)), sample: () => void attempt(async () => showDrawing(await sampleAsset("drawing.zip"))),
  }));
}

let drawingName = "";
/** @param {import("./api/types.js").Asset} asset a drawing @param {Record<string, any>} [config] */
async function showDrawing(asset, config) {
  drawingName = asset.file_name;
  await showPage("drawing");
  await (await import("./drawing/live.js")).openDrawing(asset, config);
}

/** A sample that the service has made an asset. @param {string} name @returns {Promise<import("./api/types.js").Asset>} */
function sampleAsset(name) {
  return getJson(`sample/${name}`, { method: "POST" });
}

/** Asks for a key in words. @returns {Promise<boolean>} */
function askForKey() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("dialog"));
  const box = el("input", { type: "password", id: "key", autocomplete: "off", required: true, placeholder: "rtk_…" });
  dialog.replaceChildren(el("form", { method: "dialog", class: "key" },
    el("h2", {}, "This service asks for a key"), el("p", {}, "Whoever runs it makes one with ", el("code", {}, "retargetd keys create"), ". It stays in this page only, until it is closed."),
    el("label", { for: "key" }, "Key"), box, el("div", { class: "row" }, el("button", { class: "primary", value: "use" }, "Use it"), el("button", { value: "", formnovalidate: true }, "Not now"))));
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      if (dialog.returnValue === "use") setKey(box.value);
      resolve(dialog.returnValue === "use" && box.value.trim() !== "");
      dialog.returnValue = "";
    }, { once: true });
  });
}
/** @type {Promise<boolean>|null} several requests ask once */
let asking = null;
onKeyNeeded(() => (asking ??= askForKey().finally(() => { asking = null; })));

byId("open-source").addEventListener("click", () => void choose().then((files) => take("source", files)));
byId("open-target").addEventListener("click", () => void choose().then((files) => take("target", files)));
byId("open-sample").addEventListener("click", () => {
  void showPage("stage");
  void openSample();
});
/** Of the page that is shown. @param {"undo"|"redo"} way */
async function go(way) {
  if (page === "drawing") (await drawingPage())[way]();
  else if (page === "stage") ({ undo, redo })[way]();
}
byId("undo").addEventListener("click", () => void go("undo"));
byId("redo").addEventListener("click", () => void go("redo"));
byId("show-download").addEventListener("click", () => void attempt(openDownloads));
for (const name of /** @type {Page[]} */ (["batch", "drawing"])) byId(`show-${name}`).addEventListener("click", () => void showPage(page === name ? "stage" : name));
byId("show-help").addEventListener("click", showKeys);
byId("verdict").addEventListener("click", () => {
  void showPage("stage");
  showTab("report");
});
byId("theme").addEventListener("click", () => {
  const { dataset } = document.documentElement;
  const now = dataset.scheme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  dataset.scheme = now === "dark" ? "light" : "dark";
  repaint();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
function repaint() {
  forgetColors();
  viewer.stage.paint();
  viewer.stage.setMode(viewer.stage.mode);
  timeline.isDirty = true;
  viewer.touch();
}
dropping(take, () => state.source !== null);
setUpBatch(({ source, target }) => {
  void showPage("stage");
  const kept = state.config;
  void attempt(async () => {
    await useAsset("source", source);
    await useAsset("target", target);
    set({ config: kept });
    begin();
  });
});

/** Other keys are for the figures, and do nothing where those are not seen. */
const anywhere = () => true;
keysAreFor(() => page === "stage");
key("Space", "play and pause", toggle);
key("← or →", "one frame back and on", (event) => step(event.key === "ArrowLeft" ? -1 : 1));
key("Shift+← or Shift+→", "ten frames back and on", (event) => step(event.key === "ArrowLeft" ? -10 : 10));
key("Home or End", "first and last frame", (event) => { pause(); seekFrame(event.key === "Home" ? 0 : Infinity); });
key("J or L", "slower and faster", (event) => (event.key.toLowerCase() === "j" ? slower() : faster()));
key("K", "pause", pause);
key("[ or ]", "the clip begins or ends here", (event) => trimHere(event.key === "[" ? "start" : "end"));
key("G", "source as a ghost over the result", () => viewer.toggleGhost());
key("W", "wipe between source and result", () => viewer.setMode(viewer.stage.mode === "wipe" ? "beside" : "wipe"));
key("B", "bones", () => viewer.toggleBones());
key("M", "meshes", () => viewer.toggleMesh());
key("C", "contacts", () => viewer.toggleContacts());
key("T", "trails of hands, feet and pelvis", () => viewer.toggleTrails());
key("V", "go along with the figures", () => viewer.toggleFollow());
key("S", "true sizes", () => viewer.toggleSize());
key("F", "show all", () => viewer.stage.fit());
key("1 or 3 or 7", "front, side, top", (event) => viewer.stage.fit(event.key === "1" ? "front" : event.key === "3" ? "side" : "top"));
key("P", "rest pose", () => { set({ posing: !state.posing }); showTab("pose"); });
key("Q", "turn about the joint's own axes or the character's", () => viewer.gizmo.toggleSpace());
key("X or Y or Z", "turn about this axis only", (event) => viewer.gizmo.lock(/** @type {"X"|"Y"|"Z"} */ (event.key.toUpperCase())));
key("A", "pin the result as A", pin);
/** After Esc, Tab leaves the picture as it leaves everything else: who has no mouse must get on. */
let leavesByTab = false;
byId("canvas").addEventListener("focus", () => { leavesByTab = false; });
key("Tab", "on the picture A or B, where one is pinned; after Esc, on to the next button", () => set({ showsPinned: !state.showsPinned }), () => state.pinned !== null && !leavesByTab && document.activeElement?.id === "canvas");
key("Ctrl+Z", "undo", () => void go("undo"), anywhere);
key("Ctrl+Shift+Z or Ctrl+Y", "redo", () => void go("redo"), anywhere);
key("Ctrl+S", "save the config", () => void saveConfig());
key("O", "open a clip", () => byId("open-source").click(), anywhere);
key("Shift+O", "open a character", () => byId("open-target").click(), anywhere);
key("?", "this list", showKeys, anywhere);
key("Esc", "leave what is open", () => {
  leavesByTab = true;
  set({ posing: false, joint: "", sourceJoint: "" });
});
listen();

const clips = /** @type {HTMLSelectElement} */ (byId("clip"));
clips.addEventListener("change", () => {
  edit((config) => { config.clip = clips.value; delete config.edit?.range; });
  void attempt(showSourceClip);
});
onFigure(() => {
  const facts = figures.source?.facts;
  clips.replaceChildren(...(facts?.clips ?? []).map(({ name, seconds }) => el("option", { value: name, ".selected": name === facts?.clip }, `${name || "unnamed"} · ${seconds.toFixed(1)} s`)));
  clips.hidden = (facts?.clips.length ?? 0) < 2;
});
function drawBar() {
  byId("open-source").textContent = state.source?.file_name ?? "Clip…";
  const isDrawing = page === "drawing";
  byId("open-target").textContent = isDrawing ? drawingName || "Drawing…" : state.target?.file_name ?? "Character…";
  byId("show-download").hidden = page !== "stage";
  /** @type {HTMLButtonElement} */ (byId("undo")).disabled = page !== "stage" || !canUndo();
  /** @type {HTMLButtonElement} */ (byId("redo")).disabled = page !== "stage" || !canRedo();
  const measures = state.report?.measures;
  const verdict = byId("verdict");
  verdict.hidden = !measures || page !== "stage";
  verdict.className = `verdict ${measures?.verdict ?? ""}`;
  verdict.textContent = measures?.verdict.replaceAll("_", " ") ?? "";
  verdict.title = measures?.verdict_reason ?? "";
  byId("busy").hidden = !state.busy;
  byId("busy").textContent = state.progress || "working…";
}
watch(["source", "target", "config", "report", "busy", "progress"], drawBar);

/** For tests, and for who looks from the console. */
Object.assign(globalThis, { studio: { state, viewer, player } });
showDrawingsBy(showDrawing);
listenToParent();
void request("/v1/schemas/retarget-spec").then(async (answer) => set({ schema: await answer.json() }));
void openFromAddress().then((isNamed) => { if (!isNamed) void openSample(); });

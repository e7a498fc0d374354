// What is known of the drawing on the page, its way back, and the moving picture that comes of it: one request at a time, the older one dropped.

import { getBytes, getJson, Refused, upload } from "../api/client.js";
import { attempt } from "../api/live.js";
import { hideProblem, showProblem } from "../api/problem.js";
import { debounced } from "../dom.js";
import { state } from "../state.js";
import { archiveOf, find, maskPicture, readDrawing } from "./character.js";

/** @typedef {import("./character.js").Drawing} Drawing */
/** @typedef {Record<string, any>} Config */
/** @typedef {{joints: string, mask: Uint8Array, config: string}} Kept */

const PAUSE_MILLISECONDS = 350;
const LONGEST_WAY_BACK = 40;

export const drawn = {
  /** @type {Drawing|null} */
  drawing: null,
  /** @type {Drawing|null} as it came, for who wants to begin again */
  first: null,
  /** The draw spec, or the part of it that somebody has changed. @type {Config} */
  config: {},
  job: "",
  /** Address of the moving picture, in the page's memory. */
  picture: "",
  /** @type {any} */
  report: null,
  /** With everything filled in. @type {Config|null} */
  resolved: null,
  isBusy: false,
  progress: "",
};

/** @type {Kept[]} */
let past = [];
/** @type {Kept[]} */
let future = [];
/** @type {Set<() => void>} */
const listeners = new Set();
/** @type {AbortController|null} */
let running = null;
let archive = "";

/** @param {() => void} call after anything of this has changed */
export function onDrawn(call) {
  listeners.add(call);
}

function tell() {
  for (const call of listeners) call();
}

/** @returns {Kept} */
function kept() {
  const { drawing, config } = drawn;
  return { joints: JSON.stringify(drawing?.joints ?? []), mask: drawing?.mask.slice() ?? new Uint8Array(), config: JSON.stringify(config) };
}

/** Remembers how things are, before they are changed. */
export function remember() {
  past.push(kept());
  if (past.length > LONGEST_WAY_BACK) past.shift();
  future = [];
}

/** @param {Kept[]} from @param {Kept[]} to */
function go(from, to) {
  const back = from.pop();
  if (!back || !drawn.drawing) return;
  to.push(kept());
  Object.assign(drawn.drawing, { joints: JSON.parse(back.joints), mask: back.mask });
  drawn.config = JSON.parse(back.config);
  touch();
}

export const undoDrawing = () => go(past, future);
export const redoDrawing = () => go(future, past);
export const canUndoDrawing = () => past.length > 0;
export const canRedoDrawing = () => future.length > 0;

/** @param {(config: Config) => void} change works on a copy */
export function editDrawn(change) {
  const config = structuredClone(drawn.config);
  change(config);
  for (const [name, value] of Object.entries(config)) if (value && typeof value === "object" && !Object.keys(value).length) delete config[name];
  if (JSON.stringify(config) === JSON.stringify(drawn.config)) return;
  remember();
  drawn.config = config;
  touch();
}

/** After joints, mask or config have changed. */
export function touch() {
  tell();
  refresh();
}

/** @param {Drawing} drawing */
function take(drawing) {
  drawn.drawing = drawing;
  drawn.first = { ...drawing, joints: structuredClone(drawing.joints), mask: drawing.mask.slice(), sureness: { ...drawing.sureness } };
  past = [];
  future = [];
  touch();
}

/**
 * Shows a drawing, or a picture in which one is looked for.
 * @param {import("../api/types.js").Asset} asset
 * @param {Config} [config]
 */
export async function openDrawing(asset, config) {
  const drawing = await readDrawing(asset);
  // Joints and planes are those of one drawing; how it moves and is shown stays.
  const { retarget: _, drawing: __, ...kept } = drawn.config;
  drawn.config = config ?? kept;
  Object.assign(drawn, { picture: "", report: null, resolved: null, job: "" });
  take(drawing);
}

/** Looks for joints anew, within the mask as it is painted. @param {string} rig */
export async function findAgain(rig) {
  const { drawing } = drawn;
  if (!drawing) return;
  await attempt(async () => take(await find(new Blob([drawing.texture]), drawing.name, rig, await maskPicture(drawing))));
}

/** Joints and mask as they came. */
export function beginAgain() {
  const { drawing, first } = drawn;
  if (!drawing || !first) return;
  remember();
  Object.assign(drawing, { joints: structuredClone(first.joints), mask: first.mask.slice(), sureness: { ...first.sureness } });
  touch();
}

/** The drawing as it is, as an asset of the service. */
async function uploaded() {
  if (!drawn.drawing) throw new Error("There is no drawing.");
  const asset = await upload(await archiveOf(drawn.drawing), `${drawn.drawing.name}.zip`);
  archive = asset.id;
  return asset.id;
}

/**
 * The moving drawing in some formats.
 * @param {string[]} output
 * @param {AbortSignal} [signal]
 */
export async function moved(output, signal) {
  const body = { source: { asset: state.source?.id }, target: { asset: await uploaded() }, config: { task: "draw", ...drawn.config }, output };
  let job = await getJson("/v1/jobs", { json: body, headers: { prefer: "wait=5" }, signal });
  while (["queued", "running"].includes(job.state)) {
    const { done, total } = job.progress ?? {};
    drawn.progress = total ? `${Math.round((done / total) * 100)} %…` : "working…";
    tell();
    job = await getJson(`/v1/jobs/${job.id}`, { headers: { prefer: "wait=1" }, signal });
  }
  if (!job.results?.length) throw new Refused(job.problem ?? { code: "canceled", title: "The job was stopped", detail: `The job ${job.id} was stopped.`, status: 0 });
  return job;
}

/** The id of the archive that was moved last. */
export function lastArchive() {
  return archive;
}

async function run() {
  if (!drawn.drawing || !state.source) return;
  running?.abort();
  const own = new AbortController();
  running = own;
  const { signal } = own;
  drawn.isBusy = true;
  drawn.progress = "working…";
  tell();
  try {
    const job = await moved(["gif"], signal);
    const [bytes, report, resolved] = await Promise.all([
      getBytes(`/v1/results/${job.results[0].id}/content`, { signal }), getJson(`/v1/jobs/${job.id}/report`, { signal }), getJson(`/v1/jobs/${job.id}/config`, { signal }),
    ]);
    if (signal.aborted) return;
    if (drawn.picture) URL.revokeObjectURL(drawn.picture);
    Object.assign(drawn, { job: job.id, picture: URL.createObjectURL(new Blob([bytes], { type: "image/gif" })), report, resolved });
    hideProblem();
  } catch (error) {
    if (!signal.aborted) showProblem(error);
  } finally {
    if (running === own) {
      running = null;
      drawn.isBusy = false;
      drawn.progress = "";
      tell();
    }
  }
}

const refresh = debounced(PAUSE_MILLISECONDS, () => void run());

/** Another clip moves the drawing anew. */
export function clipChanged() {
  if (drawn.config.clip !== state.config.clip) drawn.config = { ...drawn.config, clip: state.config.clip };
  if (drawn.config.clip === undefined) delete drawn.config.clip;
  if (drawn.drawing) touch();
}


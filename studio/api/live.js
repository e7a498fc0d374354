// From a change to a new result: one request at a time, the older one dropped.

import { debounced } from "../dom.js";
import { set, state, watch } from "../state.js";
import { readFigure } from "../view/figure.js";
import { readMotion } from "../view/motion.js";
import { getBytes, getJson, Refused, request, upload } from "./client.js";
import { showProblem, hideProblem } from "./problem.js";

/** @typedef {import("./types.js").Config} Config */
/** @typedef {import("../view/figure.js").Figure} Figure */

const PAUSE_MILLISECONDS = 150;

/** @type {AbortController|null} */
let running = null;
/** @type {{source: Figure|null, target: Figure|null}} */
export const figures = { source: null, target: null };
/** @type {Set<() => void>} */
const shown = new Set();

/** @param {() => void} call after one of the figures is another one */
export function onFigure(call) {
  shown.add(call);
}

/**
 * Takes a file that somebody gave.
 * @param {"source"|"target"} slot
 * @param {Blob} file
 * @param {string} name
 * @param {(asset: import("./types.js").Asset) => Promise<void>} onDrawing takes those that are flat
 */
export async function open(slot, file, name, onDrawing) {
  await attempt(async () => {
    const asset = await upload(file, name);
    if (asset.format === "drawing") await onDrawing(asset);
    else await useAsset(slot, asset);
  }, name);
}

/**
 * Takes a file that the service has already.
 * @param {"source"|"target"} slot
 * @param {import("./types.js").Asset} asset
 */
export async function useAsset(slot, asset) {
  const figure = await readFigure(await getBytes(`/v1/assets/${asset.id}/display`));
  figures[slot] = figure;
  running?.abort();
  const config = structuredClone(state.config);
  delete config[slot];
  if (slot === "source") {
    delete config.clip;
    delete config.edit;
  }
  set({ [slot]: asset, config, proposal: null, motion: null, report: null, job: "", result: "", resultConfig: null, pinned: null, showsPinned: false });
  for (const call of shown) call();
}

/** Shows the clip of the source that the config names. */
export async function showSourceClip() {
  if (!state.source) return;
  const clip = state.config.clip;
  const query = clip === undefined ? "" : `?clip=${encodeURIComponent(clip)}`;
  figures.source = await readFigure(await getBytes(`/v1/assets/${state.source.id}/display${query}`));
  for (const call of shown) call();
}

/**
 * Does something that the service may refuse, and tells the person in words when it does.
 * @param {() => Promise<void>} work
 * @param {string} [about] the file that it is about
 */
export async function attempt(work, about) {
  set({ busy: true });
  try {
    await work();
    hideProblem();
  } catch (error) {
    if (!(error instanceof DOMException && error.name === "AbortError")) showProblem(error, about);
  } finally {
    set({ busy: running !== null });
  }
}

/**
 * The body of a request about both files.
 * @param {Config} [config]
 */
export function pair(config = state.config) {
  return { source: { asset: state.source?.id }, target: { asset: state.target?.id }, config };
}

/**
 * What is seen while something is changed: joints and animation, which is all that changes.
 * @param {Config} config
 */
function forView(config) {
  return { ...config, output: { format: "glb", include: "skeleton+animation", target_clips: "drop" } };
}

async function run() {
  if (!state.source || !state.target) return;
  running?.abort();
  const own = new AbortController();
  running = own;
  set({ busy: true });
  const begun = performance.now();
  const { signal } = own;
  const { config } = state;
  try {
    const answer = await request("/v1/retarget", { json: pair(forView(config)), signal, headers: { accept: "model/gltf-binary", prefer: "wait=60" } });
    const job = answer.headers.get("job-id") ?? "";
    const bytes = answer.status === 202 ? await awaited(job, signal) : await answer.arrayBuffer();
    const motion = readMotion(bytes);
    if (signal.aborted) return;
    set({ motion, job });
    performance.measure("change to result", { start: begun });
    const [report, record] = await Promise.all([
      getJson(`/v1/jobs/${job}/report`, { signal }), getJson(`/v1/jobs/${job}`, { signal }),
    ]);
    if (signal.aborted) return;
    hideProblem();
    set({ report, result: record.results[0]?.id ?? "", resultConfig: config });
    await propose(signal);
  } catch (error) {
    if (!signal.aborted) showProblem(error);
  } finally {
    if (running === own) {
      running = null;
      set({ busy: false, progress: "" });
    }
  }
}

/**
 * The first result of a job that takes longer than a request may wait.
 * @param {string} job
 * @param {AbortSignal} signal
 */
async function awaited(job, signal) {
  for (;;) {
    const record = await getJson(`/v1/jobs/${job}`, { signal, headers: { prefer: "wait=1" } });
    const { phase, done, total } = record.progress ?? {};
    set({ progress: phase ? `${phase}${total ? ` ${Math.round((done / total) * 100)} %` : ""}…` : "waiting for its turn…" });
    if (record.state === "succeeded") return getBytes(`/v1/results/${record.results[0].id}/content`, { signal });
    if (record.problem) throw new Refused(record.problem);
    if (record.state === "canceled") throw new DOMException("canceled", "AbortError");
  }
}

let proposedFor = "";

/**
 * What the service makes of the pair, where what decides that has changed.
 * @param {AbortSignal} [signal]
 */
export async function propose(signal) {
  const { ops: _, edit: __, report: ___, ...deciding } = state.config;
  const key = JSON.stringify([state.source?.id, state.target?.id, deciding, (state.config.ops ?? []).length === 0]);
  if (key === proposedFor && state.proposal) return;
  const proposal = await getJson("/v1/mapping-suggestions", { json: pair(deciding), signal });
  proposedFor = key;
  set({ proposal });
}

/** Has the result made anew, a moment after the last change. */
export const refresh = debounced(PAUSE_MILLISECONDS, () => void run());

watch(["config", "source", "target"], refresh);

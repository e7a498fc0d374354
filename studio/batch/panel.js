// Many clips onto many characters: a grid of pictures with the verdict of each.

import { getBytes, getJson, request, upload } from "../api/client.js";
import { attempt } from "../api/live.js";
import { showProblem } from "../api/problem.js";
import { byId, el, save } from "../dom.js";
import { state } from "../state.js";

/** @typedef {import("../api/types.js").Asset} Asset */
/** @typedef {import("../api/types.js").Job} Job */

const LOOK_EVERY = 700;
const ENDED = ["succeeded", "failed", "canceled"];

/** @type {{sources: Asset[], targets: Asset[], id: string, jobs: Map<number, Job>, pictures: Map<string, string>, state: string}} */
const batch = { sources: [], targets: [], id: "", jobs: new Map(), pictures: new Map(), state: "" };

/** @type {(asset: {source: Asset, target: Asset}) => void} */
let openPair = () => {};

/** @param {(pair: {source: Asset, target: Asset}) => void} open */
export function setUpBatch(open) {
  openPair = open;
}

/**
 * Takes files that were dropped or chosen.
 * @param {"sources"|"targets"} slot
 * @param {File[]} files
 */
export async function addToBatch(slot, files) {
  /** @type {[unknown, string][]} */
  const refused = [];
  await attempt(async () => {
    // One that is refused does not keep the others out.
    for (const file of files) {
      try {
        const asset = await upload(file, file.name);
        if (!batch[slot].some(({ id }) => id === asset.id)) batch[slot].push(asset);
      } catch (error) {
        refused.push([error, file.name]);
      }
    }
  });
  for (const [error, name] of refused) showProblem(error, name);
  draw();
}

/** @param {(slot: "sources"|"targets") => void} choose */
export function showBatch(choose) {
  if (state.source && !batch.sources.length) batch.sources.push(state.source);
  if (state.target && !batch.targets.length) batch.targets.push(state.target);
  chooseFiles = choose;
  draw();
}

/** @type {(slot: "sources"|"targets") => void} */
let chooseFiles = () => {};

function draw() {
  const place = byId("batch");
  const pairs = batch.sources.length * batch.targets.length;
  const ended = [...batch.jobs.values()].filter(({ state: of }) => ENDED.includes(of));
  const failed = ended.filter(({ state: of }) => of === "failed").length;
  const archive = el("button", { type: "button", ".disabled": !batch.id || !ended.some(({ state: of }) => of === "succeeded"), onclick: () => void attempt(async () => {
    save(new Blob([await getBytes(`/v1/batches/${batch.id}/archive`)], { type: "application/zip" }), "batch.zip");
  }) }, "Download all");
  place.replaceChildren(
    el("div", { class: "batch-head" },
      el("h2", {}, "Batch"),
      el("button", { type: "button", id: "batch-clips", onclick: () => chooseFiles("sources") }, "Add clips…"),
      el("button", { type: "button", id: "batch-characters", onclick: () => chooseFiles("targets") }, "Add characters…"),
      el("button", { type: "button", class: "primary", id: "batch-run", ".disabled": pairs === 0, onclick: () => void attempt(run) }, pairs ? `Retarget ${pairs} pair${pairs === 1 ? "" : "s"}` : "Retarget"),
      el("button", { type: "button", ".disabled": failed === 0, onclick: () => void attempt(retry) }, failed ? `Try ${failed} failed again` : "Try failed again"), archive,
      el("output", {}, batch.id ? `${ended.length} of ${batch.jobs.size} done. A click on a picture opens the pair.` : "What was changed in the studio is used for all pairs.")),
    pairs === 0 ? el("p", { class: "empty" }, "Add clips and characters, or drop them here: every clip goes onto every character.") : "",
    batch.sources.length + batch.targets.length > 0 ? grid() : "",
  );
}

function grid() {
  const remove = (/** @type {"sources"|"targets"} */ slot, /** @type {Asset} */ asset) => el("button", { type: "button", class: "icon", "aria-label": `Remove ${asset.file_name}`, onclick: () => {
    batch[slot] = batch[slot].filter(({ id }) => id !== asset.id);
    batch.id = "";
    batch.jobs.clear();
    draw();
  } }, "×");
  const head = el("tr", {}, el("td", {}), ...batch.targets.map((target) => el("th", { scope: "col" }, target.file_name, remove("targets", target))));
  const rows = batch.sources.map((source, row) => el("tr", {}, el("th", { scope: "row" }, source.file_name, remove("sources", source)),
    ...batch.targets.map((target, column) => cell(batch.jobs.get(row * batch.targets.length + column), source, target))));
  return el("div", { class: "grid-scroll" }, el("table", { class: "grid" }, el("thead", {}, head), el("tbody", {}, ...rows)));
}

/**
 * @param {Job|undefined} job
 * @param {Asset} source
 * @param {Asset} target
 */
function cell(job, source, target) {
  const verdict = job?.state === "failed" ? "fail" : job?.verdict ?? "none";
  const text = job ? (job.state === "succeeded" ? (job.verdict ?? "done").replaceAll("_", " ") : job.state) : "";
  const title = job?.problem?.detail ?? job?.verdict_reason ?? "";
  const picture = job && batch.pictures.get(job.id);
  const open = el("button", { type: "button", class: `cell ${verdict}`, title, "aria-label": `${text || "open"}: ${source.file_name} on ${target.file_name}`, onclick: () => openPair({ source, target }) },
    picture ? el("img", { src: picture, alt: "", width: 144, height: 144 }) : el("span", { class: "blank" }), el("span", { class: `badge ${verdict}` }, text || "open"));
  return el("td", {}, open, job?.problem ? el("p", { class: "reason" }, job.problem.detail) : null);
}

async function run() {
  const files = (/** @type {Asset[]} */ list) => list.map(({ id }) => ({ asset: id }));
  const body = { matrix: { sources: files(batch.sources), targets: files(batch.targets) }, defaults: { config: state.config, output: ["glb"] } };
  const made = await getJson("/v1/batches", { json: body });
  batch.id = made.id;
  batch.jobs.clear();
  await follow();
}

async function retry() {
  await request(`/v1/batches/${batch.id}/retry-failed`, { method: "POST" });
  await follow();
}

/** Looks until all have ended. Pictures come as jobs end. */
async function follow() {
  const { id } = batch;
  for (;;) {
    if (batch.id !== id) return;
    const jobs = await allJobs(id);
    for (const job of jobs) if (job.batch_item !== undefined) batch.jobs.set(job.batch_item, job);
    draw();
    const ended = [...batch.jobs.values()].filter(({ state: of }) => ENDED.includes(of));
    for (const job of ended) await picture(job);
    if (batch.jobs.size && ended.length === batch.jobs.size) return;
    await new Promise((resolve) => setTimeout(resolve, LOOK_EVERY));
  }
}

/** @param {string} id @returns {Promise<Job[]>} oldest first, so that what was asked for again wins */
async function allJobs(id) {
  const jobs = [];
  let cursor = "";
  do {
    const page = await getJson(`/v1/batches/${id}/jobs?limit=100${cursor && `&cursor=${cursor}`}`);
    jobs.push(...page.items);
    cursor = page.next_cursor ?? "";
  } while (cursor);
  return jobs.sort((one, other) => (one.created_at < other.created_at ? -1 : 1));
}

/** @param {Job} job */
async function picture(job) {
  const [result] = job.results ?? [];
  if (!result || batch.pictures.has(job.id)) return;
  const bytes = await getBytes(`/v1/results/${result.id}/preview.png?size=144`);
  batch.pictures.set(job.id, URL.createObjectURL(new Blob([bytes], { type: "image/png" })));
  draw();
}

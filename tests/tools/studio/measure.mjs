// node measure.mjs URL [MINUTES] [WHAT [FILE]]: what people wait for, and what the page takes. For a release build on a machine that does
// nothing else; docs/guide/studio.md has what came out. FILE is a long clip, to be changed as the sample is.
// WHAT is `all`, or `frames` for JavaScript and the heap alone. Prints JSON.
//
// - bytes: what is sent until the sample moves, the page's own files and everything
// - first_frame_ms: from the address to the first frame of the sample
// - change_ms: from a change to the new picture, without the pause that a next change is waited for
// - as_they_are, fat: JavaScript of a frame with the sample's figures, and with 50,000 triangles each
// - heap_megabytes: what the heap grows in MINUTES of play and changes, after each collection of garbage

import { execFileSync } from "node:child_process";
import { readFile } from "node:fs/promises";
import { basename } from "node:path";
import { changed, drop, result, withStudio } from "./page.mjs";

const [url, minutes = "0", only = "", clip] = process.argv.slice(2);
const TRIANGLES = 50_000;

/** The middle of some numbers. */
const middle = (values) => [...values].sort((one, other) => one - other)[Math.floor(values.length / 2)];

/** Switches an op off and on, and gives how long each new picture took. */
async function changes(page, times) {
  await page.click("#tab-ops");
  await page.evaluate(() => performance.clearMeasures());
  for (let time = 0; time < times; time += 1) {
    await changed(page, () => page.click('[aria-label="plant runs"]'));
  }
  return page.evaluate(() => performance.getEntriesByName("change to result").map(({ duration }) => duration));
}

/** A sphere of triangles on bones, in place of each figure's own body: what a heavy character takes. */
async function fatten(page) {
  return page.evaluate((count) => {
    const triangles = [];
    for (const side of ["source", "target"]) {
      const { figure } = studio.viewer.stage[side];
      const [mesh] = figure.meshes;
      const { index } = mesh.geometry;
      const many = new Uint32Array(count * 3);
      for (let at = 0; at < many.length; at += 1) many[at] = index.array[at % index.count];
      mesh.geometry.setIndex(new index.constructor(many, 1));
      triangles.push(mesh.geometry.index.count / 3);
    }
    return triangles;
  }, TRIANGLES);
}

/** The process of the page's own thread: the largest renderer among what this script has started. */
async function pageProcess() {
  const lines = execFileSync("ps", ["-eo", "pid=,ppid=,rss=,args="]).toString().trim().split("\n").map((line) => line.trim().split(/\s+/));
  const own = new Set([String(process.pid)]);
  for (let depth = 0; depth < 5; depth += 1) for (const [pid, parent] of lines) if (own.has(parent)) own.add(pid);
  const renderers = lines.filter(([pid, , , ...of]) => own.has(pid) && of.includes("--type=renderer"));
  return renderers.sort((one, other) => other[2] - one[2])[0]?.[0];
}

/** Milliseconds of the processor that the thread of the page has had. */
async function processor(pid) {
  const [nanoseconds] = (await readFile(`/proc/${pid}/task/${pid}/schedstat`, "utf8")).split(" ");
  return Number(nanoseconds) / 1e6;
}

/**
 * JavaScript of a frame: by the page's clock, which also counts while others have the processor; and all that the page's thread takes of the
 * processor, which does not, and has styles and layers of the page in it.
 */
async function script(page) {
  const pid = await pageProcess();
  await page.waitForTimeout(1_500);
  await page.evaluate(() => Object.assign(studio.viewer.stage.stats, { frames: 0, milliseconds: 0, script: 0 }));
  const begin = await processor(pid);
  await page.waitForFunction(() => studio.viewer.stage.stats.frames >= 20, null, { timeout: 300_000 });
  const end = await processor(pid);
  const of = await page.evaluate(() => studio.viewer.stage.stats);
  return { clock_ms: of.script / of.frames, processor_ms: (end - begin) / of.frames, frames: of.frames, draw_calls: of.calls };
}

async function heap(session) {
  await session.send("HeapProfiler.collectGarbage");
  const { usedSize } = await session.send("Runtime.getHeapUsage");
  return usedSize / 2 ** 20;
}

const told = {};
await withStudio(url, async (page) => {
  const session = await page.context().newCDPSession(page);
  await session.send("Network.enable");
  const addresses = new Map();
  const bytes = { page: 0, everything: 0 };
  session.on("Network.responseReceived", ({ requestId, response }) => addresses.set(requestId, new URL(response.url).pathname));
  session.on("Network.loadingFinished", ({ requestId, encodedDataLength }) => {
    bytes.everything += encodedDataLength;
    if (addresses.get(requestId)?.startsWith("/studio/")) bytes.page += encodedDataLength;
  });
  await page.reload();
  await result(page);
  told.bytes = { ...bytes };
  if (only !== "frames") await waits(page);
  told.as_they_are = await script(page);
  told.triangles = await fatten(page);
  told.fat = await script(page);
  if (Number(minutes) > 0) await grows(page, session);
});
console.log(JSON.stringify(told, null, 1));

/** How long people wait. */
async function waits(page) {
  const firsts = [];
  for (let time = 0; time < 3; time += 1) {
    await page.reload();
    await result(page);
    firsts.push(await page.evaluate(() => performance.getEntriesByName("first frame")[0].startTime));
  }
  told.first_frame_ms = middle(firsts);
  told.change_ms = { frames: 121, all: await changes(page, 7) };
  told.change_ms.middle = middle(told.change_ms.all);
  if (clip) {
    await readFile(clip);
    const { job } = await result(page);
    await drop(page, "source", [clip]);
    await page.waitForFunction((name) => studio.state.source?.file_name === name, basename(clip));
    const { frames } = await result(page, job);
    const all = await changes(page, 5);
    told.long_change_ms = { frames, all, middle: middle(all) };
    await page.reload();
    await result(page);
  }
}

/** How far the heap grows while the page is used. */
async function grows(page, session) {
  await page.reload();
  await result(page);
  await changes(page, 3);
  const begin = await heap(session);
  const until = Date.now() + Number(minutes) * 60_000;
  const heaps = [begin];
  while (Date.now() < until) {
    await changes(page, 2);
    for (const name of ["mapping", "pose", "edits", "report"]) await page.click(`#tab-${name}`);
    await page.waitForTimeout(3_000);
    heaps.push(await heap(session));
  }
  told.heap_megabytes = { minutes: Number(minutes), begin, end: heaps.at(-1), grows: heaps.at(-1) - begin, samples: heaps.map((of) => Number(of.toFixed(2))) };
}

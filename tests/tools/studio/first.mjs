// node first.mjs URL: the page by itself. The sample plays, nothing leaves the origin, and everybody can use it. Prints what was measured.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { PATIENCE, result, variance, withStudio } from "./page.mjs";

const url = process.argv[2];
const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** What axe-core finds that is serious. */
async function findings(page) {
  // From outside: the page's own policy lets no other script in.
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
  return violations.filter(({ impact }) => impact === "serious" || impact === "critical").map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map(({ html }) => html.slice(0, 120)).join(" | ")}`);
}

const told = await withStudio(url, async (page) => {
  await page.waitForFunction(() => performance.getEntriesByName("first frame").length > 0, null, { timeout: PATIENCE });
  const { frames } = await result(page);
  assert.equal(frames, 121, "the sample walk is on the mannequin");
  const seconds = await page.evaluate(() => studio.state.seconds);
  await page.waitForFunction((before) => studio.state.seconds !== before, seconds);
  const spread = await variance(page);
  assert.ok(spread > 8, `the canvas is not blank: ${spread}`);
  const measured = await page.evaluate(() => {
    const { stats } = studio.viewer.stage;
    // With the document itself, and whatever the page begins with.
    const entries = [...performance.getEntriesByType("resource"), ...performance.getEntriesByType("navigation")];
    const sum = (of) => of.reduce((bytes, { encodedBodySize }) => bytes + encodedBodySize, 0);
    const bytes = sum(entries.filter(({ name }) => name.includes("/studio/")));
    const everything = sum(entries);
    return { first_frame_ms: performance.getEntriesByName("first frame")[0].startTime, change_ms: performance.getEntriesByName("change to result").map(({ duration }) => duration), calls: stats.calls, script_ms: stats.script / stats.frames, bytes, everything };
  });
  assert.ok(measured.bytes <= 350 * 1024, `${measured.bytes} bytes of the page`);
  // With the figures, what moves them and what was measured.
  assert.ok(measured.everything <= 800 * 1024, `${measured.everything} bytes until the sample moves`);
  assert.ok(measured.calls <= 60, `${measured.calls} draw calls`);
  for (const tab of ["report", "mapping", "pose", "ops", "edits"]) {
    await page.click(`#tab-${tab}`);
    assert.deepEqual(await findings(page), [], `${tab} can be used by everybody`);
  }
  for (const other of ["batch", "drawing"]) {
    await page.click(`#show-${other}`);
    await page.waitForSelector(`#${other} button`);
    assert.deepEqual(await findings(page), [], `${other} can be used by everybody`);
  }
  await page.click("#sample-drawing");
  await page.waitForSelector(".drawing-work:not([hidden])");
  await page.evaluate(() => document.querySelectorAll(".drawing-side details").forEach((details) => { details.open = true; }));
  assert.deepEqual(await findings(page), [], "drawings can be used by everybody");
  await page.click("#show-drawing");
  await page.click("#show-download");
  await page.waitForSelector("#save-config");
  assert.deepEqual(await findings(page), [], "what can be taken away can be used by everybody");
  await page.keyboard.press("Escape");
  await page.click("#show-help");
  assert.deepEqual(await findings(page), [], "the list of keys can be used by everybody");
  return measured;
});
await withStudio(url, async (page) => {
  await result(page);
  assert.deepEqual(await findings(page), [], "as well in the dark");
}, { colorScheme: "dark" });
console.log(JSON.stringify(told));

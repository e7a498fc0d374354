// node drawings.mjs URL FOLDER: the sample drawing is corrected by mouse and by keys, and taken away; FOLDER gets the files, and
// `child.png` there is a picture in which a figure is looked for.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { drop, withStudio } from "./page.mjs";

const [url, folder] = process.argv.slice(2);

/** Does something to the drawing, and waits for the moving picture that comes of it. */
async function moved(page, change) {
  const before = await page.evaluate(() => document.getElementById("moving")?.src ?? "");
  await change();
  await page.waitForFunction((old) => {
    const { src, hidden } = document.getElementById("moving") ?? { src: "", hidden: true };
    return !hidden && src !== old && !document.querySelector(".drawing-work").classList.contains("is-busy");
  }, before);
  // It is a picture, and it is drawn.
  await page.waitForFunction(() => document.getElementById("moving").naturalWidth > 0);
}

/** Reads something of what the page knows of the drawing. */
const drawn = (page, read) => page.evaluate(`import("/studio/drawing/live.js").then(({ drawn }) => (${read}))`);

/** Where a place of the drawing is on the page. */
const place = (page, at) => page.evaluate(async ([x, y]) => {
  const canvas = document.getElementById("drawn");
  const { drawn: { drawing } } = await import("/studio/drawing/live.js");
  const rect = canvas.getBoundingClientRect();
  const scale = Math.min((rect.width - 28) / drawing.width, (rect.height - 28) / drawing.height);
  return { x: rect.left + rect.width / 2 + (x - drawing.width / 2) * scale, y: rect.top + rect.height / 2 + (y - drawing.height / 2) * scale };
}, at);

async function drag(page, from, to) {
  const [begin, end] = [await place(page, from), await place(page, to)];
  await page.mouse.move(begin.x, begin.y);
  await page.mouse.down();
  for (let step = 1; step <= 5; step += 1) await page.mouse.move(begin.x + ((end.x - begin.x) * step) / 5, begin.y + ((end.y - begin.y) * step) / 5);
  await page.mouse.up();
}

const jointOf = (page, name) => drawn(page, `drawn.drawing.joints.find(({ name }) => name === "${name}").loc`);
const pixels = (page) => drawn(page, "drawn.drawing.mask.filter((value) => value === 255).length");

/** Makes a sample an asset. */
async function sample(name) {
  return (await (await fetch(`${url}/studio/sample/${name}`, { method: "POST" })).json()).id;
}

// A small picture of few frames is made soon, however busy the machine is.
const small = { edit: { fps: 6 }, view: { size: [160, 160] } };
const path = `/studio/?source=${await sample("walk.glb")}&target=${await sample("drawing.zip")}&config=${encodeURIComponent(JSON.stringify(small))}`;

await withStudio(url, async (page) => {
  await moved(page, () => page.waitForSelector(".drawing-work:not([hidden])"));
  assert.equal(await page.textContent(".drawing-result .badge"), "pass", "it has a verdict");
  // A joint by the mouse.
  const before = await jointOf(page, "left_hand");
  await moved(page, () => drag(page, before, [before[0] - 14, before[1] - 8]));
  const after = await jointOf(page, "left_hand");
  assert.ok(Math.abs(after[0] - before[0] + 14) <= 2 && Math.abs(after[1] - before[1] + 8) <= 2, `dragged: ${before} to ${after}`);
  // And back by a key, which is meant for the drawing and not for the figures.
  await moved(page, () => page.keyboard.press("Control+z"));
  assert.deepEqual(await jointOf(page, "left_hand"), before, "undone");
  await page.focus("#drawn");
  while (!(await page.evaluate(() => document.querySelector(".joints .selected")?.textContent.includes("right hand")))) await page.keyboard.press("n");
  const hand = await jointOf(page, "right_hand");
  await moved(page, async () => {
    await page.keyboard.press("ArrowUp");
    await page.keyboard.press("Shift+ArrowRight");
  });
  assert.deepEqual(await jointOf(page, "right_hand"), [hand[0] + 10, hand[1] - 1], "moved by keys");

  // The mask, painted by the mouse and erased by keys.
  const whole = await pixels(page);
  await page.click("text=Paint the mask");
  await moved(page, () => drag(page, [250, 120], [240, 160]));
  const painted = await pixels(page);
  assert.ok(painted > whole + 300, `more belongs to the figure: ${whole} to ${painted}`);
  await page.click("text=Erase");
  await page.focus("#drawn");
  await moved(page, async () => {
    for (let step = 0; step < 3; step += 1) await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("Space");
  });
  assert.ok(await pixels(page) < painted, "less of it");
  assert.equal(await page.evaluate(() => studio.player.isPlaying), false, "Space was for the brush");

  // A plane, and how it moves.
  await moved(page, () => page.selectOption('[aria-label="Plane of legs"]', "frontal"));
  assert.equal(await drawn(page, 'drawn.config.retarget.bvh_projection_bodypart_groups.find(({ name }) => name === "legs").method'), "frontal");
  await page.click(".drawing-side summary >> text=The clip");
  await page.click(".drawing-side summary >> text=The picture");
  await moved(page, () => page.locator(".drawing-side .field", { hasText: /^mirror/ }).locator("input").last().check());
  await moved(page, () => page.getByRole("button", { name: "rig", exact: true }).click());

  for (const [selector, name] of [["#save-drawing", "drawing.zip"], ["#save-draw-config", "config.json"], ['[data-drawn="gif"]', "page.gif"], ['[data-drawn="poses2d_json"]', "page.json"]]) {
    const [download] = await Promise.all([page.waitForEvent("download"), page.click(selector)]);
    await download.saveAs(join(folder, name));
  }
  assert.match(await readFile(join(folder, "config.json"), "utf8"), /"retarget"/);
  await page.click("text=Copy command line");
  assert.match(await page.textContent(".drawing-side pre"), /retargetd draw --drawing 'drawing\.zip' --source 'walk\.glb'/);

  // A picture alone, dropped: its joints are found.
  await moved(page, () => drop(page, "target", [join(folder, "child.png")]));
  assert.ok(await drawn(page, "drawn.drawing.joints.length") >= 16, "joints were found");
  await moved(page, () => page.click("text=Find joints anew"));
  assert.equal(await page.textContent("#open-target"), "child.png");
  await page.click("#show-drawing");
  assert.equal(await page.isVisible("#canvas"), true, "back to the figures");
}, { path });
console.log("{}");

// node journeys.mjs URL FOLDER: what people do with the page, by clicks and keys. FOLDER gets what they download.

import assert from "node:assert/strict";
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { changed, drop, result, withStudio } from "./page.mjs";

const [url, folder] = process.argv.slice(2);

const JOURNEYS = {
  async "an op off and on"(page) {
    await page.click("#tab-ops");
    const before = await result(page);
    const off = await changed(page, () => page.uncheck('[aria-label="plant runs"]'));
    assert.ok(off.score > before.score, `feet slide without it: ${before.score} to ${off.score}`);
    const on = await changed(page, () => page.check('[aria-label="plant runs"]'));
    assert.equal(on.score, before.score, "and do not with it");
    await page.click("#canvas", { position: { x: 60, y: 420 } });
    await page.keyboard.press("Control+z");
    const undone = await page.evaluate(() => studio.state.config.ops.find(({ op }) => op === "plant").enabled);
    assert.equal(undone, false, "undone by key");
    await page.keyboard.press("Control+z");
    assert.deepEqual(await page.evaluate(() => studio.state.config), {}, "nothing is left of it");
    await result(page);
  },

  async "a wrong role corrected"(page) {
    await page.click("#tab-mapping");
    const box = page.locator('[data-focus="source left_shin"]');
    const wrong = await changed(page, async () => {
      await box.fill("mixamorig:RightUpLeg");
      await box.press("Enter");
    });
    const right = await changed(page, async () => {
      await page.locator('[data-focus="source left_shin"]').fill("mixamorig:LeftLeg");
      await page.locator('[data-focus="source left_shin"]').press("Enter");
    });
    assert.ok(right.score < wrong.score, `the verdict improves: ${wrong.score} to ${right.score}`);
    const order = ["pass", "warn", "fail"];
    assert.ok(order.indexOf(right.verdict) < order.indexOf(wrong.verdict), `${wrong.verdict} to ${right.verdict}`);
    // A click on a row tells why, and what else it could be.
    await page.click('[data-role="left_hand"] .name');
    await page.waitForSelector('[data-role="left_hand"].selected .details');
    assert.equal(await page.locator(".details").count(), 1, "the row that was open is closed");
    await page.click("text=Why is it turned so?");
    await page.waitForSelector(".why ol li");
    await page.click("text=Take changes back");
    await page.waitForFunction(() => Object.keys(studio.state.config).length === 0);
    await result(page);
  },

  async "trim and loop"(page) {
    await page.click("#tab-edits");
    const start = page.locator('[aria-label="The clip begins here"]');
    const trimmed = await changed(page, async () => {
      await start.focus();
      for (let press = 1; press <= 3; press += 1) {
        await page.keyboard.press("PageUp");
        // A busy browser handles a key some time after it was pressed.
        await page.waitForFunction((press) => studio.state.config.edit?.range[0] > press * 0.35, press);
      }
    });
    assert.ok(trimmed.frames < 121, `shorter: ${JSON.stringify(trimmed)}`);
    // Once more, after the result is there: a handle that is moved again is moved from where it is.
    const shorter = await changed(page, () => start.press("PageUp"));
    assert.ok(shorter.frames < trimmed.frames, `shorter again: ${trimmed.frames} to ${shorter.frames}`);
    await changed(page, () => start.press("PageDown"));
    const looped = await changed(page, () => page.locator(".field", { hasText: /^loop/ }).locator("input").check());
    assert.ok(looped.frames > trimmed.frames * 1.8, `twice: ${trimmed.frames} to ${looped.frames}`);
    await changed(page, () => page.click("text=Take all edits back"));
  },

  async "T onto A with a hand turned by the gizmo"(page) {
    await page.click("#tab-pose");
    await page.click("text=Show and turn the rest pose");
    await page.waitForFunction(() => studio.state.posing);
    await page.evaluate(() => { studio.viewer.stage.fit("front"); });
    // A rest pose has one frame.
    await page.waitForFunction(() => ["source", "target"].every((side) => studio.viewer.stage[side].figure.duration < 0.1));
    await drawn(page);
    const hand = await place(page, "hand_l");
    await page.mouse.click(hand.x, hand.y);
    await page.waitForFunction(() => studio.state.joint === "hand_l");
    await drawn(page);
    const joint = "hand_l";
    // The ring of the gizmo is about the joint; a way across it grabs one of its axes.
    const turned = await changed(page, async () => {
      const ring = await handle(page);
      await page.mouse.move(ring.x, ring.y);
      await drawn(page);
      await page.mouse.down();
      for (let step = 1; step <= 6; step += 1) await page.mouse.move(ring.x + 4 * step, ring.y + 9 * step);
      await page.mouse.up();
    });
    const [edit] = turned.config.target.pose;
    assert.equal(edit.joint, joint, "the joint that was grabbed");
    assert.ok(edit.degrees.some((part) => Math.abs(part) > 2), `turned: ${edit.degrees}`);
    await page.click("text=Mirror left to right");
    await page.waitForFunction(() => studio.state.config.target?.pose?.length === 2);
    await page.click("text=Reset all");
    await page.click("#canvas", { position: { x: 60, y: 420 } });
    await page.keyboard.press("Escape");
    await page.waitForFunction(() => !studio.state.posing && Object.keys(studio.state.config).length === 0);
    await page.waitForTimeout(400);
    await result(page);
  },

  async "A against B"(page) {
    await page.click("#tab-report");
    await page.click("text=Pin as A");
    await changed(page, async () => {
      await page.click("#tab-ops");
      await page.uncheck('[aria-label="plant runs"]');
    });
    await page.click("#tab-report");
    await page.waitForSelector("text=A is better.");
    assert.ok(await page.locator("td.worse").count() > 0, "what is worse is said");
    await page.focus("#canvas");
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => studio.state.showsPinned), true, "Tab shows A");
    await page.keyboard.press("Tab");
    await page.click("text=Unpin");
    await page.locator(".metrics button").first().click();
    assert.equal(await page.evaluate(() => studio.player.isPlaying), false, "a click on a measure goes to its place");
    assert.notEqual(await page.evaluate(() => studio.state.joint), "", "and joint");
  },

  async "everything by keyboard"(page) {
    await page.focus("#canvas");
    await page.keyboard.press("Home");
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("Shift+ArrowRight");
    assert.equal(await page.evaluate(() => studio.state.frame), 11, "frames by arrows");
    await page.keyboard.press("End");
    assert.equal(await page.evaluate(() => studio.state.frame), 120, "the last one");
    for (const [key, read] of [["g", "studio.viewer.stage.mode"], ["w", "studio.viewer.stage.mode"], ["b", "studio.viewer.marks.bones"], ["m", "studio.viewer.hasMesh"], ["t", "studio.viewer.marks.trails"], ["v", "studio.viewer.stage.isFollowed"]]) {
      const before = await page.evaluate(read);
      await page.keyboard.press(key);
      assert.notEqual(await page.evaluate(read), before, `${key} does something`);
      if (key === "w") await page.keyboard.press("w");
      else await page.keyboard.press(key);
    }
    await page.keyboard.press("Space");
    assert.equal(await page.evaluate(() => studio.player.isPlaying), true, "plays");
    await page.keyboard.press("k");
    await page.keyboard.press("?");
    await page.waitForSelector("dialog[open] kbd");
    await page.keyboard.press("Escape");
  },

  async "a refused file is told in words"(page) {
    const file = join(folder, "notes.bvh");
    await writeFile(file, "this is no motion");
    await drop(page, "source", [file]);
    await page.waitForSelector("#problem:not([hidden])");
    const text = await page.textContent("#problem");
    assert.ok(text.length > 40 && /unsupported_format|asset_malformed|unknown_format/.test(text), text);
    await page.click("#problem .icon");
    assert.equal(await page.evaluate(() => studio.state.source.file_name), "walk.glb", "what was there stays");
  },

  async "what is taken away is what the command line makes"(page) {
    await page.click("#tab-edits");
    await changed(page, () => page.locator(".field", { hasText: /^mirror/ }).locator("input").check());
    await page.click("#show-download");
    for (const [selector, name] of [["#save-config", "config.json"], ['[data-format="glb"]', "page.glb"], ['[data-format="bvh"]', "page.bvh"]]) {
      const [download] = await Promise.all([page.waitForEvent("download"), page.click(selector)]);
      await download.saveAs(join(folder, name));
    }
    assert.ok(Object.keys(JSON.parse(await readFile(join(folder, "config.json"), "utf8"))).length > 0, "what was changed");
    await page.click("text=Copy command line");
    assert.match(await page.textContent("#recipe"), /retargetd retarget --source 'walk\.glb'/);
    await page.keyboard.press("Escape");
  },
};

/** Where a joint of the character is on the page. */
function place(page, label) {
  return page.evaluate((label) => {
    const { stage } = studio.viewer;
    const node = stage.target.figure.byLabel.get(label);
    const port = stage.ports().find(({ name }) => name === "target");
    const at = stage.project(node.getWorldPosition(stage.camera.position.clone()), port);
    const rect = stage.canvas.getBoundingClientRect();
    return { x: rect.left + at[0], y: rect.top + at[1] };
  }, label);
}

/** Waits until what is there has been drawn, and the mouse has been seen where it is. */
function drawn(page) {
  return page.evaluate(() => new Promise((resolve) => {
    studio.viewer.touch();
    requestAnimationFrame(() => requestAnimationFrame(resolve));
  }));
}

/** A place where the gizmo can be grabbed, found by moving the mouse over it. */
async function handle(page) {
  const center = await place(page, await page.evaluate(() => studio.state.joint));
  for (let radius = 30; radius < 120; radius += 6) {
    for (const angle of [0.3, 1.2, 2.4, 3.7, 5.1]) {
      const at = { x: center.x + radius * Math.cos(angle), y: center.y + radius * Math.sin(angle) };
      await page.mouse.move(at.x, at.y);
      await drawn(page);
      if (await page.evaluate(() => ["X", "Y", "Z", "E"].includes(studio.viewer.gizmo.controls.axis))) return at;
    }
  }
  throw new Error("the gizmo cannot be grabbed");
}

const only = process.argv[4];
await withStudio(url, async (page) => {
  await result(page);
  for (const [name, journey] of Object.entries(JOURNEYS)) {
    if (only && !name.includes(only)) continue;
    const begun = performance.now();
    try {
      await journey(page);
    } catch (error) {
      await page.screenshot({ path: join(folder, "failed.png") }).catch(() => {});
      throw new Error(`${name}: ${error.stack}`);
    }
    console.log(JSON.stringify({ journey: name, seconds: (performance.now() - begun) / 1000 }));
  }
}, { allowed: ["status of 4"] });

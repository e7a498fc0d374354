// node hands_free.mjs URL FOLDER FILE...: every journey by a person who has no mouse. Nothing here but the keyboard touches the page;
// FILE is a clip and a character to open, and one that is refused.

import assert from "node:assert/strict";
import { join } from "node:path";
import { changed, result, withStudio } from "./page.mjs";

const [url, folder, clip, character, refused] = process.argv.slice(2);
const MOST_STEPS = 160;

/** Goes by Tab to what `selector` names. */
async function reach(page, selector) {
  const isThere = () => page.evaluate((wanted) => document.activeElement?.matches(wanted) ?? false, selector);
  for (let step = 0; step < MOST_STEPS; step += 1) {
    if (await isThere()) return;
    // The picture is left by it as everything else: nothing is pinned.
    await page.keyboard.press("Tab");
  }
  throw new Error(`${selector} cannot be reached by Tab`);
}

/** Reaches a button and presses it. */
async function press(page, selector, key = "Enter") {
  await reach(page, selector);
  await page.keyboard.press(key);
}

/** Chooses files in the window that a key opens. */
async function choose(page, open, files) {
  const [chooser] = await Promise.all([page.waitForEvent("filechooser"), open()]);
  await chooser.setFiles(files);
}

/** Shows a panel: tabs are one stop, and arrows go from one to the next. */
async function tab(page, name) {
  await reach(page, "#tabs button[tabindex='0'], #tabs button[aria-selected='true']");
  for (let step = 0; step < 6; step += 1) {
    if (await page.evaluate((wanted) => document.activeElement?.id === wanted, `tab-${name}`)) return;
    await page.keyboard.press("ArrowRight");
  }
  throw new Error(`no tab ${name}`);
}

const state = (page, read) => page.evaluate(`(({ state }) => ${read})(studio)`);

const JOURNEYS = {
  async "an op off and on"(page) {
    await tab(page, "ops");
    const before = await result(page);
    const off = await changed(page, () => press(page, '[aria-label="plant runs"]', "Space"));
    assert.ok(off.score > before.score, `${before.score} to ${off.score}`);
    const on = await changed(page, () => page.keyboard.press("Space"));
    assert.equal(on.score, before.score);
  },

  async "a wrong role corrected"(page) {
    await tab(page, "mapping");
    const write = async (name) => {
      await reach(page, '[data-focus="source left_shin"]');
      await page.keyboard.press("Control+a");
      await page.keyboard.type(name);
      await page.keyboard.press("Enter");
    };
    const wrong = await changed(page, () => write("RightUpLeg"));
    const right = await changed(page, () => write("LeftLeg"));
    assert.ok(right.score < wrong.score, `${wrong.score} to ${right.score}`);
    await press(page, ".why button");
    await page.waitForSelector(".why ol li");
  },

  async "a hand of the rest pose turned"(page) {
    await tab(page, "pose");
    await page.keyboard.press("p");
    await page.waitForFunction(() => studio.state.posing);
    await reach(page, "#pose-joint");
    // The list begins anew with each letter that comes a second after the one before, as letters do on a machine that is busy: then the name is typed again.
    for (let tries = 0; tries < 3 && (await state(page, "state.joint")) !== "hand_l"; tries += 1) {
      if (tries > 0) await page.waitForTimeout(1500);
      await page.keyboard.type("hand_l");
    }
    assert.equal(await state(page, "state.joint"), "hand_l", "chosen by its name");
    await reach(page, '[aria-label="Degrees about Y"]');
    const turned = await changed(page, async () => {
      await page.keyboard.press("Control+a");
      await page.keyboard.type("20");
      await page.keyboard.press("Enter");
    });
    assert.deepEqual(turned.config.target.pose, [{ edit: "rotate", joint: "hand_l", degrees: [0, 20, 0] }]);
    await reach(page, "#canvas");
    await page.keyboard.press("Escape");
    await page.waitForFunction(() => !studio.state.posing);
  },

  async "trim and loop"(page) {
    await reach(page, "#canvas");
    await page.keyboard.press("Home");
    for (let step = 0; step < 3; step += 1) await page.keyboard.press("Shift+ArrowRight");
    const trimmed = await changed(page, () => page.keyboard.press("["));
    assert.ok(trimmed.frames < 121 && trimmed.config.edit.range[0] > 0.5, JSON.stringify(trimmed));
    await tab(page, "edits");
    const box = await page.evaluate(() => [...document.querySelectorAll("#panel-edits .field")].find((of) => of.textContent.startsWith("loop"))?.querySelector("input").id);
    const looped = await changed(page, () => press(page, `#${box}`, "Space"));
    assert.ok(looped.frames > trimmed.frames * 1.8, `${trimmed.frames} to ${looped.frames}`);
  },

  async "A against B"(page) {
    await reach(page, "#canvas");
    await page.keyboard.press("a");
    await changed(page, () => page.keyboard.press("Control+z"));
    await page.keyboard.press("Escape");
    await tab(page, "report");
    await page.waitForSelector(".outcome");
    await reach(page, "#canvas");
    await page.keyboard.press("Tab");
    assert.equal(await state(page, "state.showsPinned"), true, "Tab shows A");
    await page.keyboard.press("Escape");
    await page.keyboard.press("Tab");
    assert.notEqual(await page.evaluate(() => document.activeElement?.id), "canvas", "who does not see the picture is not caught in it");
    await reach(page, "#panel-report .versus button:last-of-type");
    await page.keyboard.press("Enter");
    assert.equal(await state(page, "state.pinned"), null, "unpinned");
    await press(page, ".metrics button");
    assert.notEqual(await state(page, "state.joint"), "", "a measure leads to its joint");
  },

  async "a download"(page) {
    await press(page, "#show-download");
    await page.waitForSelector("#save-config");
    await reach(page, "#save-config");
    const [download] = await Promise.all([page.waitForEvent("download"), page.keyboard.press("Enter")]);
    await download.saveAs(join(folder, "by_keys.json"));
    await page.keyboard.press("Escape");
  },

  async "a refused file is told in words"(page) {
    await choose(page, () => press(page, "#open-source"), [refused]);
    await page.waitForSelector("#problem:not([hidden])");
    await press(page, "#problem button");
    assert.equal(await page.isHidden("#problem"), true);
  },

  async "files of one's own"(page) {
    const { job } = await result(page);
    await choose(page, () => press(page, "#open-source"), [clip]);
    await page.waitForFunction((name) => studio.state.source?.file_name === name, clip.split("/").pop());
    await choose(page, () => press(page, "#open-target"), [character]);
    await page.waitForFunction((name) => studio.state.target?.file_name === name, character.split("/").pop());
    const of = await result(page, job);
    assert.ok(of.verdict, "retargeted");
  },

  async "a batch"(page) {
    await press(page, "#show-batch");
    await press(page, "#batch-run");
    await page.waitForSelector("#batch .cell img");
    await press(page, "#batch .cell");
    await page.waitForFunction(() => document.getElementById("batch").hidden);
    await result(page);
  },

  async "a drawing"(page) {
    await press(page, "#show-drawing");
    await page.waitForSelector("#sample-drawing");
    await press(page, "#sample-drawing");
    await page.waitForSelector(".drawing-work:not([hidden])");
    await reach(page, "#drawn");
    await page.keyboard.press("n");
    await page.keyboard.press("ArrowUp");
    const loc = await page.evaluate('import("/studio/drawing/live.js").then(({ drawn }) => drawn.drawing.joints[0].loc)');
    assert.deepEqual(loc, [180, 287], "a joint moved");
    await reach(page, "#save-drawing");
  },
};

const only = process.argv[7];
await withStudio(url, async (page) => {
  await result(page);
  for (const [name, journey] of Object.entries(JOURNEYS)) {
    if (only && !name.includes(only)) continue;
    try {
      await journey(page);
    } catch (error) {
      await page.screenshot({ path: join(folder, "failed.png") }).catch(() => {});
      throw new Error(`${name}: ${error.stack}`);
    }
    console.log(JSON.stringify({ journey: name }));
  }
}, { allowed: ["status of 4"] });

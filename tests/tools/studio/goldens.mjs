// node goldens.mjs URL FOLDER [keep]: eight states of the page against the pictures of tests/tools/studio/goldens. FOLDER gets what differs;
// with `keep` the pictures there are made anew. Prints how many pixels of each differ.
//
// Pictures are half as large as the page, so that how glyphs are smoothed does not count. Where the page has other fonts than those that
// the pictures were made with, panels are left out and the picture alone is compared; that is said aloud.

import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { changed, drop, result, withStudio } from "./page.mjs";

const [url, folder, keep] = process.argv.slice(2);
const GOLDENS = join(dirname(fileURLToPath(import.meta.url)), "goldens");
/** Of all pixels. */
const MOST_DIFFERENT = 0.01;
/** Of 255, in any of red, green and blue. */
const SEEN = 24;

/** Stops at a frame, and takes away what is there for a moment only. */
async function still(page, frame = 23) {
  await page.focus("#canvas");
  await page.keyboard.press("k");
  // How much room there was when the figures came depends on what came first.
  await page.keyboard.press("f");
  await page.keyboard.press("Home");
  for (let ten = 0; ten < Math.floor(frame / 10); ten += 1) await page.keyboard.press("Shift+ArrowRight");
  for (let one = 0; one < frame % 10; one += 1) await page.keyboard.press("ArrowRight");
  await page.mouse.move(640, 5);
}

async function sample(name) {
  return (await (await fetch(`${url}/studio/sample/${name}`, { method: "POST" })).json()).id;
}

/** What is done to get there; the page begins with the sample each time. */
const STATES = {
  start: { do: (page) => still(page) },
  mapping: {
    async do(page) {
      await page.click("#tab-mapping");
      await page.click('[data-role="left_forearm"]');
      await still(page);
    },
  },
  rest_pose: {
    async do(page) {
      await page.click("#tab-pose");
      await page.keyboard.press("p");
      await page.waitForFunction(() => studio.state.posing && ["source", "target"].every((side) => studio.viewer.stage[side].figure.duration < 0.1));
      await page.selectOption("#pose-joint", "hand_l");
      await page.evaluate(() => studio.viewer.stage.fit("front"));
      await page.mouse.move(640, 5);
    },
  },
  ops: {
    async do(page) {
      await page.click("#tab-ops");
      await page.click('[data-focus$="plant name"]');
      await still(page);
    },
  },
  failing: {
    async do(page) {
      await page.click("#tab-mapping");
      const box = page.locator('[data-focus="source left_shin"]');
      await changed(page, async () => {
        await box.fill("mixamorig:RightUpLeg");
        await box.press("Enter");
      });
      await page.click("#tab-report");
      assert.equal(await page.textContent("#verdict"), "fail");
      await still(page);
    },
  },
  comparison: {
    async do(page) {
      await page.click("text=Pin as A");
      await changed(page, async () => {
        await page.click("#tab-ops");
        await page.uncheck('[aria-label="plant runs"]');
      });
      await page.click("#tab-report");
      await page.waitForSelector("text=A is better.");
      await page.keyboard.press("g");
      await still(page);
    },
  },
  refused_in_the_dark: {
    colorScheme: "dark",
    async do(page) {
      const file = join(folder, "notes.bvh");
      await writeFile(file, "this is no motion");
      await drop(page, "source", [file]);
      await page.waitForSelector("#problem:not([hidden])");
      await still(page);
    },
  },
  drawing: {
    // One frame, so that the picture does not move while it is looked at.
    config: { edit: { range: [0.8, 0.9], fps: 5 }, view: { size: [300, 300] } },
    async do(page) {
      await page.waitForFunction(() => document.getElementById("moving")?.naturalWidth > 0 && !document.querySelector(".is-busy"));
      await page.focus("#drawn");
      for (let joint = 0; joint < 7; joint += 1) await page.keyboard.press("n");
      await page.mouse.move(640, 5);
    },
  },
};

/** The page in half its size, as bytes of red, green, blue and opacity; and how wide a text is, which tells fonts apart. */
async function seen(page) {
  await page.evaluate(() => new Promise((done) => {
    studio.viewer.touch();
    requestAnimationFrame(() => requestAnimationFrame(done));
  }));
  const shot = (await page.screenshot()).toString("base64");
  return page.evaluate(async (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const whole = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = Object.assign(document.createElement("canvas"), { width: whole.width / 2, height: whole.height / 2 });
    const context = canvas.getContext("2d");
    context.imageSmoothingQuality = "high";
    context.drawImage(whole, 0, 0, canvas.width, canvas.height);
    // Fewer shades, and the files are half as large.
    const image = context.getImageData(0, 0, canvas.width, canvas.height);
    image.data.forEach((value, at) => { image.data[at] = at % 4 === 3 ? 255 : value & 0xf8; });
    context.putImageData(image, 0, 0);
    const ruler = document.createElement("canvas").getContext("2d");
    ruler.font = getComputedStyle(document.body).font;
    const fonts = ruler.measureText("Hamburgefonstiv 0123456789 retargetd").width;
    return { png: canvas.toDataURL("image/png").split(",")[1], fonts };
  }, shot);
}

/** Which share of two pictures differs, within a box of both, and a picture of where. */
async function compared(page, one, other, box) {
  return page.evaluate(async ({ one, other, box, SEEN }) => {
    const read = async (text) => {
      const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], { type: "image/png" }));
      const context = Object.assign(document.createElement("canvas"), { width: bitmap.width, height: bitmap.height }).getContext("2d");
      context.drawImage(bitmap, 0, 0);
      return context;
    };
    const [first, second] = [await read(one), await read(other)];
    const [left, top, width, height] = box ?? [0, 0, first.canvas.width, first.canvas.height];
    const [a, b] = [first, second].map((of) => of.getImageData(left, top, width, height));
    let count = 0;
    for (let at = 0; at < a.data.length; at += 4) {
      const isSeen = [0, 1, 2].some((part) => Math.abs(a.data[at + part] - b.data[at + part]) > SEEN);
      if (isSeen) count += 1;
      a.data.set(isSeen ? [255, 0, 0, 255] : [0, 1, 2].map((part) => 160 + a.data[at + part] * 0.35), at);
    }
    second.putImageData(a, left, top);
    return { share: count / (width * height), where: second.canvas.toDataURL("image/png").split(",")[1] };
  }, { one, other, box, SEEN });
}

await mkdir(GOLDENS, { recursive: true });
const known = keep ? {} : JSON.parse(await readFile(join(GOLDENS, "fonts.json"), "utf8"));
const failures = [];
for (const [name, { colorScheme = "light", config, do: work }] of Object.entries(STATES)) {
  const path = config ? `/studio/?source=${await sample("walk.glb")}&target=${await sample("drawing.zip")}&config=${encodeURIComponent(JSON.stringify(config))}` : "/studio/";
  await withStudio(url, async (page) => {
    if (!config) await result(page);
    await work(page);
    const { png, fonts } = await seen(page);
    if (keep) {
      known.width ??= fonts;
      return writeFile(join(GOLDENS, `${name}.png`), Buffer.from(png, "base64"));
    }
    const hasFonts = Math.abs(known.width - fonts) < 0.5;
    if (!hasFonts) console.error(`goldens.mjs: other fonts here (${fonts} pixels for what took ${known.width}): of '${name}' the picture alone is compared`);
    const box = hasFonts ? undefined : await page.evaluate(() => {
      const of = [...document.querySelectorAll("#canvas, #drawn")].find(({ clientWidth }) => clientWidth)?.getBoundingClientRect();
      // Without the buttons and captions above it.
      return [of.left / 2, of.top / 2 + 40, of.width / 2, of.height / 2 - 40].map(Math.round);
    });
    const golden = (await readFile(join(GOLDENS, `${name}.png`))).toString("base64");
    const { share, where } = await compared(page, golden, png, box);
    console.log(JSON.stringify({ state: name, differs_percent: Number((share * 100).toFixed(3)) }));
    if (share > MOST_DIFFERENT) {
      failures.push(`${name}: ${(share * 100).toFixed(2)} % differ`);
      await writeFile(join(folder, `${name}.png`), Buffer.from(png, "base64"));
      await writeFile(join(folder, `${name}_where.png`), Buffer.from(where, "base64"));
    }
  }, { path, colorScheme, allowed: ["status of 4"] });
}
if (keep) await writeFile(join(GOLDENS, "fonts.json"), `${JSON.stringify(known)}\n`);
assert.deepEqual(failures, [], `pictures of what is seen, and where it differs, are in ${folder}; 'node goldens.mjs URL FOLDER keep' takes them over`);

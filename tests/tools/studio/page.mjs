// The studio in headless Chromium: what the journeys beside this file share. Whatever leaves the origin, is said to be an error, or breaks
// the page's own security policy ends a journey.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { chromium } from "playwright-core";

/** How long anything may take on a busy machine. */
export const PATIENCE = 60_000;

// Opens the studio of the service at `url`, has `work(page)` done, and closes it.
export async function withStudio(url, work, { path = "/studio/", colorScheme = "light", allowed = [], pages = {} } = {}) {
  const browser = await chromium.launch({
    executablePath: process.env.RETARGETD_CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
  const problems = [];
  try {
    const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, colorScheme, acceptDownloads: true });
    const page = await context.newPage();
    page.setDefaultTimeout(PATIENCE);
    page.on("pageerror", (error) => problems.push(`error: ${error.stack ?? error}`));
    page.on("console", (message) => { if (message.type() === "error") problems.push(`console: ${message.text()}`); });
    await page.addInitScript(() => {
      globalThis.violations = [];
      document.addEventListener("securitypolicyviolation", (event) => violations.push(`${event.violatedDirective}: ${event.blockedURI}`));
    });
    await page.route("**/*", (route) => {
      const at = new URL(route.request().url());
      if (pages[at.pathname]) return route.fulfill({ body: pages[at.pathname], contentType: "text/html" });
      if (at.origin === new URL(url).origin || at.protocol === "blob:" || at.protocol === "data:") return route.continue();
      problems.push(`a request left the origin: ${at}`);
      return route.abort();
    });
    await page.goto(`${url}${path}`);
    const told = await work(page, problems);
    problems.push(...(await page.evaluate(() => globalThis.violations)));
    const unexpected = problems.filter((problem) => !allowed.some((of) => problem.includes(of)));
    assert.deepEqual(unexpected, [], "nothing went wrong on the page");
    return told;
  } finally {
    await browser.close();
  }
}

/** Waits for a result that is newer than the one of that job, and of the config as it is: no change waits for its own. */
export async function result(page, before = "") {
  const isThere = (job) => {
    const { state } = globalThis.studio;
    return state.report !== null && state.result !== "" && state.job !== job && state.resultConfig === state.config && !state.busy;
  };
  await page.waitForFunction(isThere, before);
  return page.evaluate(() => ({ job: studio.state.job, verdict: studio.state.report.measures?.verdict, score: studio.state.report.measures?.score, frames: studio.state.report.counts.frames, config: studio.state.config }));
}

/** Does something that changes the config, and waits for what comes of it. */
export async function changed(page, change) {
  const before = await page.evaluate(() => studio.state.job);
  await change();
  return result(page, before);
}

/** Gives files to the page by dropping them on a zone, as a browser does. */
export async function drop(page, zone, files) {
  const list = await Promise.all(files.map(async (file) => ({ name: file.split("/").pop(), bytes: [...await readFile(file)] })));
  await page.evaluate(({ zone, list }) => {
    const transfer = new DataTransfer();
    for (const { name, bytes } of list) transfer.items.add(new File([new Uint8Array(bytes)], name));
    const fire = (kind, target) => target.dispatchEvent(new DragEvent(kind, { dataTransfer: transfer, bubbles: true, cancelable: true }));
    fire("dragenter", document.body);
    const place = document.querySelector(`[data-zone="${zone}"]`);
    if (document.getElementById("zones").hidden) throw new Error("the zones are not shown");
    fire("dragover", place);
    fire("drop", place);
  }, { zone, list });
}

/** How much the brightness of what is drawn varies, as a standard deviation of 0 to 255: a blank picture has none. */
export async function variance(page) {
  return page.evaluate(() => new Promise((resolve) => {
    const { stage } = globalThis.studio.viewer;
    stage.isDirty = true;
    requestAnimationFrame(() => {
      // In the same frame, so that what was drawn is still there.
      stage.render();
      const copy = document.createElement("canvas");
      [copy.width, copy.height] = [240, 150];
      const context = copy.getContext("2d");
      context.drawImage(stage.canvas, 0, 0, copy.width, copy.height);
      const { data } = context.getImageData(0, 0, copy.width, copy.height);
      const light = [];
      for (let index = 0; index < data.length; index += 4) light.push((data[index] + data[index + 1] + data[index + 2]) / 3);
      const mean = light.reduce((sum, value) => sum + value, 0) / light.length;
      resolve(Math.sqrt(light.reduce((sum, value) => sum + (value - mean) ** 2, 0) / light.length));
    });
  }));
}

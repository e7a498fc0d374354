// node moving.mjs FILE ...
//
// Prints one JSON line for each moving picture, as Chromium decodes it: {"file", "frames", "seconds", "loops": how often it is shown
// again, or null for ever}; of a film, which has no loops, {"file", "seconds", "size"}; or "error".

import { extname } from "node:path";

import { address, withPage } from "./browser.mjs";

const TYPES = { ".gif": "image/gif", ".webp": "image/webp", ".apng": "image/png", ".mp4": "video/mp4" };

await withPage("moving.html", async (page) => {
  for (const file of process.argv.slice(2)) {
    let answer;
    try {
      const task = { file: address(file), type: TYPES[extname(file)] };
      answer = { file, ...(await page.evaluate((task) => globalThis.watched(task), task)) };
    } catch (error) {
      answer = { file, error: String(error) };
    }
    process.stdout.write(`${JSON.stringify(answer)}\n`);
  }
});

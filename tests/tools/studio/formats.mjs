// node formats.mjs URL FILE...: every file is shown on both sides.

import assert from "node:assert/strict";
import { basename } from "node:path";
import { drop, withStudio } from "./page.mjs";

const [url, ...files] = process.argv.slice(2);

// None that is read is left out. GLB and glTF text differ; a drawing has a page of its own.
const { formats } = await (await fetch(`${url}/v1/formats`)).json();
const read = formats.filter(({ name, reads }) => reads && name !== "drawing").map(({ name }) => name);
const seen = new Set();

await withStudio(url, async (page) => {
  for (const file of files) {
    for (const side of ["source", "target"]) {
      await page.evaluate(() => { document.getElementById("problem").hidden = true; });
      await drop(page, side, [file]);
      const name = basename(file);
      // A problem may still be that of the file before.
      const isShown = ({ side, name }) => studio.state[side]?.file_name === name;
      await page.waitForFunction(isShown, { side, name });
      const shown = await page.evaluate((side) => {
        const { figure } = studio.viewer.stage[side];
        const triangles = figure.meshes.reduce((sum, { geometry }) => sum + (geometry.index?.count ?? 0) / 3, 0);
        return { name: studio.state[side]?.file_name, format: studio.state[side]?.format, triangles, problem: document.getElementById("problem").hidden ? "" : document.getElementById("problem").textContent };
      }, side);
      assert.equal(shown.name, name, `${name} as ${side}: ${shown.problem}`);
      assert.ok(shown.triangles > 0, `${name} as ${side} has a body`);
      seen.add(shown.format);
    }
  }
}, { path: "/studio/", allowed: ["status of 4"] });
assert.deepEqual(read.filter((name) => !seen.has(name)), [], "formats that nobody looked at");
console.log("{}");

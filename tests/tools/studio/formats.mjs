// node formats.mjs URL FILE...: every file is shown on both sides.

import assert from "node:assert/strict";
import { basename } from "node:path";
import { drop, withStudio } from "./page.mjs";

const [url, ...files] = process.argv.slice(2);

await withStudio(url, async (page) => {
  for (const file of files) {
    for (const side of ["source", "target"]) {
      await page.evaluate(() => { document.getElementById("problem").hidden = true; });
      await drop(page, side, [file]);
      const name = basename(file);
      // A problem may still be that of the file before.
      const isShown = ({ side, name }) => studio.state[side]?.file_name === name;
      await page.waitForFunction(isShown, { side, name });
      const seen = await page.evaluate((side) => {
        const { figure } = studio.viewer.stage[side];
        const triangles = figure.meshes.reduce((sum, { geometry }) => sum + (geometry.index?.count ?? 0) / 3, 0);
        return { name: studio.state[side]?.file_name, triangles, problem: document.getElementById("problem").hidden ? "" : document.getElementById("problem").textContent };
      }, side);
      assert.equal(seen.name, name, `${name} as ${side}: ${seen.problem}`);
      assert.ok(seen.triangles > 0, `${name} as ${side} has a body`);
    }
  }
}, { path: "/studio/", allowed: ["status of 4"] });
console.log("{}");

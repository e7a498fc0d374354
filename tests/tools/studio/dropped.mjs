// node dropped.mjs URL CLIP CHARACTER: two files of people, dropped one after the other, are retargeted and drawn.

import assert from "node:assert/strict";
import { basename } from "node:path";
import { drop, result, variance, withStudio } from "./page.mjs";

const [url, ...pairs] = process.argv.slice(2);

await withStudio(url, async (page) => {
  let { job } = await result(page);
  for (let index = 0; index < pairs.length; index += 2) {
    const [clip, character] = [pairs[index], pairs[index + 1]];
    await drop(page, "source", [clip]);
    await page.waitForFunction((name) => studio.state.source?.file_name === name, basename(clip));
    await drop(page, "target", [character]);
    await page.waitForFunction((name) => studio.state.target?.file_name === name, basename(character));
    const of = await result(page, job);
    ({ job } = of);
    assert.ok(["pass", "warn", "fail"].includes(of.verdict), `${basename(clip)} on ${basename(character)}: ${of.verdict}`);
    assert.ok(await variance(page) > 8, "the canvas is not blank");
    const isInside = await page.evaluate(() => {
      const { stage } = studio.viewer;
      return stage.ports().every((port) => {
        const { figure } = port.side;
        const at = stage.project(figure.center.getWorldPosition(stage.camera.position.clone()), port);
        return at && at[0] > port.clipLeft && at[0] < port.clipRight && at[1] > 0 && at[1] < port.height;
      });
    });
    assert.ok(isInside, "both figures are in the picture");
  }
});
console.log("{}");

// node batch.mjs URL FOLDER FILE...: three clips onto four characters, with the files of the folder.

import assert from "node:assert/strict";
import { join } from "node:path";
import { changed, result, withStudio } from "./page.mjs";

const [url, folder] = process.argv.slice(2);
const clips = ["walk_a.glb", "walk_b.bvh", "walk_c.glb"].map((name) => join(folder, name));
const characters = ["one.glb", "two.glb", "three.glb", "four.glb"].map((name) => join(folder, name));

await withStudio(url, async (page) => {
  await result(page);
  await page.click("#show-batch");
  await page.click('[aria-label="Remove walk.glb"]');
  await page.click('[aria-label="Remove mannequin.glb"]');
  for (const [button, files] of [["#batch-clips", clips], ["#batch-characters", characters]]) {
    const [chooser] = await Promise.all([page.waitForEvent("filechooser"), page.click(button)]);
    await chooser.setFiles(files);
    await page.waitForFunction((name) => document.getElementById("batch").textContent.includes(name), files.at(-1).split("/").pop());
  }
  assert.equal(await page.textContent("#batch-run"), "Retarget 12 pairs");
  await page.click("#batch-run");
  await page.waitForFunction(() => document.querySelectorAll("#batch .cell img").length === 12);
  const verdicts = await page.locator("#batch .cell .badge").allTextContents();
  assert.ok(verdicts.every((verdict) => ["pass", "warn", "fail"].includes(verdict)), verdicts.join());
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("text=Download all")]);
  await download.saveAs(join(folder, "batch.zip"));
  const { config } = await changed(page, () => page.locator("#batch .cell").nth(5).click());
  assert.deepEqual(config, {}, "the pair is opened");
  assert.equal(await page.evaluate(() => studio.state.source.file_name), "walk_b.bvh");
  assert.equal(await page.evaluate(() => studio.state.target.file_name), "two.glb");
});
console.log("{}");

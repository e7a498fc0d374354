// node keys.mjs URL KEY: a service that asks who calls. The page asks for a key, in words.

import assert from "node:assert/strict";
import { result, withStudio } from "./page.mjs";

const [url, key] = process.argv.slice(2);

await withStudio(url, async (page) => {
  await page.waitForSelector("dialog[open] #key");
  await page.keyboard.type("rtk_wrong");
  await page.keyboard.press("Enter");
  await page.waitForSelector("dialog[open] #key");
  await page.fill("#key", key);
  await page.keyboard.press("Enter");
  const { frames } = await result(page);
  assert.equal(frames, 121, "with it, everything goes");
  const kept = await page.evaluate(() => JSON.stringify([{ ...localStorage }, { ...sessionStorage }, document.cookie]));
  assert.equal(kept, '[{},{},""]', "the key is kept nowhere");
}, { allowed: ["status of 401", "status of 403"] });
console.log("{}");

// node explorer.mjs URL SOURCE TARGET: the page of the API in headless Chromium. What it puts into a request by itself is taken by the
// service: the main route with two chosen files, an upload, and the examples of a job and a batch.

import assert from "node:assert/strict";
import { PATIENCE, withStudio } from "./page.mjs";

const [url, source, target] = process.argv.slice(2);

/** The block of an operation, opened for trying out. */
async function tried(page, tag, operation) {
  const block = page.locator(`#operations-${tag}-${operation}`);
  await block.locator(".opblock-summary-control").first().click();
  await block.locator("button.try-out__btn").click();
  return block;
}

/** Sends what stands in the block, and gives the status and text of the answer. */
async function executed(block) {
  await block.locator("button.execute").click();
  const answer = block.locator(".live-responses-table .response").first();
  await answer.waitFor({ timeout: PATIENCE });
  const status = Number.parseInt(await answer.locator(".response-col_status").innerText(), 10);
  return { status, text: await answer.innerText() };
}

await withStudio(url, async (page) => {
  await page.waitForSelector("#operations-retarget-retarget");

  const main = await tried(page, "retarget", "retarget");
  const files = main.locator("input[type=file]");
  assert.ok(await files.count() >= 4, "source, target and both rest poses are chosen as files");
  await files.nth(0).setInputFiles(source);
  await files.nth(1).setInputFiles(target);
  const retargeted = await executed(main);
  assert.equal(retargeted.status, 200, `the main route: ${retargeted.text}`);

  const upload = await tried(page, "assets", "upload_asset");
  await upload.locator("input[type=file]").first().setInputFiles(source);
  const uploaded = await executed(upload);
  assert.ok([200, 201].includes(uploaded.status), `an upload: ${uploaded.text}`);

  for (const [tag, operation] of [["jobs", "create_job"], ["batches", "create_batch"]]) {
    const answer = await executed(await tried(page, tag, operation));
    assert.equal(answer.status, 202, `${operation}: ${answer.text}`);
  }
  console.log(JSON.stringify({ tried: 4 }));
}, { path: "/docs/api/" });

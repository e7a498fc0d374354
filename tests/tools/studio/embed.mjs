// node embed.mjs URL: the studio by address, and as a part of another page that talks with it.

import assert from "node:assert/strict";
import { result, withStudio } from "./page.mjs";

const url = process.argv[2];

async function upload(name) {
  const bytes = await (await fetch(`${url}/studio/sample/${name}.glb`)).arrayBuffer();
  const answer = await fetch(`${url}/v1/assets?filename=${name}.glb`, { method: "POST", body: bytes, headers: { "content-type": "application/octet-stream" } });
  return (await answer.json()).id;
}

const [source, target] = [await upload("walk"), await upload("mannequin")];
const config = { edit: { mirror: true } };

await withStudio(url, async (page) => {
  const of = await result(page);
  assert.deepEqual(of.config, config, "the config of the address");
}, { path: `/studio/?source=${source}&target=${target}&config=${encodeURIComponent(JSON.stringify(config))}` });

const parent = `<!doctype html><title>parent</title><iframe id="studio" src="/studio/?source=${source}" width="1000" height="700"></iframe>
<script>
  addEventListener("message", ({ data, source }) => {
    (globalThis.told ??= []).push(data);
    if (data.type === "retargetd:ready") source.postMessage({ type: "retargetd:load", source: "${source}", target: "${target}", config: ${JSON.stringify(config)} }, location.origin);
  });
</script>`;
await withStudio(url, async (page) => {
  await page.waitForFunction(() => globalThis.told?.some(({ type, config }) => type === "retargetd:result" && config.edit?.mirror));
  const told = await page.evaluate(() => globalThis.told.find(({ type }) => type === "retargetd:result"));
  assert.ok(told.job.startsWith("job_") && told.result.startsWith("res_") && told.verdict, JSON.stringify(told));
}, { path: "/parent.html", pages: { "/parent.html": parent } });
console.log("{}");

// What a user of openapi-fetch does with the types that openapi-typescript has made: `node journey.mjs SOURCE TARGET FOLDER`.
import { readFile, writeFile } from "node:fs/promises";
import { basename, join } from "node:path";
import createClient from "openapi-fetch";
import type { components, paths } from "./schema.js";

type Job = components["schemas"]["Job"];
type Batch = components["schemas"]["Batch"];
type JobState = components["schemas"]["JobState"];

const [sourcePath, targetPath, folder] = process.argv.slice(2) as [string, string, string];
const client = createClient<paths>({ baseUrl: process.env.RETARGETD_URL ?? "http://127.0.0.1:8080" });
const hasEnded = (state: JobState): boolean => state === "succeeded" || state === "failed" || state === "canceled";
const save = async (name: string, content: Blob): Promise<void> => writeFile(join(folder, name), new Uint8Array(await content.arrayBuffer()));

function known<T>(answer: { data?: T; error?: unknown }): T {
  if (answer.data === undefined) throw new Error(JSON.stringify(answer.error));
  return answer.data;
}

async function upload(path: string): Promise<components["schemas"]["NewJobInput"]> {
  const asset = known(
    await client.POST("/v1/assets", {
      params: { query: { filename: basename(path) } },
      headers: { "content-type": "application/octet-stream" },
      body: new Blob([await readFile(path)]),
      bodySerializer: (body) => body,
    }),
  );
  if (asset.file_name !== basename(path)) throw new Error(`it is called ${asset.file_name}`);
  return { asset: asset.id };
}

const [source, target] = [await upload(sourcePath), await upload(targetPath)];
console.log("uploaded two files");

const form = { source: new Blob([await readFile(sourcePath)]), target: new Blob([await readFile(targetPath)]) };
const made = await client.POST("/v1/retarget", {
  body: form,
  bodySerializer: (body) => {
    const data = new FormData();
    for (const [name, part] of Object.entries(body)) data.append(name, part as Blob);
    return data;
  },
  parseAs: "blob",
});
await save("one_shot.glb", known(made));
console.log("retargeted in one request");

const asked = known(await client.POST("/v1/jobs", { params: { header: { Prefer: "wait=20" } }, body: { source, target, output: ["glb"] } }));
if (!("state" in asked)) throw new Error("this is no job");
let job: Job = asked;
while (!hasEnded(job.state)) {
  job = known(await client.GET("/v1/jobs/{id}", { params: { path: { id: job.id }, header: { Prefer: "wait=20" } } }));
}
if (job.state !== "succeeded" || job.verdict === undefined || job.coverage === undefined) throw new Error(JSON.stringify(job));
console.log(`waited for a job: ${job.verdict}`);

const content = await client.GET("/v1/results/{id}/content", { params: { path: { id: job.results[0]!.id } }, parseAs: "blob" });
await save("job.glb", known(content));
console.log("downloaded its result");

const answer = known(await client.POST("/v1/batches", { body: { defaults: { target }, items: [{ source }, { source }] } }));
if (!("state" in answer)) throw new Error("this is no batch");
let batch: Batch = answer;
while (!hasEnded(batch.state)) {
  batch = known(await client.GET("/v1/batches/{id}", { params: { path: { id: batch.id }, header: { Prefer: "wait=20" } } }));
}
if (batch.counts.succeeded !== 2) throw new Error(JSON.stringify(batch));
console.log("waited for a batch");

const refused = await client.POST("/v1/jobs", { body: { source: { asset: "ast_00000000000000000000000000" }, target } });
if (refused.error?.code !== "unknown_asset") throw new Error(JSON.stringify(refused));
console.log(`was refused: ${refused.error.code}`);

// What a user of a client does that hey-api has made: `node journey.mjs SOURCE TARGET FOLDER`.
import { readFile, writeFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { client } from "./client/client.gen.js";
import { createBatch, createJob, downloadResult, retarget, showBatch, showJob, uploadAsset } from "./client/index.js";
import type { Batch, Job, JobState, NewJobInput } from "./client/index.js";

const [sourcePath, targetPath, folder] = process.argv.slice(2) as [string, string, string];
client.setConfig({ baseUrl: process.env.RETARGETD_URL ?? "http://127.0.0.1:8080" });
const hasEnded = (state: JobState): boolean => state === "succeeded" || state === "failed" || state === "canceled";
const save = async (name: string, content: Blob | File): Promise<void> => writeFile(join(folder, name), new Uint8Array(await content.arrayBuffer()));

function known<T>(answer: { data?: T; error?: unknown }): T {
  if (answer.data === undefined) throw new Error(JSON.stringify(answer.error));
  return answer.data;
}

async function upload(path: string): Promise<NewJobInput> {
  const asset = known(await uploadAsset({ body: new Blob([await readFile(path)]), query: { filename: basename(path) } }));
  if (asset.file_name !== basename(path)) throw new Error(`it is called ${asset.file_name}`);
  return { asset: asset.id };
}

const [source, target] = [await upload(sourcePath), await upload(targetPath)];
console.log("uploaded two files");

const file = async (path: string): Promise<File> => new File([await readFile(path)], basename(path));
const parts = { source: await file(sourcePath), target: await file(targetPath) };
await save("one_shot.glb", known(await retarget({ body: parts, parseAs: "blob" })) as Blob);
console.log("retargeted in one request");

const asked = known(await createJob({ body: { source, target, output: ["glb"] }, headers: { Prefer: "wait=20" } }));
if (!("state" in asked)) throw new Error("this is no job");
let job: Job = asked;
while (!hasEnded(job.state)) job = known(await showJob({ path: { id: job.id }, headers: { Prefer: "wait=20" } }));
if (job.state !== "succeeded" || job.verdict === undefined || job.coverage === undefined) throw new Error(JSON.stringify(job));
console.log(`waited for a job: ${job.verdict}`);

await save("job.glb", known(await downloadResult({ path: { id: job.results[0]!.id }, parseAs: "blob" })));
console.log("downloaded its result");

const answer = known(await createBatch({ body: { defaults: { target }, items: [{ source }, { source }] } }));
if (!("state" in answer)) throw new Error("this is no batch");
let batch: Batch = answer;
while (!hasEnded(batch.state)) batch = known(await showBatch({ path: { id: batch.id }, headers: { Prefer: "wait=20" } }));
if (batch.counts.succeeded !== 2) throw new Error(JSON.stringify(batch));
console.log("waited for a batch");

const refused = await createJob({ body: { source: { asset: "ast_00000000000000000000000000" }, target } });
if (refused.error?.code !== "unknown_asset") throw new Error(JSON.stringify(refused));
console.log(`was refused: ${refused.error.code}`);

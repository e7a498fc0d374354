// What a user of a client does that OpenAPI Generator has made with typescript-fetch: `node journey.mjs SOURCE TARGET FOLDER`.
import { readFile, writeFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { AssetsApi, BatchesApi, Configuration, JobsApi, ResponseError, ResultsApi, RetargetApi } from "./client/index.js";
import type { Batch, Job, JobState, NewJobInput } from "./client/index.js";

const [sourcePath, targetPath, folder] = process.argv.slice(2) as [string, string, string];
const configuration = new Configuration({ basePath: process.env.RETARGETD_URL ?? "http://127.0.0.1:8080" });
const assets = new AssetsApi(configuration);
const jobs = new JobsApi(configuration);
const batches = new BatchesApi(configuration);
const hasEnded = (state: JobState): boolean => state === "succeeded" || state === "failed" || state === "canceled";
const save = async (name: string, content: Blob): Promise<void> => writeFile(join(folder, name), new Uint8Array(await content.arrayBuffer()));

async function upload(path: string): Promise<NewJobInput> {
  const asset = await assets.uploadAsset({ body: new Blob([await readFile(path)]), filename: basename(path) });
  if (asset.fileName !== basename(path)) throw new Error(`it is called ${asset.fileName}`);
  return { asset: asset.id };
}

const [source, target] = [await upload(sourcePath), await upload(targetPath)];
console.log("uploaded two files");

const parts = { source: new Blob([await readFile(sourcePath)]), target: new Blob([await readFile(targetPath)]) };
await save("one_shot.glb", await new RetargetApi(configuration).retarget(parts));
console.log("retargeted in one request");

const asked = await jobs.createJob({ newJob: { source, target, output: ["glb"] }, prefer: "wait=20" });
if (!("state" in asked)) throw new Error("this is no job");
let job: Job = asked;
while (!hasEnded(job.state)) job = await jobs.showJob({ id: job.id, prefer: "wait=20" });
if (job.state !== "succeeded" || job.verdict === undefined || job.coverage === undefined) throw new Error(JSON.stringify(job));
console.log(`waited for a job: ${job.verdict}`);

await save("job.glb", await new ResultsApi(configuration).downloadResult({ id: job.results[0]!.id }));
console.log("downloaded its result");

const answer = await batches.createBatch({ newBatch: { defaults: { target }, items: [{ source }, { source }] } });
if (!("state" in answer)) throw new Error("this is no batch");
let batch: Batch = answer;
while (!hasEnded(batch.state)) batch = await batches.showBatch({ id: batch.id, prefer: "wait=20" });
if (batch.counts.succeeded !== 2) throw new Error(JSON.stringify(batch));
console.log("waited for a batch");

try {
  await jobs.createJob({ newJob: { source: { asset: "ast_00000000000000000000000000" }, target } });
  throw new Error("a job on nothing was taken");
} catch (error) {
  if (!(error instanceof ResponseError)) throw error;
  const problem = (await error.response.json()) as { code: string };
  if (problem.code !== "unknown_asset") throw error;
  console.log(`was refused: ${problem.code}`);
}

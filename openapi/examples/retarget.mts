/**
 * Retargets a clip with a running retargetd: upload, ask, follow, download. Needs nothing but Node's own fetch.
 *
 *     node retarget.mts walk.glb mannequin.glb out.glb
 *
 * Node 23.6 and newer run it as it stands; for older ones, `tsc` makes JavaScript of it. The service is at RETARGETD_URL
 * (default http://127.0.0.1:8080); RETARGETD_KEY is sent where it is set.
 */

import { createHash, randomUUID } from "node:crypto";
import { readFile, writeFile } from "node:fs/promises";
import { basename } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";

const service = (process.env.RETARGETD_URL ?? "http://127.0.0.1:8080").replace(/\/$/, "");
const key = process.env.RETARGETD_KEY;
const tries = 8;

type ProblemDocument = { code: string; detail: string; retryable?: boolean; errors?: unknown[] };
type Progress = { phase: string; done: number; total: number };
type Result = { id: string; format: string; file_name: string; sha256: string; content: string };
type State = "queued" | "running" | "canceling" | "succeeded" | "failed" | "canceled";
type Job = { id: string; state: State; results: Result[]; warnings_count: number; problem?: ProblemDocument };
type Told = { event: string; data: { progress?: Progress } };

/** The service refuses; `document` is its problem (RFC 9457). */
class Problem extends Error {
  readonly document: ProblemDocument;

  constructor(document: ProblemDocument) {
    super(`${document.code}: ${document.detail}`);
    this.document = document;
  }
}

/** Sends a request. What may work later is tried again, as long as the service asks for. */
async function call(method: string, path: string, headers: Record<string, string> = {}, body?: BodyInit): Promise<Response> {
  const sent = key === undefined ? headers : { ...headers, authorization: `Bearer ${key}` };
  for (let attempt = 0; ; attempt += 1) {
    const isLast = attempt === tries - 1;
    let pause = 250 * 2 ** attempt;
    try {
      const answer = await fetch(service + path, { method, headers: sent, body });
      if (answer.ok) return answer;
      const problem = await problemOf(answer);
      if (!problem.retryable || isLast) throw new Problem(problem);
      pause = 1000 * Number(answer.headers.get("retry-after") ?? pause / 1000);
    } catch (error) {
      if (error instanceof Problem || isLast) throw error;
    }
    await sleep(pause);
  }
}

async function problemOf(answer: Response): Promise<ProblemDocument> {
  try {
    return (await answer.json()) as ProblemDocument;
  } catch {
    return { code: String(answer.status), detail: answer.statusText, retryable: [502, 503, 504].includes(answer.status) };
  }
}

async function callJson<T>(method: string, path: string, document?: unknown, headers: Record<string, string> = {}): Promise<T> {
  const body = document === undefined ? undefined : JSON.stringify(document);
  const answer = await call(method, path, { "content-type": "application/json", ...headers }, body);
  return (await answer.json()) as T;
}

/** Uploads a file; gives its id. The same bytes again give the same id. */
async function upload(path: string): Promise<string> {
  const content = new Uint8Array(await readFile(path));
  const headers = { "content-type": "application/octet-stream" };
  const answer = await call("POST", `/v1/assets?filename=${encodeURIComponent(basename(path))}`, headers, content);
  return ((await answer.json()) as { id: string }).id;
}

/** What happens to a job until it ends. A stream that breaks is taken up where it was. */
async function* events(job: string): AsyncGenerator<Told> {
  let lastId = "";
  for (;;) {
    const answer = await call("GET", `/v1/jobs/${job}/events`, lastId === "" ? {} : { "last-event-id": lastId });
    if (answer.status === 204 || answer.body === null) return;
    let [text, event] = ["", ""];
    try {
      for await (const chunk of answer.body.pipeThrough(new TextDecoderStream())) {
        const lines = (text + chunk).split("\n");
        text = lines.pop() ?? "";
        for (const line of lines) {
          if (line.startsWith("id: ")) lastId = line.slice(4);
          if (line.startsWith("event: ")) event = line.slice(7);
          if (line.startsWith("data: ")) yield { event, data: JSON.parse(line.slice(6)) };
        }
      }
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;
    }
    const { state } = await callJson<Job>("GET", `/v1/jobs/${job}`);
    if (["succeeded", "failed", "canceled"].includes(state)) return;
    await sleep(1000);
  }
}

/** Puts the animation of one file onto the character of another; writes the result and gives the job. */
export async function retarget(source: string, target: string, output: string, config?: object): Promise<Job> {
  const asked = { source: { asset: await upload(source) }, target: { asset: await upload(target) }, output: ["glb"], config };
  // However often this has to be sent, there is one job.
  const { id } = await callJson<Job>("POST", "/v1/jobs", asked, { "idempotency-key": randomUUID() });
  for await (const { event, data } of events(id)) {
    const { progress } = data;
    console.error(progress === undefined ? event : `${progress.phase} ${progress.done}/${progress.total}`);
  }
  const job = await callJson<Job>("GET", `/v1/jobs/${id}`);
  const result = job.results[0];
  if (job.state !== "succeeded" || result === undefined) {
    throw new Problem(job.problem ?? { code: job.state, detail: "the job did not succeed" });
  }
  const answer = await call("GET", result.content);
  const content = new Uint8Array(await answer.arrayBuffer());
  if (createHash("sha256").update(content).digest("hex") !== result.sha256) {
    throw new Error("what arrived is not what the service holds");
  }
  await writeFile(output, content);
  return job;
}

const [source, target, output] = process.argv.slice(2);
if (source === undefined || target === undefined || output === undefined) {
  console.error("usage: node retarget.mts SOURCE TARGET OUTPUT");
  process.exit(2);
}
try {
  const job = await retarget(source, target, output);
  console.log(`wrote ${output}: job ${job.id}, ${job.warnings_count} warnings`);
} catch (error) {
  console.error(error instanceof Error ? error.message : error);
  process.exit(1);
}

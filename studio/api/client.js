// Requests to the service that the page came from. The key, where one is asked for, is in memory only.

/** @typedef {import("./types.js").ProblemBody} ProblemBody */

let key = "";
/** @type {(() => Promise<boolean>)|null} asks the person for a key; false where none was given */
let askForKey = null;

/** A refusal of the service, in its words. */
export class Refused extends Error {
  /** @param {ProblemBody} problem */
  constructor(problem) {
    super(problem.detail || problem.title);
    this.problem = problem;
  }
}

/** @param {string} text */
export function setKey(text) {
  key = text.trim();
}

/** @param {() => Promise<boolean>} ask */
export function onKeyNeeded(ask) {
  askForKey = ask;
}

/**
 * Asks the service. Where it wants a key, the person is asked for one and the request is sent again.
 * @param {string} path
 * @param {RequestInit & {json?: unknown}} [options]
 * @returns {Promise<Response>}
 */
export async function request(path, options = {}) {
  const { json, ...rest } = options;
  const headers = new Headers(rest.headers);
  if (json !== undefined) {
    headers.set("content-type", "application/json");
    rest.body = JSON.stringify(json);
    rest.method ??= "POST";
  }
  if (key) headers.set("authorization", `Bearer ${key}`);
  let answer;
  try {
    answer = await fetch(path, { ...rest, headers });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new Refused({ code: "unreachable", title: "The service does not answer", detail: "The service does not answer.", status: 0, hint: "Is it still running?" });
  }
  if (answer.status === 401 && askForKey && await askForKey()) return request(path, options);
  if (answer.ok) return answer;
  throw new Refused(await problemOf(answer));
}

/**
 * @param {Response} answer
 * @returns {Promise<ProblemBody>}
 */
async function problemOf(answer) {
  try {
    return { status: answer.status, ...await answer.json() };
  } catch {
    return { code: "unknown", title: answer.statusText, detail: `The service answered with ${answer.status}.`, status: answer.status };
  }
}

/**
 * @param {string} path
 * @param {RequestInit & {json?: unknown}} [options]
 * @returns {Promise<any>}
 */
export async function getJson(path, options = {}) {
  const headers = new Headers(options.headers);
  headers.set("accept", "application/json");
  return (await request(path, { ...options, headers })).json();
}

/**
 * @param {string} path
 * @param {RequestInit & {json?: unknown}} [options]
 */
export async function getBytes(path, options = {}) {
  return (await request(path, options)).arrayBuffer();
}

/**
 * Uploads a file and gives its record.
 * @param {Blob} file
 * @param {string} name
 * @returns {Promise<import("./types.js").Asset>}
 */
export async function upload(file, name) {
  const path = `/v1/assets?filename=${encodeURIComponent(name)}`;
  return getJson(path, { method: "POST", body: file, headers: { "content-type": "application/octet-stream" } });
}

// Being part of another page: files and config by the address or by messages, and messages about what came of it.

import { getJson, setKey } from "./api/client.js";
import { attempt, useAsset } from "./api/live.js";
import { replaceConfig, state, watch } from "./state.js";

/** @typedef {{source?: string, target?: string, config?: Record<string, any>, key?: string}} Wanted */

/** @type {(asset: import("./api/types.js").Asset, config?: Record<string, any>) => Promise<void>} */
let showDrawing = async () => {};

/** @param {(asset: import("./api/types.js").Asset, config?: Record<string, any>) => Promise<void>} show takes targets that are flat */
export function showDrawingsBy(show) {
  showDrawing = show;
}

/**
 * Opens what the address names: `?source=ast_…&target=ast_…&config={…}`.
 * @returns {Promise<boolean>} whether it names anything
 */
export async function openFromAddress() {
  const query = new URLSearchParams(location.search);
  const [source, target, config] = [query.get("source"), query.get("target"), query.get("config")];
  if (!source && !target) return false;
  await load({ source: source ?? undefined, target: target ?? undefined, config: config ? JSON.parse(config) : undefined });
  return true;
}

/** @param {Wanted} wanted */
async function load({ source, target, config, key }) {
  if (key !== undefined) setKey(key);
  await attempt(async () => {
    if (source) await useAsset("source", await getJson(`/v1/assets/${encodeURIComponent(source)}`));
    const character = target ? await getJson(`/v1/assets/${encodeURIComponent(target)}`) : null;
    if (character?.format === "drawing") return showDrawing(character, config);
    if (character) await useAsset("target", character);
    if (config) replaceConfig(config);
  });
}

/** Listens to the page that this one is part of. Who may show it is up to the service's `frame-ancestors`. */
export function listenToParent() {
  if (parent === window) return;
  let origin = "";
  addEventListener("message", (event) => {
    if (event.source !== parent || event.data?.type !== "retargetd:load") return;
    origin = event.origin;
    void load(event.data);
  });
  watch(["report", "result"], () => {
    if (!origin || !state.report || !state.result) return;
    const { verdict, verdict_reason: reason } = state.report.measures ?? {};
    parent.postMessage({ type: "retargetd:result", job: state.job, result: state.result, verdict, verdict_reason: reason, config: structuredClone(state.resultConfig) }, origin);
  });
  // Holds nothing of anybody.
  parent.postMessage({ type: "retargetd:ready" }, "*");
}

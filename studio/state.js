// What the page knows: two files, what somebody has changed, and what came of it. Panels listen to the parts that they show.

/** @typedef {import("./api/types.js").Asset} Asset */
/** @typedef {import("./api/types.js").Config} Config */
/** @typedef {import("./api/types.js").Proposal} Proposal */
/** @typedef {import("./api/types.js").Report} Report */
/** @typedef {import("./view/figure.js").Figure} Figure */
/** @typedef {import("./view/motion.js").Motion} Motion */

/**
 * @typedef {object} State
 * @property {Asset|null} source the file with the animation
 * @property {Asset|null} target the file with the character
 * @property {Config} config what differs from what the service finds out by itself
 * @property {Proposal|null} proposal what a retarget would do
 * @property {Report|null} report of the latest result
 * @property {string} job of the latest result
 * @property {string} result the latest result
 * @property {Config|null} resultConfig what the latest result was made with: not `config` for as long as a change waits for its result
 * @property {Motion|null} motion of the latest result
 * @property {{motion: Motion, report: Report, result: string, config: Config}|null} pinned what is compared with
 * @property {boolean} showsPinned whether the pinned one is shown in place of the latest
 * @property {string} joint the selected joint of the target
 * @property {string} sourceJoint the selected joint of the source
 * @property {number} seconds where playback is
 * @property {number} frame the frame there
 * @property {boolean} busy whether a request is under way
 * @property {string} progress of a request that takes long
 * @property {boolean} posing whether the rest pose is shown and edited
 * @property {any} schema JSON Schema of the retarget spec
 */

/** @type {State} */
export const state = {
  source: null, target: null, config: {}, proposal: null, report: null, job: "", result: "", resultConfig: null, motion: null,
  pinned: null, showsPinned: false, joint: "", sourceJoint: "", seconds: 0, frame: 0, busy: false, progress: "", posing: false, schema: null,
};

/** @type {Map<string, Set<() => void>>} */
const listeners = new Map();

/**
 * Calls whenever one of these parts has changed.
 * @param {(keyof State)[]} names
 * @param {() => void} call
 */
export function watch(names, call) {
  for (const name of names) {
    const known = listeners.get(name) ?? new Set();
    listeners.set(name, known.add(call));
  }
}

/**
 * Changes parts of the state and tells who listens, each once.
 * @param {Partial<State>} changes
 */
export function set(changes) {
  const told = new Set();
  for (const [name, value] of Object.entries(changes)) {
    if (/** @type {any} */ (state)[name] === value) continue;
    /** @type {any} */ (state)[name] = name === "config" ? frozen(value) : value;
    for (const call of listeners.get(name) ?? []) told.add(call);
  }
  for (const call of told) call();
}

/**
 * A config is replaced and never changed in place, which nobody would be told of.
 * @template T
 * @param {T} value
 * @returns {T}
 */
function frozen(value) {
  if (typeof value !== "object" || value === null) return value;
  for (const member of Object.values(value)) frozen(member);
  return Object.freeze(value);
}

/** @type {string[]} */
let past = [];
/** @type {string[]} */
let future = [];

/**
 * Changes the config: `change` works on a copy. Empty objects and absent values are taken out, so that it stays the difference.
 * @param {(config: Config) => void} change
 */
export function edit(change) {
  const before = JSON.stringify(state.config);
  const config = JSON.parse(before);
  change(config);
  const pruned = prune(config) ?? {};
  if (JSON.stringify(pruned) === before) return;
  past.push(before);
  if (past.length > 200) past.shift();
  future = [];
  set({ config: pruned });
}

/** @param {Config} config */
export function replaceConfig(config) {
  edit((draft) => {
    for (const name of Object.keys(draft)) delete draft[name];
    Object.assign(draft, config);
  });
}

/** Forgets what was changed, for other files. */
export function resetConfig() {
  past = [];
  future = [];
  set({ config: {} });
}

export function undo() {
  const before = past.pop();
  if (before === undefined) return;
  future.push(JSON.stringify(state.config));
  set({ config: JSON.parse(before) });
}

export function redo() {
  const after = future.pop();
  if (after === undefined) return;
  past.push(JSON.stringify(state.config));
  set({ config: JSON.parse(after) });
}

export function canUndo() {
  return past.length > 0;
}

export function canRedo() {
  return future.length > 0;
}

/**
 * @param {any} value
 * @returns {any}
 */
function prune(value) {
  if (value === null || value === undefined) return undefined;
  if (Array.isArray(value) || typeof value !== "object") return value;
  /** @type {Record<string, any>} */
  const kept = {};
  for (const [name, member] of Object.entries(value)) {
    const of = prune(member);
    if (of !== undefined) kept[name] = of;
  }
  return Object.keys(kept).length ? kept : undefined;
}

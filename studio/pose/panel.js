// The pose that retargeting measures from: both figures at rest, what is left between them, and edits by hand.

import { request } from "../api/client.js";
import { figures, pair } from "../api/live.js";
import { showProblem } from "../api/problem.js";
import { el, short, words } from "../dom.js";
import { edit, set, state, watch } from "../state.js";
import { readMotion } from "../view/motion.js";
import { degreesOf, mirrored } from "./turns.js";

/** @typedef {{edit: string, joint?: string, degrees?: [number, number, number], axes?: string, joints?: string[], clip?: any, frame?: number}} PoseEdit */

const ALIGNS = { auto: "what is known", off: "not at all", direction: "direction of bones", full: "direction and roll" };
const RESTS = { auto: "found out", bind: "the bound mesh", nodes: "the file's nodes", solved: "a T pose, made by role" };

/** @returns {PoseEdit[]} */
function edits() {
  return state.config.target?.pose ?? [];
}

/** @param {(list: PoseEdit[]) => PoseEdit[]} change */
function changeEdits(change) {
  const list = change(structuredClone(edits()));
  edit((config) => {
    config.target = { ...config.target, pose: list };
    if (!list.length) delete config.target.pose;
  });
}

/**
 * Adds a turn by hand; one after another of the same joint about the same axis is added up.
 * @param {string} joint
 * @param {import("../vendor/three.js").Quaternion} turn in the axes of the file
 */
export function turnJoint(joint, turn) {
  const degrees = degreesOf(turn, figures.target?.facts.front ?? [0, 0, 1]);
  addTurn(joint, degrees);
}

/**
 * @param {string} joint
 * @param {[number, number, number]} degrees
 */
export function addTurn(joint, degrees) {
  changeEdits((list) => [...list, { edit: "rotate", joint, degrees }]);
}

/** The figures' rest poses as the service has them, with the edits. */
export async function showRestPoses() {
  if (!state.target || !state.source) return;
  try {
    await Promise.all([restOf("target"), restOf("source")]);
  } catch (error) {
    showProblem(error);
  }
}

/** @param {"source"|"target"} side */
async function restOf(side) {
  const asset = { asset: state[side]?.id };
  const config = { target: state.config[side] ?? {}, pose: { to: "rest" }, output: { format: "glb", include: "skeleton+animation", target_clips: "drop" } };
  const answer = await request("/v1/retarget", { json: { source: asset, target: asset, config }, headers: { accept: "model/gltf-binary", prefer: "wait=60" } });
  figures[side]?.move(readMotion(await answer.arrayBuffer()));
}

/** The name of a joint's twin on the other side of the body, by its role. @param {string} joint */
function twinOf(joint) {
  for (const { role, target } of state.proposal?.roles ?? []) {
    const joints = Array.isArray(target) ? target : target ? [target] : [];
    const place = joints.indexOf(joint);
    if (place < 0) continue;
    const other = role.startsWith("left_") ? role.replace("left_", "right_") : role.startsWith("right_") ? role.replace("right_", "left_") : "";
    const twin = state.proposal?.roles.find((of) => of.role === other)?.target;
    return (Array.isArray(twin) ? twin : twin ? [twin] : [])[place];
  }
  return undefined;
}

function mirror() {
  changeEdits((list) => {
    const left = list.filter(({ edit: kind, joint }) => kind === "rotate" && joint && state.proposal?.roles.some(({ role, target }) => role.startsWith("left_") && [target].flat().includes(joint)));
    const twins = new Set(left.map(({ joint }) => twinOf(joint ?? "")));
    const kept = list.filter(({ joint }) => !joint || !twins.has(joint));
    return [...kept, ...left.flatMap((own) => {
      const joint = twinOf(own.joint ?? "");
      return joint && own.degrees ? [{ ...own, joint, degrees: mirrored(own.degrees) }] : [];
    })];
  });
}

/** @param {HTMLElement} panel */
export function posePanel(panel) {
  const toggle = el("button", { type: "button", class: "primary", onclick: () => set({ posing: !state.posing }) });
  const align = select("Align with the clip's pose", ALIGNS, (value) => edit((config) => { config.align = value === "auto" ? undefined : value; }));
  const rest = select("Measure from", RESTS, (value) => edit((config) => { config.target = { ...config.target, rest: value === "auto" ? undefined : value }; }));
  const joint = el("div", { class: "joint" });
  const chosen = el("select", { id: "pose-joint", onchange: () => set({ joint: chosen.value }) });
  const list = el("ol", { class: "edits" });
  const left = el("table", { class: "residuals" });
  panel.append(
    el("p", { class: "lead" }, "Retargeting measures from a rest pose. Where an arm or a hand comes out wrong all the time, turn it here."),
    el("div", { class: "row" }, toggle), el("div", { class: "fields" }, align.field, rest.field),
    el("h3", {}, "By hand"), el("div", { class: "field" }, el("label", { for: "pose-joint" }, "Joint"), chosen), joint,
    el("h3", {}, "Edits"), list,
    el("div", { class: "row" }, el("button", { type: "button", onclick: mirror, title: "The edits of the left side on the right side" }, "Mirror left to right"), el("button", { type: "button", onclick: () => changeEdits(() => []) }, "Reset all")),
    el("h3", {}, "What is left between the rest poses"), left,
  );
  const draw = () => {
    toggle.textContent = state.posing ? "Back to the motion (Esc)" : "Show and turn the rest pose (P)";
    toggle.disabled = !state.target || !state.source;
    align.box.value = state.config.align ?? "auto";
    rest.box.value = typeof state.config.target?.rest === "string" ? state.config.target.rest : "auto";
    const labels = [...figures.target?.byLabel.keys() ?? []];
    if (chosen.options.length !== labels.length + 1 || chosen.options[1]?.value !== labels[0]) {
      chosen.replaceChildren(el("option", { value: "" }, "click one, or choose…"), ...labels.map((label) => el("option", { value: label }, label)));
    }
    chosen.value = labels.includes(state.joint) ? state.joint : "";
    joint.replaceChildren(...jointTools());
    list.replaceChildren(...edits().map((of, index) => el("li", {}, describe(of), el("button", { type: "button", class: "icon", "aria-label": "Remove this edit", onclick: () => changeEdits((all) => all.filter((_, other) => other !== index)) }, "×"))));
    if (!edits().length) list.replaceChildren(el("li", { class: "empty" }, "None. The rest pose is the file's own."));
    left.replaceChildren(...(state.proposal?.alignment ?? []).filter(({ direction_degrees: direction, turned_degrees: turned }) => (direction ?? 0) > 0.5 || turned > 0.5).map(residual));
  };
  watch(["config", "proposal", "posing", "joint", "source", "target"], draw);
  draw();
}

/**
 * @param {string} label
 * @param {Record<string, string>} options
 * @param {(value: string) => void} change
 */
function select(label, options, change) {
  const box = el("select", { "aria-label": label, onchange: () => change(box.value) }, ...Object.entries(options).map(([value, text]) => el("option", { value }, text)));
  return { box, field: el("div", { class: "field" }, el("span", { class: "label" }, label), box) };
}

/** @param {PoseEdit} of */
function describe(of) {
  if (of.edit === "rotate") return `${of.joint}: ${(of.degrees ?? []).map((part, index) => `${"XYZ"[index]} ${short(part)}°`).join(", ")}`;
  if (of.edit === "reset") return `back to the file: ${of.joints?.join(", ") || "all"}`;
  return `${of.joints?.join(", ") || "all"} from frame ${of.frame ?? 0} of ${of.clip}`;
}

/** What can be done with the selected joint without a mouse. */
function jointTools() {
  const { joint } = state;
  if (!joint) return [el("p", { class: "hint" }, "Rings turn it in the picture; here it is turned by degrees about the character's own axes.")];
  const boxes = ["X", "Y", "Z"].map((axis) => el("input", { type: "number", step: 5, ".value": 0, "aria-label": `Degrees about ${axis}` }));
  const turn = () => {
    const degrees = /** @type {[number, number, number]} */ (boxes.map((box) => Number(box.value) || 0));
    if (degrees.some((part) => part !== 0)) addTurn(joint, degrees);
  };
  const own = edits().some((of) => of.joint === joint);
  return [
    el("form", { class: "row", onsubmit: (/** @type {Event} */ event) => { event.preventDefault(); turn(); } }, ...boxes, el("button", {}, "Turn"), el("button", { type: "button", ".disabled": !own, onclick: () => changeEdits((list) => list.filter((of) => of.joint !== joint)) }, "Reset joint")),
    ...fromClip(joint),
    el("p", { class: "hint" }, "X points to the character's left, Y up, Z to its front. In the picture: Q for its own axes, X Y Z for one axis."),
  ];
}

/**
 * The joint as it is at a frame of the character's own clip, where it has one.
 * @param {string} joint
 */
function fromClip(joint) {
  const [clip] = figures.target?.facts.clips.filter(({ moves }) => moves) ?? [];
  if (!clip) return [];
  const frame = el("input", { type: "number", min: 0, max: clip.frames - 1, ".value": 0, "aria-label": "Frame of the character's own clip" });
  const take = () => changeEdits((list) => [...list, { edit: "from_clip", clip: clip.name, frame: Number(frame.value), joints: [joint] }]);
  return [el("form", { class: "row", onsubmit: (/** @type {Event} */ event) => { event.preventDefault(); take(); } }, "As at frame ", frame, ` of ${clip.name || "its clip"} `, el("button", {}, "Take"))];
}

/** @param {import("../api/types.js").Alignment} of */
function residual({ role, joint, aligned, turned_degrees: turned, direction_degrees: direction }) {
  return el("tr", { onclick: () => set({ joint }) }, el("th", { scope: "row" }, words(role)), el("td", {}, joint), el("td", {}, `turned ${short(turned)}°`), el("td", { class: (direction ?? 0) > 10 ? "warn" : "" }, direction === undefined ? aligned : `${short(direction)}° left`));
}

// Which joint of the clip drives which joint of the character, by role. What is missing or unsure comes first.

import { getJson } from "../api/client.js";
import { figures, pair } from "../api/live.js";
import { showProblem } from "../api/problem.js";
import { el, short, words } from "../dom.js";
import { edit, set, state, watch } from "../state.js";

/** @typedef {import("../api/types.js").RolePair} RolePair */
/** @typedef {"source"|"target"} SideName */

const SURE = 0.85;
const LIKELY = 0.6;
let filter = "";
let selectedRole = "";

/**
 * How sure the service is: `missing`, `unsure`, `likely`, `sure`, or `spare` where only one side has a part that not all bodies have.
 * @param {RolePair} pair
 */
function grade({ role, source, target, confidence }) {
  if (!source || !target) return MAIN.test(role) ? "missing" : "spare";
  if (confidence === null) return "likely";
  return confidence >= SURE ? "sure" : confidence >= LIKELY ? "likely" : "unsure";
}

const ORDER = ["unsure", "missing", "likely", "sure", "spare"];
/** Parts that a body always has: where one is missing, something is wrong. */
const MAIN = /^(pelvis|spine|head|(left|right)_(thigh|shin|foot|upper_arm|forearm|hand))$/;

/** @param {RolePair} pair */
function isOverridden({ role }) {
  return state.config.source?.roles?.[role] !== undefined || state.config.target?.roles?.[role] !== undefined;
}

/** @param {HTMLElement} panel */
export function mappingPanel(panel) {
  const find = el("input", { type: "search", placeholder: "Find a role or joint", "aria-label": "Find a role or joint", oninput: () => { filter = find.value.toLowerCase(); draw(); } });
  const reset = el("button", { type: "button", onclick: () => edit((config) => { delete config.source?.roles; delete config.target?.roles; }) }, "Take changes back");
  const summary = el("p", { class: "lead" });
  const table = el("div", { class: "mapping", role: "list", "aria-label": "Mapping by role" });
  const joints = el("div", {});
  const why = el("section", { class: "why", "aria-live": "polite" });
  panel.append(summary, el("div", { class: "row" }, find, reset), table, joints, why);
  const draw = () => {
    const roles = state.proposal?.roles ?? [];
    reset.disabled = !roles.some(isOverridden);
    const graded = roles.map((pair) => ({ pair, grade: grade(pair) })).filter(({ pair }) => pair.role !== "root" || pair.source);
    const counts = Object.fromEntries(ORDER.map((name) => [name, graded.filter((row) => row.grade === name).length]));
    summary.textContent = roles.length
      ? `${counts.sure + counts.likely} roles are on both sides${counts.unsure ? `, ${counts.unsure} of them unsure` : ""}${counts.missing ? `; ${counts.missing} are missing` : ""}; ${counts.spare} are on one side only.`
      : "Open a clip and a character: what drives what is found by itself and shown here.";
    const seen = graded.filter(({ pair }) => !filter || JSON.stringify([pair.role, pair.source, pair.target]).toLowerCase().includes(filter));
    seen.sort((one, other) => ORDER.indexOf(one.grade) - ORDER.indexOf(other.grade));
    const focus = document.activeElement?.getAttribute("data-focus");
    joints.replaceChildren(datalist("source"), datalist("target"));
    table.replaceChildren(...seen.map(({ pair, grade: of }) => row(pair, of)));
    if (focus && table.querySelector(`[data-focus="${focus}"]`)) /** @type {HTMLElement} */ (table.querySelector(`[data-focus="${focus}"]`)).focus();
  };
  watch(["proposal", "config", "source", "target"], draw);
  watch(["joint", "sourceJoint"], () => {
    const of = state.proposal?.roles.find(({ target }) => asList(target).includes(state.joint));
    const isOther = of !== undefined && of.role !== selectedRole;
    if (isOther) selectedRole = of.role;
    // Not drawn anew: somebody may be typing in the row.
    for (const item of /** @type {Iterable<HTMLElement>} */ (table.children)) showSelection(item);
    if (isOther) table.querySelector(".selected")?.scrollIntoView({ block: "nearest" });
    explain(why);
  });
  draw();
}

/** @param {string|string[]|null} joints */
function asList(joints) {
  return joints === null ? [] : Array.isArray(joints) ? joints : [joints];
}

/**
 * The joints of a side, for the boxes that offer them.
 * @param {SideName} side
 */
function datalist(side) {
  const labels = [...figures[side]?.byLabel.keys() ?? []];
  return el("datalist", { id: `joints-${side}` }, ...labels.map((label) => el("option", { value: label })));
}

/**
 * @param {RolePair} pair
 * @param {string} of
 */
function row(pair, of) {
  const isSelected = pair.role === selectedRole;
  const select = () => {
    if (selectedRole === pair.role) return;
    selectedRole = pair.role;
    set({ joint: asList(pair.target)[0] ?? "", sourceJoint: asList(pair.source)[0] ?? "" });
  };
  const item = el("div", { class: `role ${of}${isSelected ? " selected" : ""}${isOverridden(pair) ? " changed" : ""}`, role: "listitem", "data-role": pair.role, onfocusin: select, onclick: select },
    el("span", { class: "dot", role: "img", "aria-label": of, title: of === "spare" ? "on one side only" : pair.confidence === null ? of : `${of}: ${Math.round(pair.confidence * 100)} % sure` }),
    el("span", { class: "name" }, words(pair.role)),
    box(pair, "source"), el("span", { class: "to", "aria-hidden": "true" }, "→"), box(pair, "target"));
  if (isSelected) item.append(details(pair));
  return item;
}

/** Opens the row of the selected role, and closes others. @param {HTMLElement} item */
function showSelection(item) {
  const isSelected = item.dataset.role === selectedRole;
  item.classList.toggle("selected", isSelected);
  item.querySelector(".details")?.remove();
  const pair = state.proposal?.roles.find(({ role }) => role === selectedRole);
  if (isSelected && pair) item.append(details(pair));
}

/**
 * @param {RolePair} pair
 * @param {SideName} side
 */
function box(pair, side) {
  const joints = asList(pair[side]);
  const prefix = prefixOf(side);
  const brief = (/** @type {string} */ name) => (name.startsWith(prefix) ? name.slice(prefix.length) : name);
  const whole = (/** @type {string} */ name) => (figures[side]?.byLabel.has(name) || !figures[side]?.byLabel.has(prefix + name) ? name : prefix + name);
  const label = `${words(pair.role)} of the ${side === "source" ? "clip" : "character"}`;
  return el("input", {
    type: "text", list: `joints-${side}`, ".value": joints.map(brief).join(", "), placeholder: "none", "aria-label": label, title: joints.join(", "), "data-focus": `${side} ${pair.role}`, spellcheck: "false",
    onchange: (/** @type {any} */ event) => assign(side, pair.role, event.target.value.split(",").map((/** @type {string} */ name) => name.trim()).filter(Boolean).map(whole)),
  });
}

/**
 * What all joints with a role are called first, such as `mixamorig:`: it says nothing and is left out.
 * @param {SideName} side
 */
function prefixOf(side) {
  const names = (state.proposal?.roles ?? []).flatMap((of) => asList(of[side]));
  const prefix = names[0]?.match(/^[^:]+:/)?.[0] ?? "";
  return names.every((name) => name.startsWith(prefix)) ? prefix : "";
}

/**
 * Says which joints a role is, whatever the service thinks.
 * @param {SideName} side
 * @param {string} role
 * @param {string[]} joints
 */
function assign(side, role, joints) {
  edit((config) => {
    config[side] = { ...config[side] };
    config[side].roles = { ...config[side].roles, [role]: joints.length === 1 ? joints[0] : joints };
  });
}

/**
 * Why the service thinks so, and what else it could be.
 * @param {RolePair} pair
 */
function details(pair) {
  const of = (/** @type {SideName} */ side) => {
    const found = side === "source" ? pair.source_details : pair.target_details;
    const other = (found?.alternatives ?? []).slice(0, 4).map(({ joint, confidence }) => el("button", { type: "button", class: "chip", title: `${Math.round((confidence ?? 0) * 100)} % sure`, onclick: () => assign(side, pair.role, [joint]) }, joint));
    const picked = side === "source" ? state.sourceJoint : state.joint;
    const take = picked && !asList(pair[side]).includes(picked) && el("button", { type: "button", class: "chip take", onclick: () => assign(side, pair.role, [picked]) }, `use ${picked}`);
    const reasons = found?.reasons?.length ? `${found.reasons.join(", ")}.` : pair[side] ? "" : "nothing here has this role.";
    return el("p", {}, el("b", {}, side === "source" ? "Clip: " : "Character: "), reasons, other.length ? " It could also be " : "", ...other, take);
  };
  return el("div", { class: "details" }, of("source"), of("target"));
}

/**
 * Why the selected joint is turned as it is at the frame that is shown.
 * @param {HTMLElement} place
 */
function explain(place) {
  if (!state.joint || !state.motion) return place.replaceChildren();
  const { joint } = state;
  const ask = el("button", { type: "button", onclick: async () => {
    const { frame } = state;
    try {
      const found = await getJson(`/v1/explanations?frame=${frame}&joint=${encodeURIComponent(joint)}`, { json: pair() });
      place.replaceChildren(ask, explanation(joint, frame, found));
    } catch (error) {
      showProblem(error);
    }
  } }, "Why is it turned so?");
  const driven = state.proposal?.joints.find((of) => of.joint === joint);
  place.replaceChildren(el("h3", {}, joint), driven ? el("p", {}, driven.driver ? `Driven by ${words(driven.driver)}${driven.reason ? `: ${driven.reason}` : ""}.` : `Not driven: ${driven.reason ?? ""}.`) : "", ask);
}

/**
 * @param {string} joint
 * @param {number} frame
 * @param {any} found
 */
function explanation(joint, frame, found) {
  const follows = (found.sources ?? []).map((/** @type {any} */ source) => `${source.joint} (${Math.round(source.share * 100)} %)`);
  const matters = (found.contributions ?? []).filter((/** @type {any} */ step) => step.degrees > 0.05 || (step.moved_meters ?? 0) > 5e-4);
  const steps = matters.map((/** @type {any} */ { name, about, degrees, moved_meters: moved }) => el("li", {}, el("b", {}, words(name)), ` turns it by ${short(degrees)}°`, moved > 5e-4 ? ` and moves it by ${short(moved * 100)} cm` : "", `: ${about}`));
  return el("div", {}, el("p", {}, `${joint} at frame ${frame}${follows.length ? ` follows ${follows.join(", ")}` : ""}. From its rest pose:`), el("ol", {}, ...steps));
}

// What was measured, at the place where it is: a click on a value goes to its frame, its joint and a view of it.

import { getJson } from "../api/client.js";
import { showProblem } from "../api/problem.js";
import { el, measured, short, words } from "../dom.js";
import { set, state, watch } from "../state.js";
import { plot } from "./plot.js";

/** @typedef {import("../api/types.js").Metric} Metric */
/** @typedef {import("../api/types.js").Worst} Worst */

const ORDER = ["fail", "warn", "pass", "not_applicable"];
/** @type {Record<string, string>} */
export const VERDICTS = { pass: "passes", warn: "worth a look", fail: "visibly wrong", not_applicable: "not measured" };

/**
 * @param {HTMLElement} panel
 * @param {(worst: Worst) => void} onPlace
 */
export function reportPanel(panel, onPlace) {
  const head = el("div", { class: "verdict-head" });
  const versus = el("div", { class: "versus" });
  const table = el("table", { class: "metrics" });
  const plots = el("div", { class: "plots" });
  const warnings = el("ul", { class: "warnings" });
  const about = el("p", { class: "about" });
  panel.append(head, about, versus, table, el("h3", {}, "Over time"), plots, el("h3", {}, "Warnings"), warnings);
  /** @type {Record<string, any>|null} */
  let comparison = null;
  const draw = () => {
    const measures = state.report?.measures;
    const worst = Object.values(measures?.metrics ?? {}).find(({ verdict }) => verdict === measures?.verdict && verdict !== "pass");
    about.textContent = worst && measures ? `${VERDICTS[measures.verdict][0].toUpperCase()}${VERDICTS[measures.verdict].slice(1)}: ${worst.about}.` : "";
    head.replaceChildren(...(measures
      ? [el("span", { class: `badge ${measures.verdict}` }, words(measures.verdict)), el("span", {}, measures.verdict === "pass" ? "Every measure is within its limits." : measures.verdict_reason)]
      : [el("p", { class: "empty" }, "There is no result yet.")]));
    versus.replaceChildren(...versusTools(comparison));
    const metrics = Object.entries(measures?.metrics ?? {}).sort(([, one], [, other]) => ORDER.indexOf(one.verdict) - ORDER.indexOf(other.verdict));
    table.replaceChildren(...(metrics.length ? [heading(comparison !== null), ...metrics.map(([name, metric]) => row(name, metric, comparison, onPlace))] : []));
    plots.replaceChildren(...Object.entries(measures?.curves ?? {}).map(([name, curve]) => plot(name, curve, measures?.metrics[name], (seconds) => onPlace({ frame: -1, time_seconds: seconds, joint: "", part: "", value: 0 }))));
    const found = state.report?.warnings ?? [];
    warnings.replaceChildren(...(found.length ? found.map(({ code, place, detail, hint }) => el("li", {}, el("b", {}, words(code)), place ? ` (${place})` : "", `: ${detail}.`, hint ? el("span", { class: "hint" }, ` ${hint}.`) : "")) : [el("li", { class: "empty" }, "None.")]));
  };
  const compare = async () => {
    comparison = null;
    if (state.pinned && state.result && state.pinned.result !== state.result) {
      try {
        comparison = await getJson("/v1/comparisons", { json: { first: { result: state.pinned.result }, second: { result: state.result } } });
      } catch (error) {
        showProblem(error);
      }
    }
    draw();
  };
  watch(["report", "showsPinned"], draw);
  watch(["pinned", "result"], () => void compare());
  draw();
}

/** Pins the latest result, to be compared with the next. */
export function pin() {
  const { motion, report, result, resultConfig: config } = state;
  if (motion && report && result && config) set({ pinned: { motion, report, result, config: structuredClone(config) }, showsPinned: false });
}

/** @param {Record<string, any>|null} comparison */
function versusTools(comparison) {
  const tools = [el("button", { type: "button", ".disabled": !state.result, onclick: pin, title: "Keeps this result as A; what comes next is B" }, state.pinned ? "Pin this one as A" : "Pin as A")];
  if (!state.pinned) return tools;
  tools.push(
    el("button", { type: "button", "aria-pressed": String(state.showsPinned), onclick: () => set({ showsPinned: !state.showsPinned }), title: "Tab" }, state.showsPinned ? "Showing A" : "Showing B"),
    el("button", { type: "button", onclick: () => set({ pinned: null, showsPinned: false }) }, "Unpin"));
  const text = comparison === null ? "Change something, and the differences are here." : comparison.better === "neither" ? "A and B are as good as one another." : `${comparison.better === "first" ? "A" : "B"} is better.`;
  return [...tools, el("p", { class: "outcome" }, text)];
}

/** @param {boolean} isCompared */
function heading(isCompared) {
  const names = isCompared ? ["Measure", "A", "B", "Change"] : ["Measure", "Value", "Limit"];
  return el("thead", {}, el("tr", {}, ...names.map((name) => el("th", { scope: "col" }, name))));
}

/**
 * @param {string} name
 * @param {Metric} metric
 * @param {Record<string, any>|null} comparison
 * @param {(worst: Worst) => void} onPlace
 */
function row(name, metric, comparison, onPlace) {
  const worst = metric.worst?.[0];
  const title = metric.reason ? `${metric.about}. ${metric.reason}.` : metric.about;
  const label = worst
    ? el("button", { type: "button", class: "link", title: `${title} Worst at frame ${worst.frame}, ${worst.joint}.`, onclick: () => onPlace(worst) }, words(name))
    : el("span", { title }, words(name));
  const head = el("th", { scope: "row" }, el("span", { class: `dot ${metric.verdict}`, role: "img", "aria-label": VERDICTS[metric.verdict] ?? metric.verdict }), label);
  const other = comparison?.metrics.find((/** @type {any} */ of) => of.name === name);
  if (other) {
    const better = other.better === "second" ? "better" : other.better === "first" ? "worse" : "";
    const change = other.difference === null || other.difference === undefined ? "–" : `${other.difference > 0 ? "+" : ""}${measured(other.difference, other.unit)}`;
    return el("tr", { class: metric.verdict }, head, el("td", {}, measured(other.first, other.unit)), el("td", { class: "now" }, measured(other.second, other.unit)), el("td", { class: better }, change, better ? ` ${better}` : ""));
  }
  return el("tr", { class: metric.verdict }, head, el("td", { class: "now" }, measured(metric.value, metric.unit)), el("td", { class: "limit" }, metric.value === undefined ? "" : `≤ ${measured(metric.warn_above, metric.unit)}`));
}

// How good a moving drawing is, in words and numbers.

import { el, short, words } from "../dom.js";

/** @typedef {{value: number, pass_up_to: number, fail_above: number}} Measured */

/** @param {Measured} of */
function verdictOf({ value, pass_up_to: pass, fail_above: fail }) {
  return value <= pass ? "pass" : value <= fail ? "warn" : "fail";
}

/** Units are the ends of the names. @param {string} name */
function unitOf(name) {
  const found = name.match(/_(degrees_per_second|percent_per_second|per_second|degrees|percent)$/);
  const unit = /** @type {Record<string, string>} */ ({ degrees_per_second: "°/s", percent_per_second: " %/s", per_second: "/s", degrees: "°", percent: " %" })[found?.[1] ?? ""] ?? "";
  return { text: words(found ? name.slice(0, -found[0].length) : name), unit };
}

/**
 * @param {any} report
 * @returns {Node[]}
 */
export function reportOf(report) {
  const of = report?.drawing;
  if (!of) return [];
  const [character] = of.characters ?? [];
  const measures = Object.entries(character?.measures ?? {}).filter(([, value]) => value && typeof value === "object");
  const rows = measures.map(([name, value]) => {
    const measured = /** @type {Measured} */ (value);
    const verdict = verdictOf(measured);
    const { text, unit } = unitOf(name);
    return el("tr", { class: verdict }, el("th", { scope: "row" }, el("span", { class: `dot ${verdict}`, role: "img", "aria-label": verdict }), text), el("td", { class: "now" }, `${short(measured.value)}${unit}`), el("td", { class: "limit" }, `≤ ${short(measured.pass_up_to)}${unit}`));
  });
  const reason = of.verdict === "pass" ? "Every measure is within its limits." : of.verdict_reason;
  return [
    el("div", { class: "verdict-head" }, el("span", { class: `badge ${of.verdict}` }, words(of.verdict)), el("span", {}, reason)),
    el("table", { class: "metrics" }, el("thead", {}, el("tr", {}, ...["Measure", "Value", "Limit"].map((name) => el("th", { scope: "col" }, name)))), el("tbody", {}, ...rows)),
  ];
}

// What went wrong, in the words of the service: what, where, and what to do about it.

import { byId, el } from "../dom.js";
import { Refused } from "./client.js";

/**
 * @param {unknown} error
 * @param {string} [about] the file that it is about
 */
export function showProblem(error, about) {
  const place = byId("problem");
  const problem = error instanceof Refused ? error.problem : null;
  const text = problem?.detail || (error instanceof Error ? error.message : String(error));
  const errors = problem?.errors ?? [];
  place.replaceChildren(
    el("button", { type: "button", class: "icon", "aria-label": "Close", onclick: hideProblem }, "×"),
    el("strong", {}, `${about ? `${about}: ` : ""}${problem?.title ?? "something went wrong"}`),
    el("p", {}, text),
    errors.some(({ detail }) => detail !== text) ? el("ul", {}, ...errors.slice(0, 5).map(({ pointer, detail }) => el("li", {}, el("code", {}, pointer), ` ${detail}`))) : "",
    problem?.hint ? el("p", { class: "hint" }, problem.hint) : "",
    problem?.code ? el("a", { href: `/problems#${problem.code}`, target: "_blank", rel: "noopener" }, problem.code) : "",
  );
  place.hidden = false;
}

export function hideProblem() {
  byId("problem").hidden = true;
}

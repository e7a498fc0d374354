// Buttons of playback, and the strip that trims the clip.

import { figures } from "../api/live.js";
import { el, icon } from "../dom.js";
import { edit, state, watch } from "../state.js";
import { cycleSpeed, onPlayback, player, seekFrame, step, toggle } from "./player.js";

const SIGNS = {
  first: "M3 3h2v10H3zM13 3v10L6 8z", back: "M11 3v10L4 8z", play: "M4 2.5v11L13.500 8z", pause: "M4 3h3v10H4zM9 3h3v10H9z", on: "M5 3v10l7-5z", last: "M11 3h2v10h-2zM3 3v10l7-5z",
};

/**
 * @param {HTMLElement} bar
 * @param {import("./timeline.js").Timeline} timeline
 */
export function transport(bar, timeline) {
  const button = (/** @type {string} */ sign, /** @type {string} */ title, /** @type {() => void} */ click) => el("button", { type: "button", class: "icon", title, "aria-label": title, onclick: click }, icon(sign));
  const play = button(SIGNS.play, "Play (Space)", toggle);
  const speed = el("button", { type: "button", class: "quiet", title: "Speed (J slower, L faster)", onclick: cycleSpeed });
  const frame = el("input", { type: "number", min: 0, "aria-label": "Frame", onchange: () => seekFrame(Number(frame.value)) });
  const of = el("span", { class: "muted" });
  const curve = el("select", { "aria-label": "Curve on the time line", onchange: () => { timeline.curve = curve.value; timeline.isDirty = true; } });
  bar.append(button(SIGNS.first, "First frame (Home)", () => seekFrame(0)), button(SIGNS.back, "One frame back (←)", () => step(-1)), play, button(SIGNS.on, "One frame on (→)", () => step(1)), button(SIGNS.last, "Last frame (End)", () => seekFrame(Infinity)), speed,
    el("label", { class: "muted" }, "frame ", frame), of, el("span", { class: "grow" }), el("label", { class: "muted" }, "curve ", curve));
  const draw = () => {
    play.replaceChildren(icon(player.isPlaying ? SIGNS.pause : SIGNS.play));
    play.setAttribute("aria-label", player.isPlaying ? "Pause (Space)" : "Play (Space)");
    speed.textContent = `${player.speed}×`;
  };
  onPlayback(draw);
  watch(["frame", "motion"], () => {
    if (document.activeElement !== frame) frame.value = String(state.frame);
    of.textContent = `of ${Math.max(player.times().length - 1, 0)} · ${state.seconds.toFixed(2)} s`;
  });
  watch(["report"], () => {
    const names = Object.keys(state.report?.measures?.curves ?? {});
    if (names.length && !names.includes(timeline.curve)) timeline.curve = names[0];
    curve.replaceChildren(...names.map((name) => el("option", { value: name, ".selected": name === timeline.curve }, name.replaceAll("_", " "))));
  });
  draw();
}

/** How long the clip of the source is, as it is in its file. */
function clipSeconds() {
  const { facts } = figures.source ?? {};
  return facts?.clips.find(({ name }) => name === facts.clip)?.seconds ?? 0;
}

/**
 * A copy: what is changed in the config's own array is no change of the config.
 * @returns {[number, number]}
 */
function range() {
  const of = state.config.edit?.range;
  return Array.isArray(of) ? [of[0], of[1]] : [0, clipSeconds()];
}

/** @param {[number, number]} ends */
function setRange([from, to]) {
  const whole = clipSeconds();
  const isWhole = from <= 1e-3 && to >= whole - 1e-3;
  edit((config) => {
    config.edit = { ...config.edit };
    if (isWhole) delete config.edit.range;
    else config.edit.range = [Number(Math.max(from, 0).toFixed(3)), Number(Math.min(to, whole).toFixed(3))];
  });
}

/**
 * Makes the clip begin or end at where playback is.
 * @param {"start"|"end"} end
 */
export function trimHere(end) {
  const [from, to] = range();
  const here = Math.min(from + state.seconds * (state.config.edit?.speed ?? 1), clipSeconds());
  if (end === "start" && here < to) setRange([here, to]);
  if (end === "end" && here > from) setRange([from, here]);
}

/** @param {HTMLElement} strip */
export function trimStrip(strip) {
  const handle = (/** @type {string} */ label, /** @type {0|1} */ index) => el("input", {
    type: "range", min: 0, max: 1, step: "any", "aria-label": label, class: index ? "end" : "start", oninput: (/** @type {any} */ event) => {
      const ends = range();
      ends[index] = Number(event.target.value);
      if (ends[1] - ends[0] > 0.02) setRange(ends);
    },
  });
  const [start, end] = [handle("The clip begins here", 0), handle("The clip ends here", 1)];
  const text = el("span", { class: "muted" });
  const fill = el("div", { class: "fill" });
  strip.append(text, el("div", { class: "track" }, fill, start, end));
  const draw = () => {
    const whole = clipSeconds();
    const [from, to] = range();
    strip.hidden = !whole;
    for (const [box, value] of /** @type {[HTMLInputElement, number][]} */ ([[start, from], [end, to]])) {
      box.max = String(whole);
      box.value = String(value);
    }
    fill.style.left = `${(from / (whole || 1)) * 100}%`;
    fill.style.right = `${(1 - to / (whole || 1)) * 100}%`;
    text.textContent = `${from.toFixed(2)} – ${to.toFixed(2)} s`;
    text.title = `What is used of the ${whole.toFixed(2)} s of the clip`;
  };
  watch(["config", "source", "motion"], draw);
  draw();
}

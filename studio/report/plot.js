// A curve of the report as a small picture. A click goes to its time.

import { color, el, measured, words } from "../dom.js";

const WIDTH = 320;
const HEIGHT = 64;

/** @typedef {import("../api/types.js").Curve} Curve */
/** @typedef {import("../api/types.js").Metric} Metric */

/**
 * @param {string} name
 * @param {Curve} curve
 * @param {Metric|undefined} metric whose limit is drawn
 * @param {(seconds: number) => void} onTime
 */
export function plot(name, curve, metric, onTime) {
  const values = /** @type {number[]} */ (Object.values(curve.parts).flat().filter((value) => value !== null));
  const [least, most] = [Math.min(...values), Math.max(...values)];
  const text = values.length ? `${words(name)}: ${measured(least, curve.unit)} to ${measured(most, curve.unit)}` : `${words(name)}: nothing to show`;
  const canvas = el("canvas", { width: WIDTH * 2, height: HEIGHT * 2, role: "img", "aria-label": text });
  if (values.length) draw(canvas, curve, metric, Math.min(0, least), scaleTop(most, metric));
  canvas.addEventListener("click", (event) => {
    const last = curve.times_seconds[curve.times_seconds.length - 1] ?? 0;
    onTime((event.offsetX / canvas.clientWidth) * last);
  });
  return el("figure", {}, el("figcaption", {}, text), canvas);
}

/**
 * Where a plot ends: above all values, and above the limit where that is not far off.
 * @param {number} most
 * @param {Metric|undefined} metric
 */
export function scaleTop(most, metric) {
  const limit = metric?.warn_above ?? 0;
  return Math.max(limit <= most * 3 ? limit * 1.1 : 0, most * 1.05, 1e-6);
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Curve} curve
 * @param {Metric|undefined} metric
 * @param {number} low
 * @param {number} high
 */
function draw(canvas, curve, metric, low, high) {
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.scale(2, 2);
  const last = curve.times_seconds[curve.times_seconds.length - 1] || 1;
  const x = (/** @type {number} */ seconds) => 2 + (seconds / last) * (WIDTH - 4);
  const y = (/** @type {number} */ value) => HEIGHT - 3 - ((value - low) / (high - low)) * (HEIGHT - 6);
  if (metric && metric.warn_above <= high) {
    context.strokeStyle = color("warn");
    context.setLineDash([4, 4]);
    context.strokeRect(0, y(metric.warn_above), WIDTH, 0);
    context.setLineDash([]);
  }
  for (const [part, line] of Object.entries(curve.parts)) {
    context.strokeStyle = color(part.startsWith("left") ? "left" : part.startsWith("right") ? "right" : "middle");
    context.lineWidth = 1.25;
    context.beginPath();
    let isBegun = false;
    line.forEach((value, index) => {
      if (value === null) isBegun = false;
      else {
        if (isBegun) context.lineTo(x(curve.times_seconds[index]), y(value));
        else context.moveTo(x(curve.times_seconds[index]), y(value));
        isBegun = true;
      }
    });
    context.stroke();
  }
}

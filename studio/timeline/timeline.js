// The time line: contacts as bars, the report's curves, warnings as pins, and the playhead. It can be scrubbed and zoomed.

import { color, measured, words } from "../dom.js";
import { scaleTop } from "../report/plot.js";
import { state } from "../state.js";
import { pause, player, seek, step } from "./player.js";

const LEFT = 96;
const RULER = 20;
const ROW = 11;
const RIGHT = 12;

/** @typedef {{seconds: number, verdict: string, metric: string, worst: import("../api/types.js").Worst}} Pin */

export class Timeline {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(pin: Pin) => void} onPin
   */
  constructor(canvas, onPin) {
    this.canvas = canvas;
    this.front = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** Everything but the playhead, which alone moves while a clip plays. */
    this.back = document.createElement("canvas");
    this.context = /** @type {CanvasRenderingContext2D} */ (this.back.getContext("2d"));
    this.onPin = onPin;
    this.curve = "limb_direction";
    /** The part that is shown, as shares of the whole. */
    this.from = 0;
    this.to = 1;
    /** @type {Pin[]} */
    this.pins = [];
    this.isDirty = true;
    this.hasMoved = true;
    new ResizeObserver(() => { this.isDirty = true; }).observe(canvas);
    this.listen();
  }

  listen() {
    const { canvas } = this;
    let isScrubbing = false;
    const scrub = (/** @type {PointerEvent} */ event) => seek(this.secondsAt(event.offsetX));
    canvas.addEventListener("pointerdown", (event) => {
      const pin = event.offsetY < RULER ? this.pins.find(({ seconds }) => Math.abs(this.x(seconds) - event.offsetX) < 6) : undefined;
      if (pin) return this.onPin(pin);
      isScrubbing = true;
      pause();
      canvas.setPointerCapture(event.pointerId);
      scrub(event);
    });
    canvas.addEventListener("pointermove", (event) => { if (isScrubbing) scrub(event); });
    canvas.addEventListener("pointerup", () => { isScrubbing = false; });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.25 : 0.8, this.shareAt(event.offsetX));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.zoom(Infinity, 0.5));
    canvas.addEventListener("keydown", (event) => {
      const move = /** @type {Record<string, number>} */ ({ PageUp: -10, PageDown: 10 })[event.key];
      if (move) step(move);
      else if (event.key === "+") this.zoom(0.8, state.seconds / (player.duration() || 1));
      else if (event.key === "-") this.zoom(1.25, state.seconds / (player.duration() || 1));
      else return;
      event.preventDefault();
    });
  }

  /**
   * @param {number} factor
   * @param {number} about
   */
  zoom(factor, about) {
    const span = Math.min(Math.max((this.to - this.from) * factor, 0.02), 1);
    const share = (about - this.from) / (this.to - this.from);
    this.from = Math.min(Math.max(about - span * share, 0), 1 - span);
    this.to = this.from + span;
    this.isDirty = true;
  }

  /** @param {number} x */
  shareAt(x) {
    return this.from + ((x - LEFT) / (this.canvas.clientWidth - LEFT - RIGHT)) * (this.to - this.from);
  }

  /** @param {number} x */
  secondsAt(x) {
    return this.shareAt(x) * player.duration();
  }

  /** @param {number} seconds */
  x(seconds) {
    const share = seconds / (player.duration() || 1);
    return LEFT + ((share - this.from) / (this.to - this.from)) * (this.canvas.clientWidth - LEFT - RIGHT);
  }

  /** Takes what the report says. */
  take() {
    this.pins = [];
    for (const [metric, { verdict, worst }] of Object.entries(state.report?.measures?.metrics ?? {})) {
      if (verdict !== "warn" && verdict !== "fail") continue;
      for (const place of worst ?? []) this.pins.push({ seconds: place.time_seconds, verdict, metric, worst: place });
    }
    this.isDirty = true;
  }

  draw() {
    const { canvas, back, front } = this;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    for (const of of [canvas, back]) if (of.width !== wide || of.height !== high) Object.assign(of, { width: wide, height: high });
    if (this.isDirty) this.drawBack(ratio, width, height);
    front.setTransform(1, 0, 0, 1, 0, 0);
    front.clearRect(0, 0, wide, high);
    front.drawImage(back, 0, 0);
    front.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawHead(height);
    this.describe();
    this.isDirty = false;
    this.hasMoved = false;
  }

  /**
   * @param {number} ratio
   * @param {number} width
   * @param {number} height
   */
  drawBack(ratio, width, height) {
    const { context } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = "11px system-ui, sans-serif";
    this.drawRuler(width, height);
    const below = this.drawContacts(width);
    this.drawCurve(below + 4, width, height);
    this.drawPins();
  }

  /** For who does not see it. */
  describe() {
    const frames = player.times().length;
    this.canvas.setAttribute("aria-valuemax", String(frames - 1));
    this.canvas.setAttribute("aria-valuenow", String(state.frame));
    this.canvas.setAttribute("aria-valuetext", `frame ${state.frame} of ${frames - 1}, ${state.seconds.toFixed(2)} seconds`);
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  drawRuler(width, height) {
    const { context } = this;
    const duration = player.duration();
    context.fillStyle = color("muted");
    context.strokeStyle = color("line");
    if (!duration) {
      context.fillText("There is no result yet.", LEFT, 15);
      return;
    }
    const span = duration * (this.to - this.from);
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 120, 300].find((seconds) => (seconds / span) * (width - LEFT) > 60) ?? 600;
    context.lineWidth = 1;
    context.beginPath();
    for (let seconds = Math.ceil((this.from * duration) / step) * step; seconds <= this.to * duration + 1e-9; seconds += step) {
      const x = Math.round(this.x(seconds)) + 0.5;
      context.moveTo(x, RULER - 4);
      context.lineTo(x, height);
      context.fillText(`${Number(seconds.toFixed(2))} s`, x + 3, 12);
    }
    context.stroke();
  }

  /** @param {number} width */
  drawContacts(width) {
    const { context } = this;
    let y = RULER + 2;
    for (const { point, seconds } of (state.report?.contacts ?? []).slice(0, 8)) {
      context.fillStyle = color("muted");
      context.fillText(words(point), 8, y + 9);
      context.fillStyle = color(point.startsWith("left") ? "left" : "right");
      for (const [from, to] of seconds) {
        const [left, right] = [Math.max(this.x(from), LEFT), Math.min(this.x(to), width - RIGHT)];
        if (right >= left) context.fillRect(left, y + 2, Math.max(right - left, 2), ROW - 4);
      }
      y += ROW;
    }
    return y;
  }

  /**
   * @param {number} top
   * @param {number} width
   * @param {number} height
   */
  drawCurve(top, width, height) {
    const { context } = this;
    const curve = state.report?.measures?.curves?.[this.curve];
    const room = height - top - 6;
    if (!curve || room < 16) return;
    const values = Object.values(curve.parts).flat().filter((value) => value !== null);
    const metric = state.report?.measures?.metrics?.[this.curve];
    const low = Math.min(0, .../** @type {number[]} */ (values));
    const most = Math.max(scaleTop(Math.max(.../** @type {number[]} */ (values), 0), metric), low + 1e-6);
    const y = (/** @type {number} */ value) => top + room - ((value - low) / (most - low)) * room;
    context.fillStyle = color("muted");
    context.fillText(words(this.curve), 8, top + 10);
    context.fillText(`up to ${measured(most, curve.unit)}`, 8, top + 23);
    if (metric && metric.warn_above <= most) {
      context.strokeStyle = color("warn");
      context.setLineDash([4, 4]);
      context.beginPath();
      context.moveTo(LEFT, y(metric.warn_above));
      context.lineTo(width - RIGHT, y(metric.warn_above));
      context.stroke();
      context.setLineDash([]);
    }
    context.save();
    context.beginPath();
    context.rect(LEFT, top, width - LEFT - RIGHT, room + 2);
    context.clip();
    for (const [part, line] of Object.entries(curve.parts)) {
      context.strokeStyle = color(part.startsWith("left") ? "left" : part.startsWith("right") ? "right" : "middle");
      context.beginPath();
      let isBegun = false;
      line.forEach((value, index) => {
        if (value === null) isBegun = false;
        else {
          const [px, py] = [this.x(curve.times_seconds[index]), y(value)];
          if (isBegun) context.lineTo(px, py);
          else context.moveTo(px, py);
          isBegun = true;
        }
      });
      context.lineWidth = 1.25;
      context.stroke();
    }
    context.restore();
  }

  drawPins() {
    const { context } = this;
    for (const { seconds, verdict } of this.pins) {
      const x = this.x(seconds);
      if (x < LEFT - 1) continue;
      context.fillStyle = color(verdict);
      context.beginPath();
      context.moveTo(x - 4.5, 2);
      context.lineTo(x + 4.5, 2);
      context.lineTo(x + 4.5, 9);
      context.lineTo(x, 15);
      context.lineTo(x - 4.5, 9);
      context.fill();
    }
  }

  /** @param {number} height */
  drawHead(height) {
    if (!player.duration()) return;
    const { front: context } = this;
    const x = Math.round(this.x(state.seconds)) + 0.5;
    context.strokeStyle = color("accent");
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, 0);
    context.lineTo(x, height);
    context.stroke();
  }
}

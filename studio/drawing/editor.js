// The drawing itself: its joints are dragged and its mask is painted, by mouse, pen, finger or keys.

import { color } from "../dom.js";
import { surface } from "./character.js";
import { paint, veilOf } from "./mask.js";

/** @typedef {import("./character.js").Drawing} Drawing */
/** @typedef {"joints"|"paint"|"erase"} Tool */

/** How near a joint is grabbed, in pixels of the screen. */
const GRAB = 16;
const MARGIN = 14;
/** Below this a joint was guessed rather than found. */
export const UNSURE = 0.5;

export class Editor {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{begin: () => void, change: () => void, select: () => void}} on `begin` before something is changed, `change` after it
   */
  constructor(canvas, on) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    this.on = on;
    /** @type {Drawing|null} */
    this.drawing = null;
    /** What is outside of the mask, as a veil over the picture. */
    this.veil = surface(1, 1);
    /** @type {Tool} */
    this.tool = "joints";
    this.radius = 10;
    this.selected = "";
    /** Where the brush is, in pixels of the drawing. @type {[number, number]|null} */
    this.brush = null;
    this.zoom = 1;
    /** What of the drawing is in the middle. */
    this.middle = [0, 0];
    this.isHeld = false;
    new ResizeObserver(() => this.draw()).observe(canvas);
    this.listen();
  }

  /** @param {Drawing} drawing */
  show(drawing) {
    const isOther = this.drawing?.width !== drawing.width || this.drawing.height !== drawing.height;
    this.drawing = drawing;
    if (isOther) this.fit();
    this.takeMask();
    this.draw();
  }

  fit() {
    this.zoom = 1;
    if (this.drawing) this.middle = [this.drawing.width / 2, this.drawing.height / 2];
    this.draw();
  }

  /** Pixels of the screen for each of the drawing. */
  get scale() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!this.drawing || !clientWidth) return 1;
    return Math.min((clientWidth - 2 * MARGIN) / this.drawing.width, (clientHeight - 2 * MARGIN) / this.drawing.height) * this.zoom;
  }

  /** @param {number[]} place in pixels of the drawing @returns {[number, number]} on the canvas */
  onCanvas([x, y]) {
    const { scale, middle, canvas } = this;
    return [canvas.clientWidth / 2 + (x - middle[0]) * scale, canvas.clientHeight / 2 + (y - middle[1]) * scale];
  }

  /** @param {{offsetX: number, offsetY: number}} event @returns {[number, number]} in pixels of the drawing */
  placeOf({ offsetX, offsetY }) {
    const { scale, middle, canvas } = this;
    return [middle[0] + (offsetX - canvas.clientWidth / 2) / scale, middle[1] + (offsetY - canvas.clientHeight / 2) / scale];
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.drawing || event.button !== 0) return;
      const place = this.placeOf(event);
      if (this.tool === "joints" && !this.pick(event)) return;
      canvas.setPointerCapture(event.pointerId);
      this.isHeld = true;
      this.on.begin();
      this.brush = place;
      if (this.tool !== "joints") this.stroke(place, place);
      this.draw();
    });
    canvas.addEventListener("pointermove", (event) => {
      const place = this.placeOf(event);
      if (this.isHeld && this.tool === "joints") this.place(place);
      else if (this.isHeld) this.stroke(this.brush ?? place, place);
      this.brush = place;
      this.draw();
    });
    canvas.addEventListener("pointerup", () => {
      if (this.isHeld) this.on.change();
      this.isHeld = false;
    });
    canvas.addEventListener("pointerleave", () => {
      if (!this.isHeld) this.brush = null;
      this.draw();
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomAt(event.deltaY > 0 ? 0.85 : 1.18, this.placeOf(event));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.press(event)) return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  /** @param {KeyboardEvent} event @returns {boolean} whether the key does something here */
  press({ key, shiftKey }) {
    const { drawing } = this;
    if (!drawing) return false;
    const move = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] })[key];
    if (move && this.tool === "joints") this.nudge(move, shiftKey ? 10 : 1);
    else if (move) this.moveBrush(move, shiftKey ? this.radius * 4 : this.radius / 2);
    else if (key === " " && this.tool !== "joints" && this.brush) {
      this.on.begin();
      this.stroke(this.brush, this.brush);
      this.on.change();
    } else if (key.toLowerCase() === "n") this.next(shiftKey ? -1 : 1);
    else if (key === "+" || key === "-") this.zoomAt(key === "+" ? 1.25 : 0.8, this.middle);
    else if (key === "0") this.fit();
    else return false;
    this.draw();
    return true;
  }

  /** @param {number} factor @param {number[]} about stays where it is */
  zoomAt(factor, about) {
    const zoom = Math.min(Math.max(this.zoom * factor, 1), 12);
    const share = this.zoom / zoom;
    this.middle = this.middle.map((of, axis) => about[axis] + (of - about[axis]) * share);
    this.zoom = zoom;
    this.draw();
  }

  /** @param {number} by */
  next(by) {
    const joints = this.drawing?.joints ?? [];
    const at = joints.findIndex(({ name }) => name === this.selected);
    this.select(joints[(at + by + joints.length) % joints.length]?.name ?? "");
  }

  /** @param {string} name */
  select(name) {
    this.selected = name;
    this.on.select();
    this.draw();
  }

  /** Selects the joint at a place of the canvas. @param {{offsetX: number, offsetY: number}} event */
  pick({ offsetX, offsetY }) {
    let nearest = { name: "", distance: GRAB };
    for (const { name, loc } of this.drawing?.joints ?? []) {
      const [x, y] = this.onCanvas(loc);
      const distance = Math.hypot(x - offsetX, y - offsetY);
      if (distance < nearest.distance) nearest = { name, distance };
    }
    this.select(nearest.name);
    return nearest.name !== "";
  }

  /** @param {[number, number]} way @param {number} pixels */
  nudge(way, pixels) {
    const joint = this.drawing?.joints.find(({ name }) => name === this.selected);
    if (!joint) return;
    this.on.begin();
    this.place([joint.loc[0] + way[0] * pixels, joint.loc[1] + way[1] * pixels]);
    this.on.change();
  }

  /** Puts the selected joint there, and what lies on the same place and belongs to it, as hip and root do. @param {number[]} place */
  place([x, y]) {
    const { drawing, selected } = this;
    const joint = drawing?.joints.find(({ name }) => name === selected);
    if (!drawing || !joint) return;
    const [left, top] = joint.loc;
    /** @type {[number, number]} */
    const loc = [Math.round(Math.min(Math.max(x, 0), drawing.width - 1)), Math.round(Math.min(Math.max(y, 0), drawing.height - 1))];
    for (const other of drawing.joints) {
      const isSame = other.loc[0] === left && other.loc[1] === top && (other.parent === selected || joint.parent === other.name);
      if (other === joint || isSame) other.loc = loc;
    }
    // A hand has been there.
    delete drawing.sureness[selected];
  }

  /** @param {[number, number]} way @param {number} pixels */
  moveBrush(way, pixels) {
    const { drawing } = this;
    if (!drawing) return;
    const [x, y] = this.brush ?? [drawing.width / 2, drawing.height / 2];
    this.brush = [Math.min(Math.max(x + way[0] * pixels, 0), drawing.width), Math.min(Math.max(y + way[1] * pixels, 0), drawing.height)];
  }

  /** Paints or erases from one place to another. @param {number[]} from @param {number[]} to */
  stroke(from, to) {
    if (this.drawing) this.takeMask(paint(this.drawing, from, to, this.radius, this.tool === "paint" ? 255 : 0));
  }

  /** Makes the veil that of the mask. @param {[number, number, number, number]} [box] what has changed */
  takeMask(box) {
    const { drawing } = this;
    if (!drawing) return;
    veilOf(drawing, this.veil, box);
  }

  draw() {
    const { canvas, context, drawing, scale } = this;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    if (!drawing) return;
    const [left, top] = this.onCanvas([0, 0]);
    context.fillStyle = "#fff";
    context.fillRect(left, top, drawing.width * scale, drawing.height * scale);
    context.drawImage(drawing.picture, left, top, drawing.width * scale, drawing.height * scale);
    context.drawImage(this.veil.canvas, left, top, drawing.width * scale, drawing.height * scale);
    if (this.tool === "joints") this.drawJoints(drawing);
    else this.drawBrush();
  }

  /** @param {Drawing} drawing */
  drawJoints({ joints, sureness }) {
    const { context } = this;
    const colorOf = (/** @type {string} */ name) => color(name.startsWith("left") ? "left" : name.startsWith("right") ? "right" : "middle");
    const places = new Map(joints.map(({ name, loc }) => [name, this.onCanvas(loc)]));
    for (const pass of [{ wide: 5, tint: () => "rgba(255,255,255,0.85)" }, { wide: 2.5, tint: colorOf }]) {
      for (const { name, parent } of joints) {
        const [from, to] = [places.get(parent ?? ""), places.get(name)];
        if (!from || !to) continue;
        context.beginPath();
        context.moveTo(from[0], from[1]);
        context.lineTo(to[0], to[1]);
        Object.assign(context, { lineWidth: pass.wide, lineCap: "round", strokeStyle: pass.tint(name) });
        context.stroke();
      }
    }
    for (const { name } of joints) {
      const [x, y] = places.get(name) ?? [0, 0];
      const isSelected = name === this.selected;
      context.beginPath();
      context.arc(x, y, isSelected ? 8 : 5.5, 0, 2 * Math.PI);
      context.fillStyle = (sureness[name] ?? 1) < UNSURE ? "#f2c230" : colorOf(name);
      context.fill();
      Object.assign(context, { lineWidth: 2, strokeStyle: isSelected ? color("accent") : "#fff" });
      context.stroke();
    }
    const at = places.get(this.selected);
    if (at) this.drawLabel(at, this.selected.replaceAll("_", " "));
  }

  /** @param {number[]} place @param {string} text */
  drawLabel([x, y], text) {
    const { context } = this;
    context.font = "600 12px system-ui, sans-serif";
    const width = context.measureText(text).width + 12;
    const left = x + 12 + width > this.canvas.clientWidth ? x - 12 - width : x + 12;
    context.fillStyle = color("accent");
    context.beginPath();
    context.roundRect(left, y - 10, width, 20, 4);
    context.fill();
    context.fillStyle = color("on-accent");
    context.fillText(text, left + 6, y + 4);
  }

  drawBrush() {
    if (!this.brush) return;
    const { context, tool } = this;
    const [x, y] = this.onCanvas(this.brush);
    for (const [wide, tint] of /** @type {const} */ ([[4, "#fff"], [2, color(tool === "paint" ? "pass" : "fail")]])) {
      context.beginPath();
      context.arc(x, y, Math.max(this.radius * this.scale, 2), 0, 2 * Math.PI);
      Object.assign(context, { lineWidth: wide, strokeStyle: tint });
      context.stroke();
    }
  }
}

// What is drawn over the figures: bones, the selected joint, contacts, and the ways of hands, feet and pelvis.

import { Vector3 } from "../vendor/three.js";
import { color } from "../dom.js";

/** @typedef {import("./figure.js").Figure} Figure */
/** @typedef {import("./stage.js").Stage} Stage */
/** @typedef {import("./stage.js").Port} Port */
/** @typedef {{point: string, seconds: [number, number][]}} Contact */

const TRAILED = ["pelvis", "left_hand", "right_hand", "left_foot", "right_foot"];
const SAMPLES = 160;

/**
 * Bones as pairs of nodes, and which side of the body each is on.
 * @param {Figure} figure
 * @returns {{from: number, to: number, side: "left"|"right"|"middle"}[]}
 */
export function bonesOf(figure) {
  const roleOf = new Map();
  for (const [role, nodes] of Object.entries(figure.facts.roles)) {
    if (role !== "root") for (const node of nodes) roleOf.set(node, role);
  }
  const indexOf = new Map(figure.nodes.map((node, index) => [node, index]));
  /** @type {Map<number, "left"|"right"|"middle">} */
  const drawn = new Map();
  const bones = [];
  for (const [index, node] of figure.nodes.entries()) {
    const parent = indexOf.get(/** @type {any} */ (node.parent));
    const above = parent === undefined ? undefined : drawn.get(parent);
    const role = roleOf.get(index);
    if (roleOf.size && above === undefined && role === undefined) continue;
    const side = role?.startsWith("left_") ? "left" : role?.startsWith("right_") ? "right" : role ? "middle" : above ?? "middle";
    drawn.set(index, side);
    if (parent !== undefined && above !== undefined) bones.push({ from: parent, to: index, side });
  }
  return bones;
}

/**
 * The ways of some joints over a clip, in the figure's own space.
 * @param {Figure} figure
 * @returns {{role: string, places: Vector3[]}[]}
 */
export function trailsOf(figure) {
  if (!figure.duration) return [];
  const trails = TRAILED.map((role) => ({ role, joint: figure.joint(role), places: /** @type {Vector3[]} */ ([]) }));
  for (let sample = 0; sample <= SAMPLES; sample += 1) {
    figure.at((sample / SAMPLES) * figure.duration);
    figure.group.updateMatrixWorld(true);
    for (const trail of trails) {
      if (trail.joint) trail.places.push(figure.group.worldToLocal(trail.joint.getWorldPosition(new Vector3())));
    }
  }
  return trails;
}

export class Marks {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    this.bones = true;
    this.contacts = true;
    this.trails = false;
    /** @type {Map<Figure, ReturnType<typeof bonesOf>>} */
    this.known = new Map();
    /** @type {Map<Figure, ReturnType<typeof trailsOf>>} */
    this.ways = new Map();
  }

  /** Forgets what was found of figures that are gone or move otherwise. */
  forget() {
    this.known.clear();
    this.ways.clear();
  }

  /**
   * @param {Stage} stage
   * @param {{seconds: number, contacts: Contact[], selected: Record<"source"|"target", string>, onlyBones: boolean}} shown
   */
  draw(stage, shown) {
    const { context, canvas } = this;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const [width, height] = [Math.round(stage.width * ratio), Math.round(stage.height * ratio)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, stage.width, stage.height);
    for (const port of stage.ports()) {
      const { figure } = port.side;
      if (!figure) continue;
      context.save();
      context.beginPath();
      context.rect(port.clipLeft, 0, port.clipRight - port.clipLeft, port.height);
      context.clip();
      if (this.trails) this.drawTrails(stage, port, figure);
      if (this.bones || shown.onlyBones) this.drawBones(stage, port, figure, shown.onlyBones);
      if (this.contacts) this.drawContacts(stage, port, figure, shown);
      this.drawSelected(stage, port, figure, shown.selected[port.name]);
      context.restore();
    }
  }

  /**
   * @param {Stage} stage
   * @param {Port} port
   * @param {Figure} figure
   * @param {boolean} isStrong
   */
  drawBones(stage, port, figure, isStrong) {
    const { context } = this;
    const bones = this.known.get(figure) ?? bonesOf(figure);
    this.known.set(figure, bones);
    const place = new Vector3();
    const points = new Map();
    const at = (/** @type {number} */ index) => {
      if (!points.has(index)) points.set(index, stage.project(place.setFromMatrixPosition(figure.nodes[index].matrixWorld), port));
      return points.get(index);
    };
    context.lineCap = "round";
    context.globalAlpha = isStrong ? 1 : 0.85;
    for (const side of /** @type {const} */ (["middle", "left", "right"])) {
      context.beginPath();
      for (const bone of bones) {
        if (bone.side !== side) continue;
        const [from, to] = [at(bone.from), at(bone.to)];
        if (!from || !to) continue;
        context.moveTo(from[0], from[1]);
        context.lineTo(to[0], to[1]);
      }
      context.lineWidth = isStrong ? 2.5 : 1.5;
      context.strokeStyle = color(side);
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  /**
   * @param {Stage} stage
   * @param {Port} port
   * @param {Figure} figure
   */
  drawTrails(stage, port, figure) {
    const { context } = this;
    const trails = this.ways.get(figure) ?? trailsOf(figure);
    this.ways.set(figure, trails);
    for (const { role, places } of trails) {
      context.beginPath();
      let isBegun = false;
      for (const place of places) {
        const at = stage.project(figure.group.localToWorld(place.clone()), port);
        if (at && isBegun) context.lineTo(at[0], at[1]);
        else if (at) context.moveTo(at[0], at[1]);
        isBegun = at !== null;
      }
      context.lineWidth = 1.5;
      context.globalAlpha = 0.7;
      context.strokeStyle = color(role.startsWith("left") ? "left" : role.startsWith("right") ? "right" : "middle");
      context.stroke();
      context.globalAlpha = 1;
    }
  }

  /**
   * @param {Stage} stage
   * @param {Port} port
   * @param {Figure} figure
   * @param {{seconds: number, contacts: Contact[]}} shown
   */
  drawContacts(stage, port, figure, { seconds, contacts }) {
    const { context } = this;
    const place = new Vector3();
    for (const { point, seconds: spans } of contacts) {
      if (!spans.some(([from, to]) => seconds >= from - 1e-3 && seconds <= to + 1e-3)) continue;
      const joint = figure.joint(point) ?? figure.joint(point.replace(/_(tip|heel|ball)$/, ""));
      if (!joint) continue;
      place.setFromMatrixPosition(joint.matrixWorld).setY(0);
      const at = stage.project(place, port);
      if (!at) continue;
      context.beginPath();
      context.ellipse(at[0], at[1], 11, 5, 0, 0, Math.PI * 2);
      context.lineWidth = 2;
      context.strokeStyle = color("contact");
      context.stroke();
    }
  }

  /**
   * @param {Stage} stage
   * @param {Port} port
   * @param {Figure} figure
   * @param {string} label
   */
  drawSelected(stage, port, figure, label) {
    const node = figure.byLabel.get(label);
    const at = node && stage.project(new Vector3().setFromMatrixPosition(node.matrixWorld), port);
    if (!at) return;
    const { context } = this;
    context.beginPath();
    context.arc(at[0], at[1], 6, 0, Math.PI * 2);
    context.lineWidth = 2.5;
    context.strokeStyle = color("accent");
    context.fillStyle = color("panel");
    context.fill();
    context.stroke();
    context.font = "600 12px system-ui, sans-serif";
    const width = context.measureText(label).width + 12;
    // Where there is no room beside the joint, above it.
    const isAbove = at[0] + 15 + width > port.clipRight;
    const left = isAbove ? Math.max(port.clipRight - width - 4, port.clipLeft + 4) : at[0] + 11;
    const top = isAbove ? at[1] - 32 : at[1] - 10;
    context.fillStyle = color("accent");
    context.beginPath();
    context.roundRect(left, top, width, 20, 4);
    context.fill();
    context.fillStyle = color("on-accent");
    context.fillText(label, left + 6, top + 14);
  }

  /**
   * The joint nearest to a place on the canvas, by what the API calls it.
   * @param {Stage} stage
   * @param {number} x
   * @param {number} y
   */
  pick(stage, x, y) {
    const port = stage.portAt(x);
    const { figure } = port.side;
    if (!figure) return null;
    const bones = this.known.get(figure) ?? bonesOf(figure);
    let best = { label: "", distance: 18 };
    for (const index of new Set(bones.flatMap(({ from, to }) => [from, to]))) {
      const node = figure.nodes[index];
      const at = stage.project(new Vector3().setFromMatrixPosition(node.matrixWorld), port);
      const distance = at ? Math.hypot(at[0] - x, at[1] - y) : Infinity;
      if (distance < best.distance) best = { label: node.userData.joint, distance };
    }
    return best.label ? { name: port.name, label: best.label } : null;
  }
}

// Turning a joint of the rest pose by hand.

import { Quaternion, TransformControls } from "../vendor/three.js";

/** @typedef {import("../view/stage.js").Stage} Stage */
/** @typedef {import("../vendor/three.js").Object3D} Object3D */

export class Gizmo {
  /**
   * @param {Stage} stage
   * @param {(joint: string, turn: import("../vendor/three.js").Quaternion) => void} onTurn by how much a joint was turned, in the axes of its file
   */
  constructor(stage, onTurn) {
    this.stage = stage;
    this.controls = new TransformControls(stage.camera, stage.canvas);
    this.controls.setMode("rotate");
    this.controls.setSize(0.7);
    stage.target.scene.add(this.controls.getHelper());
    /** @type {Object3D|null} */
    this.node = null;
    this.before = new Quaternion();
    const controls = /** @type {any} */ (this.controls);
    const { canvas } = stage;
    // The figure may have a part of the canvas only.
    controls._getPointer = (/** @type {PointerEvent} */ event) => {
      const rect = canvas.getBoundingClientRect();
      const port = stage.ports().find(({ name }) => name === "target");
      const [left, width] = port ? [port.left, port.width] : [0, rect.width];
      return { x: ((event.clientX - rect.left - left) / width) * 2 - 1, y: (-(event.clientY - rect.top) / rect.height) * 2 + 1, button: event.button };
    };
    this.controls.addEventListener("change", () => { stage.isDirty = true; });
    this.controls.addEventListener("dragging-changed", (/** @type {any} */ event) => {
      stage.controls.enabled = !event.value;
      if (event.value) this.begin();
      else this.end(onTurn);
    });
  }

  get isDragging() {
    return this.controls.dragging;
  }

  /** @param {Object3D|null} node */
  attach(node) {
    this.node = node;
    if (node) this.controls.attach(node);
    else this.controls.detach();
    this.stage.isDirty = true;
  }

  toggleSpace() {
    this.controls.setSpace(this.controls.space === "local" ? "world" : "local");
    this.stage.isDirty = true;
    return this.controls.space;
  }

  /**
   * Leaves one axis to turn about, or all where that is the only one.
   * @param {"X"|"Y"|"Z"} axis
   */
  lock(axis) {
    const controls = /** @type {any} */ (this.controls);
    const isOnly = ["X", "Y", "Z"].every((name) => controls[`show${name}`] === (name === axis));
    for (const name of ["X", "Y", "Z"]) controls[`show${name}`] = isOnly || name === axis;
    this.stage.isDirty = true;
  }

  begin() {
    this.node?.getWorldQuaternion(this.before);
  }

  /** @param {(joint: string, turn: import("../vendor/three.js").Quaternion) => void} onTurn */
  end(onTurn) {
    if (!this.node) return;
    const after = this.node.getWorldQuaternion(new Quaternion());
    const turn = after.multiply(this.before.clone().invert());
    if (Math.abs(turn.w) > 1 - 1e-9) return;
    const ofGroup = this.stage.target.group.getWorldQuaternion(new Quaternion());
    onTurn(this.node.userData.joint, ofGroup.clone().invert().multiply(turn).multiply(ofGroup));
  }
}

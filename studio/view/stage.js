// Both figures on one canvas: beside one another, one over the other, or with a wipe between them; always through the same camera.

import { OrbitControls, PerspectiveCamera, Vector3, WebGLRenderer } from "../vendor/three.js";
import { color } from "../dom.js";
import { Side } from "./side.js";

/** @typedef {"beside"|"over"|"wipe"} Mode */
/** @typedef {{side: Side, name: "source"|"target", left: number, top: number, width: number, height: number, clipLeft: number, clipRight: number}} Port */

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "low-power" });
    this.renderer.autoClear = false;
    this.camera = new PerspectiveCamera(32, 1, 0.02, 200);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => { this.isDirty = true; });
    this.source = new Side();
    this.target = new Side();
    /** @type {Mode} */
    this.mode = "beside";
    this.wipe = 0.5;
    this.isFollowed = true;
    this.isTrueSize = false;
    this.isDirty = true;
    this.width = 1;
    this.height = 1;
    /** JavaScript of frames that were drawn, for who measures. */
    this.stats = { frames: 0, milliseconds: 0, calls: 0, script: 0 };
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.width = clientWidth;
    this.height = clientHeight;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.isDirty = true;
  }

  paint() {
    this.source.paint();
    this.target.paint();
    this.isDirty = true;
  }

  /** @param {Mode} mode */
  setMode(mode) {
    this.mode = mode;
    this.source.haunt(mode === "over");
    this.isDirty = true;
  }

  /** Both as large as the target, by how high they carry the body, unless their true sizes are wanted. */
  setScales() {
    const [own, other] = [this.source.figure?.stature, this.target.figure?.stature];
    this.target.scale = 1;
    this.source.scale = this.isTrueSize || !own || !other ? 1 : other / own;
    this.isDirty = true;
  }

  /** How high what is shown is. */
  get figureHeight() {
    const heights = [this.source, this.target].map((side) => (side.figure?.height ?? 0) * side.scale);
    return Math.max(...heights) || 1.8;
  }

  /**
   * Looks at everything from a direction.
   * @param {"front"|"side"|"top"|"three_quarter"} [from]
   */
  fit(from) {
    const height = this.figureHeight;
    const way = {
      front: new Vector3(0, 0.12, 1), side: new Vector3(1, 0.12, 0), top: new Vector3(0, 1, 0.001), three_quarter: new Vector3(0.62, 0.28, 1),
    }[from ?? "three_quarter"].normalize();
    const [port] = this.ports();
    const narrow = Math.min(1, (port.width / port.height) * 1.15);
    const distance = (height * 2.35) / narrow;
    this.controls.target.set(0, height * 0.53, 0);
    this.camera.position.copy(this.controls.target).addScaledVector(way, distance);
    this.camera.near = height / 100;
    this.camera.far = height * 60;
    this.controls.minDistance = height / 20;
    this.controls.maxDistance = height * 20;
    this.controls.update();
    this.isDirty = true;
  }

  /** @param {Vector3} place */
  focus(place) {
    const move = place.clone().sub(this.controls.target);
    this.controls.target.copy(place);
    this.camera.position.add(move).lerp(place, 0.45);
    this.controls.update();
  }

  /**
   * Where each side is on the canvas.
   * @returns {Port[]}
   */
  ports() {
    const { width, height, source, target, mode } = this;
    const whole = { left: 0, top: 0, width, height, clipLeft: 0, clipRight: width };
    if (mode === "beside") {
      const half = Math.floor(width / 2);
      return [
        { side: source, name: "source", left: 0, top: 0, width: half, height, clipLeft: 0, clipRight: half },
        { side: target, name: "target", left: half, top: 0, width: width - half, height, clipLeft: half, clipRight: width },
      ];
    }
    if (mode === "wipe") {
      const at = Math.round(width * this.wipe);
      return [{ ...whole, side: source, name: "source", clipRight: at }, { ...whole, side: target, name: "target", clipLeft: at }];
    }
    return [{ ...whole, side: target, name: "target" }, { ...whole, side: source, name: "source" }];
  }

  /**
   * The side at a place of the canvas; of two over one another the target's.
   * @param {number} x
   */
  portAt(x) {
    return this.ports().find((port) => x >= port.clipLeft && x < port.clipRight) ?? this.ports()[0];
  }

  render() {
    const begun = performance.now();
    const { renderer, camera } = this;
    renderer.setScissorTest(false);
    renderer.setClearColor(color("canvas"));
    renderer.clear();
    renderer.setScissorTest(true);
    let calls = 0;
    for (const port of this.ports()) {
      if (port.clipRight <= port.clipLeft) continue;
      renderer.setViewport(port.left, 0, port.width, port.height);
      renderer.setScissor(port.clipLeft, 0, port.clipRight - port.clipLeft, port.height);
      camera.aspect = port.width / port.height;
      camera.updateProjectionMatrix();
      if (this.mode === "over") renderer.clearDepth();
      renderer.render(port.side.scene, camera);
      calls += renderer.info.render.calls;
    }
    this.stats.frames += 1;
    this.stats.milliseconds += performance.now() - begun;
    this.stats.calls = calls;
  }

  /**
   * Where a place in the world is on the canvas, in a port; behind the camera it is nowhere.
   * @param {Vector3} place is changed
   * @param {Port} port
   * @returns {[number, number]|null}
   */
  project(place, port) {
    this.camera.aspect = port.width / port.height;
    this.camera.updateProjectionMatrix();
    place.project(this.camera);
    if (place.z > 1) return null;
    return [port.left + (place.x * 0.5 + 0.5) * port.width, port.top + (0.5 - place.y * 0.5) * port.height];
  }
}

// What is seen: both figures at the time of playback, with marks over them; drawn when something has changed.

import { figures, onFigure } from "../api/live.js";
import { byId, canvasById } from "../dom.js";
import { Gizmo } from "../pose/gizmo.js";
import { showRestPoses, turnJoint } from "../pose/panel.js";
import { set, state, watch } from "../state.js";
import { advance, player, seek } from "../timeline/player.js";
import { Vector3 } from "../vendor/three.js";
import { Marks } from "./marks.js";
import { Stage } from "./stage.js";

/** @typedef {import("./stage.js").Mode} Mode */

export class Viewer {
  /** @param {import("../timeline/timeline.js").Timeline} timeline */
  constructor(timeline) {
    this.stage = new Stage(canvasById("canvas"));
    this.marks = new Marks(canvasById("marks"));
    this.gizmo = new Gizmo(this.stage, turnJoint);
    this.timeline = timeline;
    this.hasMesh = true;
    /** @type {Set<() => void>} */
    this.listeners = new Set();
    player.duration = () => (this.motion?.duration ?? figures.source?.duration ?? 0);
    player.times = () => this.motion?.times ?? figures.source?.facts.key_times_seconds ?? [0];
    onFigure(() => this.takeFigures());
    watch(["motion", "pinned", "showsPinned"], () => this.takeMotion());
    watch(["posing"], () => void this.takePose());
    watch(["config"], () => { if (state.posing) void showRestPoses().then(() => this.touch()); });
    watch(["joint", "sourceJoint", "seconds", "report"], () => this.touch());
    watch(["joint", "posing"], () => this.attach());
    watch(["report"], () => timeline.take());
    watch(["seconds"], () => { timeline.hasMoved = true; });
    watch(["motion", "source", "showsPinned"], () => { timeline.isDirty = true; });
    this.listen();
    const loop = (/** @type {number} */ now) => {
      requestAnimationFrame(loop);
      this.frame(now);
    };
    requestAnimationFrame(loop);
  }

  /** The motion that is shown: the latest, or the pinned one. */
  get motion() {
    return state.showsPinned && state.pinned ? state.pinned.motion : state.motion;
  }

  /** @param {() => void} call when something about the view was switched */
  onChange(call) {
    this.listeners.add(call);
  }

  touch() {
    this.stage.isDirty = true;
    for (const call of this.listeners) call();
  }

  takeFigures() {
    const { stage } = this;
    const isNew = stage.source.figure !== figures.source || stage.target.figure !== figures.target;
    if (stage.source.figure !== figures.source) stage.source.show(figures.source);
    if (stage.target.figure !== figures.target) stage.target.show(figures.target);
    this.marks.forget();
    stage.source.isGhost = false;
    stage.setMode(stage.mode);
    this.showMeshes();
    stage.setScales();
    if (isNew) stage.fit();
    set({ seconds: 0, frame: 0, posing: false, joint: "", sourceJoint: "" });
    this.caption();
    this.touch();
  }

  takeMotion() {
    const { motion } = this;
    if (!motion || !figures.target || state.posing) return;
    figures.target.move(motion);
    this.marks.forget();
    this.stage.target.begin();
    seek(state.seconds);
    this.caption();
    this.touch();
  }

  async takePose() {
    if (state.posing) {
      player.isPlaying = false;
      await showRestPoses();
    } else {
      this.takeMotion();
      // The source's own clip is there again with its figure.
      figures.source?.play(figures.source.clip);
    }
    this.marks.forget();
    this.attach();
    this.caption();
    this.touch();
  }

  attach() {
    this.gizmo.attach(state.posing && state.joint ? figures.target?.byLabel.get(state.joint) ?? null : null);
  }

  caption() {
    const of = (/** @type {"source"|"target"} */ side, /** @type {string} */ what) => {
      const file = state[side]?.file_name;
      return file ? `${what} · ${file}` : "";
    };
    byId("caption-source").textContent = of("source", state.posing ? "Rest pose of the clip" : "Clip");
    byId("caption-target").textContent = of("target", state.posing ? "Rest pose of the character" : state.pinned ? (state.showsPinned ? "Result A" : "Result B") : this.motion ? "Result" : "Character");
  }

  /** @param {number} now */
  frame(now) {
    // Beside another page of the studio, nothing is seen of the figures.
    if (!this.stage.canvas.clientWidth) return;
    const hasMoved = !state.posing && advance(now);
    if (this.gizmo.isDragging) this.stage.isDirty = true;
    if (hasMoved || this.stage.isDirty) this.draw();
    if (this.timeline.isDirty || this.timeline.hasMoved) this.timeline.draw();
  }

  draw() {
    const begun = performance.now();
    const { stage } = this;
    stage.isDirty = false;
    if (!this.gizmo.isDragging) {
      stage.source.at(this.sourceSeconds(), stage.isFollowed, state.posing);
      stage.target.at(state.seconds, stage.isFollowed, state.posing);
    }
    stage.render();
    const contacts = state.posing ? [] : (state.showsPinned ? state.pinned?.report : state.report)?.contacts ?? [];
    this.marks.draw(stage, { seconds: state.seconds, contacts, selected: { source: state.sourceJoint, target: state.joint }, onlyBones: !this.hasMesh });
    stage.stats.script += performance.now() - begun;
    if (!performance.getEntriesByName("first frame").length && figures.source) performance.mark("first frame");
  }

  /** Where the source is when the result is where it is: edits of its time are followed as far as they are simple. */
  sourceSeconds() {
    const { range, speed = 1, reverse } = state.config.edit ?? {};
    const [from, to] = Array.isArray(range) ? range : [0, figures.source?.duration ?? 0];
    const length = Math.max(to - from, 1e-6);
    const passed = (state.seconds * speed) % (length + 1e-4);
    return reverse ? to - passed : from + passed;
  }

  /** @param {Mode} mode */
  setMode(mode) {
    this.stage.setMode(mode);
    byId("view").dataset.mode = mode;
    byId("divider").hidden = mode !== "wipe";
    this.placeDivider();
    this.touch();
  }

  toggleGhost() {
    this.setMode(this.stage.mode === "over" ? "beside" : "over");
  }

  toggleMesh() {
    this.hasMesh = !this.hasMesh;
    this.showMeshes();
    this.touch();
  }

  showMeshes() {
    this.stage.source.showMesh(this.hasMesh);
    this.stage.target.showMesh(this.hasMesh);
  }

  toggleBones() {
    this.marks.bones = !this.marks.bones;
    this.touch();
  }

  toggleContacts() {
    this.marks.contacts = !this.marks.contacts;
    this.touch();
  }

  toggleTrails() {
    this.marks.trails = !this.marks.trails;
    this.touch();
  }

  toggleFollow() {
    this.stage.isFollowed = !this.stage.isFollowed;
    this.touch();
  }

  toggleSize() {
    this.stage.isTrueSize = !this.stage.isTrueSize;
    this.stage.setScales();
    this.touch();
  }

  /**
   * Looks at a joint of the target.
   * @param {string} label
   */
  focus(label) {
    const node = figures.target?.byLabel.get(label);
    if (!node) return;
    this.draw();
    this.stage.focus(new Vector3().setFromMatrixPosition(node.matrixWorld));
  }

  placeDivider() {
    byId("divider").style.left = `${this.stage.wipe * 100}%`;
  }

  listen() {
    const { canvas } = this.stage;
    let down = [0, 0];
    canvas.addEventListener("pointerdown", (event) => { down = [event.clientX, event.clientY]; });
    canvas.addEventListener("pointerup", (event) => {
      if (Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4 || this.gizmo.isDragging) return;
      const found = this.marks.pick(this.stage, event.offsetX, event.offsetY);
      if (found) set(found.name === "source" ? { sourceJoint: found.label } : { joint: found.label });
    });
    canvas.addEventListener("dblclick", () => { if (state.joint) this.focus(state.joint); });
    const divider = byId("divider");
    divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
    divider.addEventListener("pointermove", (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      const rect = canvas.getBoundingClientRect();
      this.stage.wipe = Math.min(Math.max((event.clientX - rect.left) / rect.width, 0.02), 0.98);
      this.placeDivider();
      this.touch();
    });
  }
}

// One of the two figures with its floor and light, standing in the middle whatever its file says of where and how large it is.

import {
  BufferGeometry, CanvasTexture, CircleGeometry, Color, DirectionalLight, Float32BufferAttribute, Group, HemisphereLight, LineBasicMaterial,
  LineSegments, Mesh, MeshBasicMaterial, Scene, Vector3,
} from "../vendor/three.js";
import { color } from "../dom.js";

/** @typedef {import("./figure.js").Figure} Figure */

const CELL = 0.5;
const CELLS = 32;

export class Side {
  constructor() {
    this.scene = new Scene();
    this.group = new Group();
    this.scene.add(this.group);
    this.light = new DirectionalLight(0xffffff, 2.1);
    this.light.position.set(1.5, 3, 2.5);
    this.scene.add(new HemisphereLight(0xffffff, 0x8d8d99, 1.7), this.light);
    /** @type {Figure|null} */
    this.figure = null;
    this.scale = 1;
    this.shadow = shadow();
    this.scene.add(this.shadow);
    /** @type {LineSegments|null} */
    this.grid = null;
    this.start = new Vector3();
    this.place = new Vector3();
    this.isGhost = false;
    this.paint();
  }

  /** Takes the colors of the style sheet. */
  paint() {
    if (this.grid) {
      this.scene.remove(this.grid);
      this.grid.geometry.dispose();
    }
    this.grid = floorGrid();
    this.scene.add(this.grid);
    this.scene.background = new Color(color("canvas"));
  }

  /** @param {Figure|null} figure */
  show(figure) {
    this.figure?.dispose();
    this.group.clear();
    this.figure = figure;
    this.shadow.visible = figure !== null;
    if (!figure) return;
    this.group.add(figure.group);
    const [x, , z] = figure.facts.front;
    this.group.rotation.y = -Math.atan2(x, z);
    this.begin();
  }

  /** Remembers where the figure begins. */
  begin() {
    const { figure } = this;
    if (!figure) return;
    figure.at(0);
    figure.root.updateMatrixWorld(true);
    this.centerOf(this.start);
  }

  /**
   * Where the figure's center is in its own space.
   * @param {Vector3} into
   */
  centerOf(into) {
    const { figure } = this;
    if (!figure?.center) return into.set(0, 0, 0);
    this.group.updateMatrixWorld(true);
    return figure.group.worldToLocal(figure.center.getWorldPosition(into));
  }

  /**
   * Moves the figure to a time, and stands it in the middle.
   * @param {number} seconds
   * @param {boolean} isFollowed whether the view goes along with it
   * @param {boolean} isResting
   */
  at(seconds, isFollowed, isResting) {
    const { figure, group, place, scale, grid } = this;
    if (!figure) return;
    if (isResting) figure.toRest();
    else figure.at(seconds);
    group.scale.setScalar(scale);
    this.centerOf(place);
    const middle = isFollowed || isResting ? place : this.start;
    const turn = group.rotation.y;
    const [x, z] = turned(middle.x * scale, middle.z * scale, turn);
    const floor = isResting ? figure.box.min.y : figure.floor;
    group.position.set(-x, -floor * scale, -z);
    group.updateMatrixWorld(true);
    const [sx, sz] = turned(place.x * scale, place.z * scale, turn);
    this.shadow.position.set(sx - x, 0.002, sz - z);
    this.shadow.scale.setScalar(figure.height * scale * 0.24);
    if (grid) grid.position.set(-(x % (CELL * scale)), 0, -(z % (CELL * scale)));
    grid?.scale.setScalar(scale);
  }

  /**
   * Shows the figure as a ghost, or as it is.
   * @param {boolean} isGhost
   */
  haunt(isGhost) {
    if (this.isGhost === isGhost) return;
    this.isGhost = isGhost;
    const background = isGhost ? null : new Color(color("canvas"));
    this.scene.background = background;
    if (this.grid) this.grid.visible = !isGhost;
    this.shadow.visible = !isGhost && this.figure !== null;
    this.figure?.meshes.forEach((mesh) => {
      const material = /** @type {any} */ (mesh.material);
      material.userData.own ??= { opacity: material.opacity, transparent: material.transparent };
      Object.assign(material, isGhost ? { opacity: 0.42, transparent: true } : material.userData.own);
      material.emissive?.set(isGhost ? color("source") : 0x000000);
      material.needsUpdate = true;
    });
  }

  /** @param {boolean} isShown */
  showMesh(isShown) {
    this.figure?.meshes.forEach((mesh) => { mesh.visible = isShown; });
  }
}

/**
 * @param {number} x
 * @param {number} z
 * @param {number} turn about Y
 * @returns {[number, number]}
 */
function turned(x, z, turn) {
  const [sine, cosine] = [Math.sin(turn), Math.cos(turn)];
  return [x * cosine + z * sine, z * cosine - x * sine];
}

/** Lines of the floor that fade away from the figure, in short pieces: not every renderer cuts long ones well that pass the camera. */
function floorGrid() {
  const [near, far] = [new Color(color("grid")), new Color(color("canvas"))];
  const radius = (CELL * CELLS) / 2;
  /** @type {number[]} */
  const places = [];
  /** @type {number[]} */
  const colors = [];
  const add = (/** @type {number} */ x, /** @type {number} */ z) => {
    places.push(x, 0, z);
    const share = Math.min(Math.hypot(x, z) / radius, 1);
    colors.push(...near.clone().lerp(far, share ** 0.7).toArray());
  };
  for (let line = -CELLS / 2; line <= CELLS / 2; line += 1) {
    for (let piece = -CELLS / 2; piece < CELLS / 2; piece += 1) {
      const [across, from, to] = [line * CELL, piece * CELL, (piece + 1) * CELL];
      if (Math.hypot(across, from) > radius && Math.hypot(across, to) > radius) continue;
      add(across, from);
      add(across, to);
      add(from, across);
      add(to, across);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(places, 3));
  geometry.setAttribute("color", new Float32BufferAttribute(colors, 3));
  const lines = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, depthWrite: false }));
  lines.renderOrder = -1;
  return lines;
}

/** A soft dark place under a figure. */
function shadow() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const fade = context.createRadialGradient(32, 32, 2, 32, 32, 32);
  fade.addColorStop(0, "rgba(0,0,0,0.26)");
  fade.addColorStop(1, "rgba(0,0,0,0)");
  context.fillStyle = fade;
  context.fillRect(0, 0, 64, 64);
  const map = new CanvasTexture(canvas);
  const disc = new Mesh(new CircleGeometry(1, 32), new MeshBasicMaterial({ map, transparent: true, depthWrite: false }));
  disc.rotation.x = -Math.PI / 2;
  disc.visible = false;
  return disc;
}

// Rotations as the config writes them: degrees about the character's X, then Y, then Z; X to its left, Y up, Z to its front.

import { Matrix4, Quaternion, Vector3 } from "../vendor/three.js";

/** @typedef {import("../vendor/three.js").Quaternion} Quat */

/**
 * @param {[number, number, number]} front of the figure
 * @returns {Quat} turns what is in the character's axes to those of its file
 */
export function fileFromCharacter([x, y, z]) {
  const front = new Vector3(x, y, z).setY(0).normalize();
  const up = new Vector3(0, 1, 0);
  return new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(up.clone().cross(front), up, front));
}

/**
 * @param {Quat} turn in the axes of the file
 * @param {[number, number, number]} front
 * @returns {[number, number, number]}
 */
export function degreesOf(turn, front) {
  const basis = fileFromCharacter(front);
  const { x, y, z, w } = basis.clone().invert().multiply(turn).multiply(basis).normalize();
  // R = Rz · Ry · Rx.
  const sine = Math.min(Math.max(2 * (w * y - z * x), -1), 1);
  const about = [Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), Math.asin(sine), Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))];
  return /** @type {[number, number, number]} */ (about.map((angle) => Number(((angle * 180) / Math.PI).toFixed(3))));
}

/**
 * The same turn on the other side of the body.
 * @param {[number, number, number]} degrees
 * @returns {[number, number, number]}
 */
export function mirrored([x, y, z]) {
  return [x, -y, -z];
}

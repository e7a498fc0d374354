// The animation of a result, to be put onto the figure that is shown already.

import { AnimationClip, QuaternionKeyframeTrack, VectorKeyframeTrack } from "../vendor/three.js";
import { floats, readGlb } from "./glb.js";

/**
 * @typedef {object} Channel
 * @property {string} joint name of the node, as the file has it
 * @property {number} node index of the node
 * @property {"translation"|"rotation"|"scale"} path
 * @property {Float32Array} times
 * @property {Float32Array} values
 * @property {boolean} isCubic
 */

/**
 * @typedef {object} Motion
 * @property {Channel[]} channels
 * @property {Float32Array} times key times of all frames
 * @property {number} duration
 */

/** @type {Record<string, string>} */
const PROPERTY = { translation: "position", rotation: "quaternion", scale: "scale" };

/**
 * @param {ArrayBuffer} bytes a GLB whose nodes are those of the figure
 * @returns {Motion}
 */
export function readMotion(bytes) {
  const glb = readGlb(bytes);
  const animation = glb.json.animations?.[0];
  /** @type {Channel[]} */
  const channels = [];
  /** @type {Map<number, Float32Array>} */
  const inputs = new Map();
  /** @type {Float32Array} */
  let times = new Float32Array([0]);
  let duration = 0;
  for (const { sampler, target } of animation?.channels ?? []) {
    if (!PROPERTY[target.path]) continue;
    const { input, output, interpolation } = animation.samplers[sampler];
    const keys = inputs.get(input) ?? floats(glb, input).values;
    inputs.set(input, keys);
    if (keys.length > times.length) times = keys;
    duration = Math.max(duration, keys[keys.length - 1] ?? 0);
    const joint = glb.json.nodes[target.node].name ?? "";
    const { values } = floats(glb, output);
    channels.push({ joint, node: target.node, path: target.path, times: keys, values, isCubic: interpolation === "CUBICSPLINE" });
  }
  return { channels, times, duration };
}

/**
 * The motion as a clip of a figure's nodes.
 * @param {Motion} motion
 * @param {(channel: Channel) => import("../vendor/three.js").Object3D|undefined} nodeOf
 */
export function clipOf(motion, nodeOf) {
  const tracks = [];
  for (const channel of motion.channels) {
    const node = nodeOf(channel);
    if (!node) continue;
    const name = `${node.uuid}.${PROPERTY[channel.path]}`;
    const values = channel.isCubic ? keyValues(channel) : channel.values;
    const Track = channel.path === "rotation" ? QuaternionKeyframeTrack : VectorKeyframeTrack;
    tracks.push(new Track(name, channel.times, values));
  }
  return new AnimationClip("motion", motion.duration, tracks);
}

/**
 * The values at the keys of a cubic channel, without its tangents.
 * @param {Channel} channel
 */
function keyValues({ times, values }) {
  const width = values.length / times.length / 3;
  const kept = new Float32Array(times.length * width);
  for (let key = 0; key < times.length; key += 1) {
    kept.set(values.subarray((3 * key + 1) * width, (3 * key + 2) * width), key * width);
  }
  return kept;
}

/**
 * The frame at a time: the last one that has begun, nearest within half a step.
 * @param {ArrayLike<number>} times
 * @param {number} seconds
 */
export function frameAt(times, seconds) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= seconds + 1e-6) low = middle;
    else high = middle - 1;
  }
  const next = times[low + 1];
  return next !== undefined && next - seconds < seconds - times[low] ? low + 1 : low;
}

// Playback: where in the result the clock is, and how fast it runs.

import { set, state } from "../state.js";
import { frameAt } from "../view/motion.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

export const player = {
  isPlaying: false,
  speed: 1,
  isLooping: true,
  /** @type {() => number} */
  duration: () => 0,
  /** @type {() => ArrayLike<number>} */
  times: () => [0],
  last: 0,
};

/** @param {number} seconds */
export function seek(seconds) {
  const clamped = Math.min(Math.max(seconds, 0), player.duration());
  set({ seconds: clamped, frame: frameAt(player.times(), clamped) });
}

/** @param {number} frame */
export function seekFrame(frame) {
  const times = player.times();
  const index = Math.min(Math.max(Math.round(frame), 0), times.length - 1);
  set({ seconds: times[index] ?? 0, frame: index });
}

/** @param {number} frames */
export function step(frames) {
  pause();
  seekFrame(state.frame + frames);
}

/** @type {Set<() => void>} */
const listeners = new Set();

/** @param {() => void} call when playback starts, stops or changes its speed */
export function onPlayback(call) {
  listeners.add(call);
}

function tell() {
  for (const call of listeners) call();
}

export function play(speed = Math.abs(player.speed)) {
  player.speed = speed;
  player.isPlaying = true;
  player.last = performance.now();
  tell();
}

export function pause() {
  player.isPlaying = false;
  tell();
}

export function toggle() {
  if (player.isPlaying) pause();
  else play();
}

/** The next slower or faster speed. */
export function slower() {
  shift(-1);
}

export function faster() {
  shift(1);
}

/** @param {number} by */
function shift(by) {
  const at = SPEEDS.indexOf(Math.abs(player.speed));
  player.speed = SPEEDS[Math.min(Math.max((at < 0 ? 3 : at) + by, 0), SPEEDS.length - 1)];
  tell();
}

export function cycleSpeed() {
  const at = SPEEDS.indexOf(player.speed);
  player.speed = SPEEDS[(at + SPEEDS.length - 1) % SPEEDS.length];
  tell();
}

/**
 * Lets time go on. Gives whether anything moved.
 * @param {number} now
 */
export function advance(now) {
  if (!player.isPlaying) return false;
  const duration = player.duration();
  const passed = Math.min((now - player.last) / 1000, 0.25) * player.speed;
  player.last = now;
  if (!duration) return false;
  const next = state.seconds + passed;
  if (next > duration || next < 0) {
    if (!player.isLooping) {
      pause();
      seek(next < 0 ? 0 : duration);
      return true;
    }
    seek(((next % duration) + duration) % duration);
    return true;
  }
  seek(next);
  return true;
}

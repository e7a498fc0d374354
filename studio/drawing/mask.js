// The mask of a drawing under a brush.

/** @typedef {import("./character.js").Drawing} Drawing */
/** @typedef {[number, number, number, number]} Box left, top, width and height, in pixels of the drawing */

/** Of what lies outside of the mask: dark blue, so that white paper and dark strokes are told apart from the figure. */
const VEIL = [40, 52, 84, 165];

/**
 * Sets all that a round brush touches on its way.
 * @param {Drawing} drawing
 * @param {number[]} from
 * @param {number[]} to
 * @param {number} radius
 * @param {number} value
 * @returns {Box} what may have changed
 */
export function paint({ width, height, mask }, from, to, radius, value) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.max(dx * dx + dy * dy, 1e-9);
  const [left, right] = [Math.max(Math.floor(Math.min(from[0], to[0]) - radius), 0), Math.min(Math.ceil(Math.max(from[0], to[0]) + radius), width - 1)];
  const [top, bottom] = [Math.max(Math.floor(Math.min(from[1], to[1]) - radius), 0), Math.min(Math.ceil(Math.max(from[1], to[1]) + radius), height - 1)];
  for (let y = top; y <= bottom; y += 1) {
    for (let x = left; x <= right; x += 1) {
      const share = Math.min(Math.max(((x + 0.5 - from[0]) * dx + (y + 0.5 - from[1]) * dy) / length, 0), 1);
      if (Math.hypot(x + 0.5 - from[0] - dx * share, y + 0.5 - from[1] - dy * share) <= radius) mask[y * width + x] = value;
    }
  }
  return [left, top, right - left + 1, bottom - top + 1];
}

/**
 * Draws what is outside of the mask.
 * @param {Drawing} drawing
 * @param {CanvasRenderingContext2D} veil
 * @param {Box} [box] what has changed
 */
export function veilOf({ width, height, mask }, veil, box) {
  const { canvas } = veil;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const [left, top, wide, high] = box ?? [0, 0, width, height];
  if (wide <= 0 || high <= 0) return;
  const image = veil.createImageData(wide, high);
  for (let y = 0; y < high; y += 1) {
    for (let x = 0; x < wide; x += 1) {
      if (mask[(top + y) * width + left + x] === 0) image.data.set(VEIL, 4 * (y * wide + x));
    }
  }
  veil.putImageData(image, left, top);
}

// Reads what the service's own GLB files say, without a scene: their JSON and the numbers of accessors.

const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;
/** @type {Record<string, number>} */
const WIDTH = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };
const FLOAT = 5126;

/** @typedef {{json: any, binary: ArrayBuffer|null, offset: number}} Glb */

/**
 * @param {ArrayBuffer} bytes
 * @returns {Glb}
 */
export function readGlb(bytes) {
  const view = new DataView(bytes);
  if (view.getUint32(0, true) !== 0x46546c67) throw new Error("the service did not answer with a GLB");
  let json = null;
  let offset = 0;
  for (let at = 12; at + 8 <= bytes.byteLength;) {
    const length = view.getUint32(at, true);
    const kind = view.getUint32(at + 4, true);
    if (kind === JSON_CHUNK) json = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, at + 8, length)));
    if (kind === BINARY_CHUNK) offset = at + 8;
    at += 8 + length;
  }
  return { json, binary: offset ? bytes : null, offset };
}

/**
 * The floats of an accessor, and how many belong to each element.
 * @param {Glb} glb
 * @param {number} index
 * @returns {{values: Float32Array, width: number}}
 */
export function floats(glb, index) {
  const accessor = glb.json.accessors[index];
  if (accessor.componentType !== FLOAT || accessor.sparse) throw new Error("the animation is stored in a way that is not expected here");
  const view = glb.json.bufferViews[accessor.bufferView];
  const width = WIDTH[accessor.type] ?? 1;
  const start = glb.offset + (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  const bytes = /** @type {ArrayBuffer} */ (glb.binary);
  return { values: new Float32Array(bytes.slice(start, start + accessor.count * width * 4)), width };
}

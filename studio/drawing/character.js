// A drawing as the page has it: its picture, its mask and its joints; from a picture or an archive, and back to an archive.

import { getBytes, getJson, request } from "../api/client.js";
import { readZip, writeZip } from "./zip.js";

/** @typedef {import("../api/types.js").Asset} Asset */
/** @typedef {import("../api/types.js").Warning} Warning */
/** @typedef {{name: string, parent: string|null, loc: [number, number]}} Joint in pixels from the left and the top */
/**
 * @typedef {object} Drawing
 * @property {string} name
 * @property {number} width
 * @property {number} height
 * @property {Uint8Array<ArrayBuffer>} texture its file, as it came
 * @property {ImageBitmap} picture
 * @property {Uint8Array} mask a byte for each pixel: 255 where the figure is
 * @property {Joint[]} joints the root first, each after its parent
 * @property {Record<string, number>} sureness of the joints that were found in a picture
 * @property {Warning[]} warnings
 */

const CONFIG = "char_cfg.yaml";

/**
 * What an asset of the format `drawing` holds. A picture alone is looked through for its mask and its joints.
 * @param {Asset} asset
 * @returns {Promise<Drawing>}
 */
export async function readDrawing(asset) {
  const bytes = await getBytes(`/v1/assets/${asset.id}/content`);
  const isArchive = new DataView(bytes).getUint16(0) === 0x504b;
  if (!isArchive) return find(new Blob([bytes]), asset.file_name, "auto");
  const { drawing } = await getJson(`/v1/assets/${asset.id}/skeleton`);
  return unpack(bytes, asset.file_name, drawing.joints);
}

/**
 * Has the service find mask and joints in a picture.
 * @param {Blob} picture
 * @param {string} name
 * @param {string} rig `auto`, `humanoid`, `quadruped` or `chains`
 * @param {Blob} [mask] wins over what is found
 * @returns {Promise<Drawing>}
 */
export async function find(picture, name, rig, mask) {
  const ask = (/** @type {string} */ accept) => {
    const form = new FormData();
    form.append("image", picture, "drawing");
    form.append("rig", rig);
    if (mask) form.append("mask", mask, "mask.png");
    return request("/v1/drawing-annotations", { method: "POST", body: form, headers: { accept } });
  };
  const [archive, found] = await Promise.all([
    ask("application/zip").then((answer) => answer.arrayBuffer()), ask("application/json").then((answer) => answer.json()),
  ]);
  const drawing = await unpack(archive, name, found.skeleton);
  const sureness = Object.fromEntries(found.skeleton.map((/** @type {any} */ joint) => [joint.name, joint.confidence]));
  return { ...drawing, sureness, warnings: found.warnings };
}

/**
 * @param {ArrayBuffer} archive
 * @param {string} name
 * @param {Joint[]} joints
 * @returns {Promise<Drawing>}
 */
async function unpack(archive, name, joints) {
  const files = await readZip(archive);
  const path = [...files.keys()].find((of) => of.endsWith(CONFIG)) ?? CONFIG;
  const beside = (/** @type {string} */ of) => {
    const bytes = files.get(path.slice(0, -CONFIG.length) + of);
    if (!bytes) throw new Error(`The archive has no ${of} beside ${CONFIG}.`);
    return bytes;
  };
  const texture = beside("texture.png");
  const [picture, maskPicture] = await Promise.all([texture, beside("mask.png")].map((of) => createImageBitmap(new Blob([of]))));
  const { width, height } = picture;
  const context = surface(width, height);
  context.drawImage(maskPicture, 0, 0);
  const { data } = context.getImageData(0, 0, width, height);
  const mask = Uint8Array.from({ length: width * height }, (_, pixel) => (data[4 * pixel] >= 128 && data[4 * pixel + 3] >= 128 ? 255 : 0));
  const own = joints.map(({ name: of, parent, loc }) => ({ name: of, parent, loc: /** @type {[number, number]} */ ([loc[0], loc[1]]) }));
  return { name: name.replace(/\.[^.]+$/, ""), width, height, texture, picture, mask, joints: own, sureness: {}, warnings: [] };
}

/**
 * @param {number} width
 * @param {number} height
 */
export function surface(width, height) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  return /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
}

/**
 * The mask as a picture, white where the figure is.
 * @param {Drawing} drawing
 * @returns {Promise<Blob>}
 */
export async function maskPicture({ width, height, mask }) {
  const context = surface(width, height);
  const image = context.createImageData(width, height);
  mask.forEach((value, pixel) => image.data.set([value, value, value, 255], 4 * pixel));
  context.putImageData(image, 0, 0);
  return new Promise((resolve, reject) => context.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("The mask cannot be written."))), "image/png"));
}

/** The character config of Animated Drawings. @param {Drawing} drawing */
function characterText({ width, height, joints }) {
  const rows = joints.map(({ name, parent, loc }) => `- loc: [${loc.join(", ")}]\n  name: ${JSON.stringify(name)}\n  parent: ${parent === null ? "null" : JSON.stringify(parent)}\n`);
  return `height: ${height}\nskeleton:\n${rows.join("")}width: ${width}\n`;
}

/**
 * The drawing as an archive that everything that takes drawings reads.
 * @param {Drawing} drawing
 */
export async function archiveOf(drawing) {
  const mask = new Uint8Array(await (await maskPicture(drawing)).arrayBuffer());
  return writeZip([[CONFIG, new TextEncoder().encode(characterText(drawing))], ["texture.png", drawing.texture], ["mask.png", mask]]);
}

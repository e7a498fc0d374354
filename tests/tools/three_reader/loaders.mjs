// three.js and three-vrm without a browser: what the scripts beside this one share.

import { readFile } from "node:fs/promises";
import { dirname, join } from "node:path";

export let THREE, VRM, VRMA;
let GLTFLoader, FBXLoader, BVHLoader, MeshoptDecoder;
try {
  THREE = await import("three");
  ({ GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js"));
  ({ FBXLoader } = await import("three/addons/loaders/FBXLoader.js"));
  ({ BVHLoader } = await import("three/addons/loaders/BVHLoader.js"));
  ({ MeshoptDecoder } = await import("three/addons/libs/meshopt_decoder.module.js"));
  withoutImages();
  VRM = await import("@pixiv/three-vrm");
  VRMA = await import("@pixiv/three-vrm-animation");
} catch (error) {
  console.error(`three.js is not installed: run 'npm ci --prefix tests/tools/three_reader' (${error})`);
  process.exit(2);
}
// What the loaders say goes beside the answer.
for (const level of ["log", "warn", "info"]) console[level] = (...words) => console.error(...words);

export function ending(file) {
  return file.split(".").pop().toLowerCase();
}

// The group that FBXLoader makes; its clips are in `animations`.
export async function loadFbx(file) {
  return parseFbx(await readFile(file));
}

export function parseFbx(bytes) {
  return new FBXLoader().parse(buffer(bytes), "");
}

// {root, bones, clip}; bones have the file's own name as `userData.name`, and the ends of limbs have none.
export async function loadBvh(file) {
  return parseBvh(await readFile(file, "utf8"));
}

export function parseBvh(text) {
  const { clip, skeleton } = new BVHLoader().parse(text);
  // This loader leaves it to its user to take letters out of names that tracks cannot address.
  const safe = THREE.PropertyBinding.sanitizeNodeName;
  for (const bone of skeleton.bones) [bone.userData.name, bone.name] = [bone.name, safe(bone.name)];
  for (const track of clip.tracks) {
    const [, name, property] = track.name.match(/^(.*)\.(\w+)$/);
    track.name = `${safe(name)}.${property}`;
  }
  const root = new THREE.Group();
  root.add(skeleton.bones[0]);
  return { root, bones: skeleton.bones, clip };
}

// What GLTFLoader makes of a glTF of any kind.
export async function loadGltf(file, plugins = []) {
  const bytes = await readFile(file);
  return parseGltf(ending(file) === "gltf" ? await withBuffers(bytes, dirname(file)) : bytes, plugins);
}

export async function parseGltf(bytes, plugins = []) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  // Joints need no mesh and no texture: what only a browser can decode comes out empty.
  loader.setDRACOLoader({ preload() {}, decodeDracoFile: (_, done) => done(new THREE.BufferGeometry()) });
  loader.setKTX2Loader({ load: (_, done) => done(new THREE.Texture()) });
  for (const plugin of plugins) loader.register(plugin);
  return loader.parseAsync(buffer(bytes), "");
}

// There is no fetch for files here, but there is one for data.
async function withBuffers(bytes, folder) {
  const document = JSON.parse(bytes.toString("utf8"));
  for (const each of document.buffers ?? []) {
    if (!each.uri || each.uri.startsWith("data:")) continue;
    const data = await readFile(join(folder, decodeURIComponent(each.uri)));
    each.uri = `data:application/octet-stream;base64,${data.toString("base64")}`;
  }
  return Buffer.from(JSON.stringify(document));
}

function buffer(bytes) {
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
}

// There is no browser here to decode images. The loaders take one that fails as one that is not there.
function withoutImages() {
  const image = () => ({
    listeners: {},
    addEventListener(kind, listener) {
      this.listeners[kind] = listener;
    },
    removeEventListener() {},
    set src(_) {
      queueMicrotask(() => this.listeners.error?.(new Error("images are not decoded")));
    },
  });
  globalThis.self ??= globalThis;
  globalThis.document ??= { createElementNS: image, createElement: image };
  globalThis.window ??= globalThis;
  // Loaders tell their progress with it.
  globalThis.ProgressEvent ??= class extends Event {};
}

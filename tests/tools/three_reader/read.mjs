// node read.mjs FILE...
//
// Reads glTF, FBX and BVH files with three.js' own loaders and prints one JSON line for each:
//   {"file", "clip", "seconds", "times": [...], "joints": {"<name>": [[x, y, z, qx, qy, qz, qw], ... one per time]}}
// with the world transforms of all named nodes at five times of the first clip, in the units of the file.
//
// A VRM animation is played on an avatar: node read.mjs clip.vrma=avatar.vrm. The joints are then those of the avatar, the
// top ones as three-vrm has them, and "expressions" has the weights of its expressions.
//
// A file that cannot be read has "error" instead. The exit code is 0 unless this script itself cannot work.

import { readFile } from "node:fs/promises";

let THREE, GLTFLoader, FBXLoader, BVHLoader, MeshoptDecoder, VRM, VRMA;
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

for (const file of process.argv.slice(2)) {
  let answer;
  try {
    answer = await read(file);
  } catch (error) {
    answer = { file, error: String(error?.stack ?? error) };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}

async function read(file) {
  const [clip, avatar] = file.split("=");
  const ending = clip.split(".").pop().toLowerCase();
  if (avatar) return { file, ...(await play(clip, avatar)) };
  if (ending === "fbx") {
    const root = new FBXLoader().parse(buffer(await readFile(clip)), "");
    return { file, ...sample(root, root.animations[0]) };
  }
  if (ending === "bvh") {
    const { clip: motion, skeleton } = new BVHLoader().parse(await readFile(clip, "utf8"));
    // This loader leaves it to its user to take letters out of names that tracks cannot address.
    const safe = THREE.PropertyBinding.sanitizeNodeName;
    for (const bone of skeleton.bones) [bone.userData.name, bone.name] = [bone.name, safe(bone.name)];
    for (const track of motion.tracks) {
      const [, name, property] = track.name.match(/^(.*)\.(\w+)$/);
      track.name = `${safe(name)}.${property}`;
    }
    const root = new THREE.Group();
    root.add(skeleton.bones[0]);
    return { file, ...sample(root, motion) };
  }
  const gltf = await load(clip, []);
  return { file, ...sample(gltf.scene, gltf.animations[0]) };
}

async function play(clip, avatar) {
  const { vrm } = (await load(avatar, [(parser) => new VRM.VRMLoaderPlugin(parser)])).userData;
  const [animation] = (await load(clip, [(parser) => new VRMA.VRMAnimationLoaderPlugin(parser)])).userData
    .vrmAnimations;
  const motion = VRMA.createVRMAnimationClip(animation, vrm);
  const expressions = {};
  const seen = () => {
    // Without physics, so that only the animation moves joints; and the raw bones follow the normalised ones.
    vrm.humanoid.update();
    for (const { expressionName } of vrm.expressionManager?.expressions ?? []) {
      (expressions[expressionName] ??= []).push(vrm.expressionManager.getValue(expressionName));
    }
  };
  return { ...sample(vrm.scene, motion, seen), expressions };
}

function sample(root, clip, seen = () => {}) {
  const mixer = new THREE.AnimationMixer(root);
  if (clip) mixer.clipAction(clip).setLoop(THREE.LoopOnce).play().clampWhenFinished = true;
  const seconds = clip?.duration ?? 0;
  const times = [0, 0.25, 0.5, 0.75, 1].map((part) => part * seconds);
  const joints = {};
  const [position, rotation, scale] = [new THREE.Vector3(), new THREE.Quaternion(), new THREE.Vector3()];
  for (const time of times) {
    mixer.setTime(time);
    seen();
    root.updateMatrixWorld(true);
    const told = new Set();
    root.traverse((node) => {
      // Loaders take letters out of names that their animations cannot address; the file's own name is kept by some.
      const name = node.userData.originalName ?? node.userData.name ?? node.name;
      // A bone that several meshes share is there once for each; the first one is what the animation moves.
      if (!name || told.has(name)) return;
      told.add(name);
      node.matrixWorld.decompose(position, rotation, scale);
      (joints[name] ??= []).push([...position.toArray(), ...rotation.toArray()]);
    });
  }
  return { clip: clip?.name ?? null, seconds, times, joints };
}

async function load(file, plugins) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  for (const plugin of plugins) loader.register(plugin);
  return loader.parseAsync(buffer(await readFile(file)), "");
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

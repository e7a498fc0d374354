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

import { THREE, VRM, VRMA, ending, loadBvh, loadFbx, loadGltf } from "./loaders.mjs";

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
  if (avatar) return { file, ...(await play(clip, avatar)) };
  if (ending(clip) === "fbx") {
    const root = await loadFbx(clip);
    return { file, ...sample(root, root.animations[0]) };
  }
  if (ending(clip) === "bvh") {
    const { root, clip: motion } = await loadBvh(clip);
    return { file, ...sample(root, motion) };
  }
  const gltf = await loadGltf(clip);
  return { file, ...sample(gltf.scene, gltf.animations[0]) };
}

async function play(clip, avatar) {
  const { vrm } = (await loadGltf(avatar, [(parser) => new VRM.VRMLoaderPlugin(parser)])).userData;
  const [animation] = (await loadGltf(clip, [(parser) => new VRMA.VRMAnimationLoaderPlugin(parser)])).userData
    .vrmAnimations;
  const motion = VRMA.createVRMAnimationClip(animation, vrm);
  const expressions = {};
  const seen = () => {
    // Without physics, so that only the animation moves joints; and the raw bones follow the normalized ones.
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

// node whole.mjs <REQUESTS
//
// Reads whole files with three.js' own loaders. Each line of standard input asks for one:
//   {"file", "clips": [{"name", "times": [seconds, ...]}]}
// and each line of standard output answers one:
//   {"file", "nodes": [{"name", "parent"}], "rest": [[x, y, z] for each node], "clip_names": [...],
//    "clips": [{"begin", "end", "positions": [[[x, y, z] for each node] for each time]}]}
// Nodes of glTF are those of the document, in its order; those of other formats are parents before children. Parents are
// indices or null. Positions are of the world, in the units of the file; times are those of the file. The clips are those that
// were asked for, and null where there is none of that name; of clips without a name it is the one in the same place.
//
// A file that cannot be read has "error" instead. The exit code is 0 unless this script itself cannot work.

import { createInterface } from "node:readline";
import { THREE, ending, loadBvh, loadFbx, loadGltf } from "./loaders.mjs";

for await (const line of createInterface({ input: process.stdin })) {
  const { file, clips } = JSON.parse(line);
  let answer;
  try {
    answer = { file, ...(await read(file, clips)) };
  } catch (error) {
    answer = { file, error: String(error?.message ?? error) };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}

async function read(file, clips) {
  if (ending(file) === "fbx") {
    const root = await loadFbx(file);
    return whole(root, fbxNodes(root), root.animations, clips);
  }
  if (ending(file) === "bvh") {
    const { root, bones, clip } = await loadBvh(file);
    const joints = bones.filter((bone) => bone.userData.name !== "ENDSITE");
    const nodes = joints.map((bone) => ({ object: bone, name: bone.userData.name }));
    return whole(root, nodes, [clip], clips);
  }
  const { scene, scenes, parser, animations } = await loadGltf(file);
  const root = new THREE.Group();
  root.add(...(scenes.length ? scenes : [scene]));
  return whole(root, await gltfNodes(parser), animations, clips);
}

// One for each node of the document, in no scene too.
async function gltfNodes(parser) {
  const { nodes = [] } = parser.json;
  const objects = await parser.getDependencies("node");
  return nodes.map(({ name = "" }, index) => ({ object: objects[index], name }));
}

// One for each model of the file. A bone that several meshes share is there once for each of them, one below the other; the
// first is the one that is animated.
function fbxNodes(root) {
  const nodes = new Map();
  root.traverse((object) => {
    if (object.ID === undefined || nodes.has(object.ID)) return;
    const name = object.userData.originalName ?? object.name;
    nodes.set(object.ID, { object, name });
  });
  return [...nodes.values()];
}

function whole(root, nodes, animations, asked) {
  const index = new Map(nodes.map((node, index) => [node.object, index]));
  const parent = ({ object }) => {
    for (let above = object.parent; above; above = above.parent) {
      if (index.has(above)) return index.get(above);
    }
    return null;
  };
  const rest = positions(root, nodes);
  const left = [...animations];
  const clips = asked.map(({ name, times }, number) => {
    const found = name ? left.findIndex((clip) => clip.name === name) : number;
    // Of several clips of one name each is taken once.
    const [clip] = name && found >= 0 ? left.splice(found, 1) : [left[found]];
    return clip ? sampled(root, nodes, clip, times) : null;
  });
  const clip_names = animations.map((clip) => clip.name);
  return { nodes: nodes.map((node) => ({ name: node.name, parent: parent(node) })), rest, clip_names, clips };
}

function sampled(root, nodes, clip, times) {
  const mixer = new THREE.AnimationMixer(root);
  mixer.clipAction(clip).setLoop(THREE.LoopOnce).play().clampWhenFinished = true;
  const seen = times.map((time) => {
    mixer.setTime(time);
    return positions(root, nodes);
  });
  // The next clip begins from the pose of the file.
  mixer.stopAllAction();
  const begin = Math.min(...clip.tracks.map((track) => track.times[0]));
  return { begin: Number.isFinite(begin) ? begin : 0, end: clip.duration, positions: seen };
}

function positions(root, nodes) {
  root.updateMatrixWorld(true);
  return nodes.map(({ object }) => object.matrixWorld.elements.slice(12, 15));
}

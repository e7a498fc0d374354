// node vertices.mjs ONE=OTHER[=FACTOR] ...
//
// Reads pairs of files with three.js' own loaders and prints one JSON line for each: how far the vertices of their meshes are from each
// other, as skins, shapes and the first clip of each move them, at five times of it (the rest pose where there is none):
//   {"files", "vertices": [of the one, of the other], "size", "apart": the largest distance to the nearest vertex of the other file,
//    both ways, as a share of the size; 1 where there is none within a hundredth of it}
// Units of the one are FACTOR units of the other. A file that cannot be read has "error" instead.

import { THREE, ending, loadFbx, loadGltf } from "./loaders.mjs";

const TIMES = 5;

for (const pair of process.argv.slice(2)) {
  let answer;
  try {
    answer = { files: pair, ...(await compare(...pair.split("="))) };
  } catch (error) {
    answer = { files: pair, error: String(error?.stack ?? error) };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}

async function compare(one, other, factor = "1") {
  const here = await play(one, Number(factor));
  const there = await play(other, 1);
  const box = new THREE.Box3();
  for (const place of there[0]) box.expandByPoint(place);
  const sides = box.getSize(new THREE.Vector3());
  const size = Math.max(sides.x, sides.y, sides.z);
  let apart = 0;
  for (let time = 0; time < TIMES; time += 1) {
    apart = Math.max(apart, farthest(here[time], there[time], size), farthest(there[time], here[time], size));
  }
  return { vertices: [here[0].length, there[0].length], size, apart: apart / size };
}

// The places of all vertices, for each time.
async function play(file, factor) {
  const isFbx = ending(file) === "fbx";
  const loaded = isFbx ? await loadFbx(file) : await loadGltf(file);
  const root = isFbx ? loaded : loaded.scene;
  const [clip] = loaded.animations;
  const mixer = new THREE.AnimationMixer(root);
  if (clip) mixer.clipAction(clip).setLoop(THREE.LoopOnce).play().clampWhenFinished = true;
  return Array.from({ length: TIMES }, (_, index) => {
    mixer.setTime(((clip?.duration ?? 0) * index) / (TIMES - 1));
    root.updateMatrixWorld(true);
    return vertices(root, factor);
  });
}

function vertices(root, factor) {
  const places = [];
  root.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { index, attributes } = mesh.geometry;
    const used = index ? new Set(index.array) : attributes.position.array.keys();
    for (const vertex of used) {
      if (vertex >= attributes.position.count) break;
      const place = mesh.getVertexPosition(vertex, new THREE.Vector3());
      places.push(place.applyMatrix4(mesh.matrixWorld).multiplyScalar(factor));
    }
  });
  return places;
}

// The largest distance from one of these to the nearest of the others.
function farthest(these, others, size) {
  const cell = size / 200;
  const key = (x, y, z) => `${x},${y},${z}`;
  const cells = new Map();
  const of = (place) => [place.x, place.y, place.z].map((part) => Math.floor(part / cell));
  for (const place of others) {
    const at = key(...of(place));
    if (cells.has(at)) cells.get(at).push(place);
    else cells.set(at, [place]);
  }
  let largest = 0;
  for (const place of these) {
    const [x, y, z] = of(place);
    let nearest = size;
    for (let i = -1; i <= 1; i += 1) {
      for (let j = -1; j <= 1; j += 1) {
        for (let k = -1; k <= 1; k += 1) {
          for (const other of cells.get(key(x + i, y + j, z + k)) ?? []) {
            nearest = Math.min(nearest, place.distanceTo(other));
          }
        }
      }
    }
    largest = Math.max(largest, nearest);
  }
  return largest;
}

// node played.mjs FILE SECONDS ...
//
// Plays the first clip of a glTF with three.js and prints one JSON line:
//   {"duration", "rest": the vertices of all meshes as they are stored, [x, y, z] each, "frames": for each moment where they are}

import { THREE, loadGltf } from "./loaders.mjs";

const [file, ...moments] = process.argv.slice(2);
const { scene, animations } = await loadGltf(file);
const mixer = new THREE.AnimationMixer(scene);
mixer.clipAction(animations[0]).setLoop(THREE.LoopOnce).play().clampWhenFinished = true;

function vertices(place) {
  const places = [];
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    for (let vertex = 0; vertex < mesh.geometry.attributes.position.count; vertex += 1) {
      places.push(place(mesh, vertex).toArray());
    }
  });
  return places;
}

const rest = vertices((mesh, vertex) => new THREE.Vector3().fromBufferAttribute(mesh.geometry.attributes.position, vertex));
const frames = moments.map((moment) => {
  mixer.setTime(Number(moment));
  scene.updateMatrixWorld(true);
  return vertices((mesh, vertex) => mesh.getVertexPosition(vertex, new THREE.Vector3()).applyMatrix4(mesh.matrixWorld));
});
process.stdout.write(`${JSON.stringify({ duration: animations[0].duration, rest, frames })}\n`);

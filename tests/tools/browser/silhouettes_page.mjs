// Shows files as three.js does, and lays the outline over that of a picture.

import * as THREE from "three";
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";

// As the pictures: that many samples along each side of a pixel.
const SAMPLES = 2;

const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
const white = new THREE.MeshBasicMaterial({ color: 0xffffff, side: THREE.DoubleSide });

globalThis.overlaps = async ({ file, pictures }) => {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  loader.setDRACOLoader(new DRACOLoader().setDecoderPath("/three/examples/jsm/libs/draco/gltf/"));
  const { scene: figure, animations } = await loader.loadAsync(file);
  const scene = new THREE.Scene();
  scene.add(figure);
  scene.overrideMaterial = white;
  figure.traverse((node) => {
    node.frustumCulled = false;
    // What is wholly transparent is not seen.
    if (node.isMesh && node.material.transparent && node.material.opacity === 0) node.visible = false;
  });
  const mixer = new THREE.AnimationMixer(figure);
  if (animations[0]) mixer.clipAction(animations[0]).setLoop(THREE.LoopOnce).play().clampWhenFinished = true;
  const answers = [];
  for (const picture of pictures) {
    mixer.setTime(picture.seconds);
    answers.push(await overlap(scene, picture));
  }
  return answers;
};

async function overlap(scene, picture) {
  const given = await createImageBitmap(await (await fetch(picture.silhouette)).blob());
  const [width, height] = [given.width, given.height];
  const there = covered(pixels(given), width, height, 1);
  renderer.setSize(width * SAMPLES, height * SAMPLES, false);
  renderer.render(scene, camera(picture, width / height));
  const here = covered(pixels(renderer.domElement), width, height, SAMPLES);
  let [both, either] = [0, 0];
  for (let at = 0; at < here.length; at += 1) {
    both += Math.min(here[at], there[at]);
    either += Math.max(here[at], there[at]);
  }
  return either > 0 ? both / either : 1;
}

function camera({ eye, right, up, back, vertical_degrees: vertical }, aspect) {
  const far = 1e4 * Math.max(1, Math.hypot(...eye));
  const camera = new THREE.PerspectiveCamera(vertical, aspect, 1e-7 * far, far);
  const axes = [right, up, back, eye].map((axis) => new THREE.Vector3(...axis));
  camera.matrixAutoUpdate = false;
  camera.matrix.makeBasis(axes[0], axes[1], axes[2]).setPosition(axes[3]);
  camera.updateMatrixWorld(true);
  return camera;
}

function pixels(image) {
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d");
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.width, image.height).data;
}

// How much of each pixel is white, from so many samples along each of its sides.
function covered(data, width, height, samples) {
  const shares = new Float32Array(width * height);
  for (let row = 0; row < height * samples; row += 1) {
    for (let column = 0; column < width * samples; column += 1) {
      const at = Math.floor(row / samples) * width + Math.floor(column / samples);
      shares[at] += data[4 * (row * width * samples + column)] / 255 / (samples * samples);
    }
  }
  return shares;
}

globalThis.isReady = true;

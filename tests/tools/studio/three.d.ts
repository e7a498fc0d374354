// What `studio/vendor/three.js` exports, for the type checker; the entry of the bundle has the list.
export * from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
export { TransformControls } from "three/addons/controls/TransformControls.js";
export { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

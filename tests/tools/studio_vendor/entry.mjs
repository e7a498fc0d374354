// What the studio uses of three.js. Nothing else gets into the bundle.
export {
  AmbientLight, AnimationClip, AnimationMixer, Box3, BufferAttribute, BufferGeometry, CanvasTexture, CircleGeometry, Color, DirectionalLight,
  DoubleSide, DynamicDrawUsage, Float32BufferAttribute, Fog, Group, HemisphereLight, Line, LineBasicMaterial, LineSegments, Matrix4, Mesh,
  MeshBasicMaterial, MeshLambertMaterial, MeshStandardMaterial, Object3D, PerspectiveCamera, Plane, PlaneGeometry, Points, PointsMaterial,
  Quaternion, QuaternionKeyframeTrack, Raycaster, RingGeometry, Scene, Skeleton, SkinnedMesh, Sphere, SphereGeometry, Spherical, SRGBColorSpace, Texture,
  NumberKeyframeTrack, Timer, Vector2, Vector3, VectorKeyframeTrack, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
export { TransformControls } from "three/addons/controls/TransformControls.js";
export { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

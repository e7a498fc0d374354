// A file as it is shown: its nodes and meshes from the service's display GLB, moved by one clip.

import {
  AnimationMixer, Box3, Color, DoubleSide, Group, Mesh, MeshLambertMaterial, SkinnedMesh, SRGBColorSpace, Texture, Vector3, GLTFLoader,
} from "../vendor/three.js";
import { clipOf } from "./motion.js";

/** @typedef {import("../vendor/three.js").Object3D} Object3D */
/** @typedef {import("./motion.js").Motion} Motion */

/**
 * What the service tells of the file, in `extras.retargetd` of its scene.
 * @typedef {{clips: {name: string, frames: number, seconds: number, fps: number|null, moves: boolean}[], clip: string|null,
 *   key_times_seconds: number[]|null, floor_meters: number|null, front: [number, number, number], roles: Record<string, number[]>,
 *   triangles: number}} Facts
 */

/** Decodes images without a request, which the page's own security policy would not allow. */
class ImagePlugin {
  /** @param {any} parser */
  constructor(parser) {
    this.parser = parser;
    this.name = "studio_images";
  }

  /** @param {number} index */
  loadTexture(index) {
    const { textures, images } = this.parser.json;
    const image = images[textures[index].source];
    return this.parser.getDependency("bufferView", image.bufferView).then(async (/** @type {ArrayBuffer} */ bytes) => {
      const bitmap = await createImageBitmap(new Blob([bytes], { type: image.mimeType }));
      const texture = new Texture(/** @type {any} */ (bitmap));
      texture.flipY = false;
      texture.needsUpdate = true;
      texture.colorSpace = SRGBColorSpace;
      this.parser.associations.set(texture, { textures: index });
      return texture;
    });
  }
}

export class Figure {
  /**
   * @param {any} gltf
   */
  constructor(gltf) {
    /** @type {Facts} */
    this.facts = gltf.scene.userData.retargetd;
    this.group = new Group();
    this.group.add(gltf.scene);
    this.root = gltf.scene;
    /** @type {Object3D[]} by their index in the file */
    this.nodes = [];
    /** @type {Map<string, Object3D>} by what the API calls them */
    this.byLabel = new Map();
    /** @type {Mesh[]} */
    this.meshes = [];
    this.root.traverse((/** @type {any} */ object) => {
      const index = gltf.parser.associations.get(object)?.nodes;
      const label = object.userData.joint;
      if (label !== undefined && index !== undefined) {
        this.nodes[index] = object;
        this.byLabel.set(label, object);
      }
      if (object instanceof Mesh) this.meshes.push(object);
    });
    for (const mesh of this.meshes) plain(mesh);
    this.rest = this.nodes.map((node) => [node.position.clone(), node.quaternion.clone(), node.scale.clone()]);
    this.mixer = new AnimationMixer(this.root);
    /** @type {any} */
    this.action = null;
    this.root.updateMatrixWorld(true);
    this.box = this.measured();
    this.height = Math.max(this.box.max.y - this.box.min.y, 1e-3);
    this.floor = this.facts.floor_meters ?? this.box.min.y;
    const pelvis = this.joint("pelvis")?.getWorldPosition(new Vector3()).y ?? 0;
    /** What figures are compared by: how high they carry the body, else how high they are. */
    this.stature = pelvis - this.box.min.y > this.height * 0.2 ? (pelvis - this.box.min.y) * 2 : this.height;
    /** The clip of its own file. */
    this.clip = gltf.animations[0] ?? null;
    if (this.clip) this.play(this.clip);
  }

  /** Where its joints, and meshes, are at rest. */
  measured() {
    const box = new Box3();
    const place = new Vector3();
    const moved = Object.values(this.facts.roles).flat();
    for (const index of moved.length ? moved : this.nodes.keys()) {
      if (this.nodes[index]) box.expandByPoint(this.nodes[index].getWorldPosition(place));
    }
    for (const mesh of this.meshes) {
      if (mesh instanceof SkinnedMesh) mesh.computeBoundingBox();
      const own = mesh instanceof SkinnedMesh ? mesh.boundingBox : mesh.geometry.boundingBox;
      if (own && !own.isEmpty()) box.union(own.clone().applyMatrix4(mesh.matrixWorld));
    }
    return box.isEmpty() ? box.setFromCenterAndSize(new Vector3(0, 1, 0), new Vector3(1, 2, 1)) : box;
  }

  /** @param {any} clip */
  play(clip) {
    this.mixer.stopAllAction();
    if (this.action) this.mixer.uncacheClip(this.action.getClip());
    this.toRest();
    this.action = clip ? this.mixer.clipAction(clip) : null;
    this.action?.play();
  }

  /** @param {Motion} motion */
  move(motion) {
    this.play(clipOf(motion, ({ joint, node }) => {
      const own = this.nodes[node];
      return own && own.userData.joint === joint ? own : this.byLabel.get(joint) ?? own;
    }));
  }

  toRest() {
    this.nodes.forEach((node, index) => {
      const [position, quaternion, scale] = /** @type {any} */ (this.rest[index]);
      node.position.copy(position);
      node.quaternion.copy(quaternion);
      node.scale.copy(scale);
    });
  }

  /** @param {number} seconds */
  at(seconds) {
    if (!this.action) return;
    this.action.paused = false;
    this.action.time = Math.min(Math.max(seconds, 0), this.action.getClip().duration - 1e-6);
    this.action.paused = true;
    this.mixer.update(0);
  }

  get duration() {
    return this.action ? this.action.getClip().duration : 0;
  }

  /**
   * The first joint of a role.
   * @param {string} role
   * @returns {Object3D|undefined}
   */
  joint(role) {
    const index = this.facts.roles[role]?.[0];
    return index === undefined ? undefined : this.nodes[index];
  }

  /** The joint that the camera goes along with. */
  get center() {
    return this.joint("pelvis") ?? this.nodes[0];
  }

  dispose() {
    this.mixer.stopAllAction();
    for (const mesh of this.meshes) {
      mesh.geometry.dispose();
      const material = /** @type {any} */ (mesh.material);
      material.map?.dispose();
      material.dispose();
      if (mesh instanceof SkinnedMesh) mesh.skeleton.dispose();
    }
  }
}

/**
 * A material that is quick to draw, also in software.
 * @param {Mesh} mesh
 */
function plain(mesh) {
  const old = /** @type {any} */ (mesh.material);
  const { map, transparent, alphaTest, opacity, vertexColors } = old;
  const material = new MeshLambertMaterial({ map, transparent, alphaTest, opacity, vertexColors, side: DoubleSide });
  material.color = old.color ? old.color.clone() : new Color(0xcccccc);
  mesh.material = material;
  mesh.frustumCulled = false;
  old.dispose();
}

/**
 * @param {ArrayBuffer} bytes
 * @returns {Promise<Figure>}
 */
export async function readFigure(bytes) {
  const loader = new GLTFLoader();
  loader.register((parser) => /** @type {any} */ (new ImagePlugin(parser)));
  return new Figure(await loader.parseAsync(bytes, ""));
}

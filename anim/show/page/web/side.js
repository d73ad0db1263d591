// One file: its scene, its pose at a time, its nodes and their tracks.

import { AnimationMixer, DirectionalLight, Group, HemisphereLight, Scene } from "three";
import { lookOf } from "./materials.js";

export class Side {
  /** hidden: indices of nodes whose meshes are not shown. */
  constructor(gltf, about, hidden = []) {
    this.gltf = gltf;
    this.name = about.name;
    this.clips = gltf.animations;
    this.clipNames = (gltf.parser.json.animations ?? []).map((clip, i) => clip.name || `#${i}`);
    this.root = gltf.scene;
    this.scene = new Scene();
    this.overlay = new Group(); // skeleton, onion skins: drawn above the model
    const { VRM, VRMC_vrm } = gltf.parser.json.extensions ?? {};
    this.front = VRM && !VRMC_vrm ? -1 : 1; // figures look along -Z in VRM 0.x, along +Z else
    this.scene.add(this.root, this.overlay, ...lights(this.front));
    const meshes = [];
    this.root.traverse((object) => {
      object.name ||= object.uuid; // which clones, onion skins, find their tracks by
      if (object.isMesh) meshes.push(object);
    });
    for (const mesh of meshes) prepareMesh(mesh);
    for (const clip of this.clips) clip.tracks.forEach(normalizeRotations);
    this.nodes = nodesOf(gltf);
    this.owners = ownersOf(this.nodes); // node index by mesh
    this.numHidden = hidden.length;
    const without = new Set(hidden);
    const isHidden = (mesh) => without.has(this.owners.get(mesh));
    this.meshes = meshes.filter((mesh) => !isHidden(mesh));
    // Not by `visible`, which would hide the children of their nodes too
    for (const mesh of meshes.filter(isHidden)) mesh.layers.disableAll();
    this.mixer = new AnimationMixer(this.root);
    this.action = null;
  }

  get clip() {
    return this.action ? this.action.getClip() : null;
  }

  choose(clip) {
    this.mixer.stopAllAction();
    this.mixer.uncacheRoot(this.root);
    this.action = clip ? this.mixer.clipAction(clip).play() : null;
    this.tracks = clip ? tracksByNode(clip, this.nodes) : new Map();
  }

  /** Pose the model; time is set, never counted by the mixer, so that scrubbing repeats exactly. */
  pose(time) {
    if (this.action) {
      this.action.time = Math.min(time, this.clip.duration);
      this.mixer.update(0);
      // Ends of cubic splines, which three.js takes as stored
      for (const node of this.nodes.values()) node.object.quaternion.normalize();
    }
    this.root.updateMatrixWorld(true);
    for (const mesh of this.meshes) mesh.skeleton?.update();
  }
}

function lights(front) {
  const sun = new DirectionalLight(0xffffff, 2);
  const back = new DirectionalLight(0xbfd4ff, 0.7);
  sun.position.set(front, 2, 1.5 * front);
  back.position.set(-1.5 * front, 0.6, -1.5 * front);
  return [new HemisphereLight(0xffffff, 0x8a8478, 1.9), sun, back];
}

function prepareMesh(mesh) {
  mesh.frustumCulled = false; // three.js culls by the bounds at rest
  lookOf(mesh); // while the material is its own
  for (const material of [mesh.material].flat()) {
    // Metal is black without surroundings, and those cost seconds on software GL
    if ("metalness" in material) material.metalness = 0;
    if (material.transmission > 0) Object.assign(material, { transmission: 0, transparent: true, opacity: 0.4 });
  }
}

/** Nodes by index of the file: object, name, parent and depth; those outside the scene are left out. */
function nodesOf(gltf) {
  const json = gltf.parser.json.nodes ?? [];
  const nodes = new Map();
  const visit = (object, parent, depth) => {
    const index = gltf.parser.associations.get(object)?.nodes;
    const isNode = index !== undefined && !nodes.has(index);
    if (isNode) nodes.set(index, { index, object, name: json[index].name || `node ${index}`, parent, depth });
    for (const child of object.children) visit(child, isNode ? index : parent, isNode ? depth + 1 : depth);
  };
  visit(gltf.scene, null, 0);
  const joints = new Set((gltf.parser.json.skins ?? []).flatMap((skin) => skin.joints));
  for (const node of nodes.values()) {
    node.isJoint = joints.has(node.index);
    const { position, quaternion, scale } = node.object;
    node.rest = { translation: position.clone(), rotation: quaternion.normalize().clone(), scale: scale.clone() };
  }
  return nodes;
}

/**
 * Divide keys of rotations by their length, as glTF means them and `diff` measures them. three.js plays them as stored:
 * quantized ones then scale what is below by some 1e-4, which adds up along the skeleton.
 */
function normalizeRotations(track) {
  if (!track.name.endsWith(".quaternion") || isCubic(track)) return;
  track.stored = track.values;
  track.values = track.values.slice();
  for (let k = 0; k < track.values.length; k += 4) {
    const length = Math.hypot(...track.values.subarray(k, k + 4)) || 1;
    for (let c = k; c < k + 4; c++) track.values[c] /= length;
  }
}

export function isCubic(track) {
  return Boolean(track.createInterpolant.isInterpolantFactoryMethodGLTFCubicSpline);
}

function ownersOf(nodes) {
  const indices = new Map([...nodes.values()].map((node) => [node.object, node.index]));
  const owners = new Map();
  for (const { object, index } of nodes.values()) {
    const visit = (each) => {
      if (each.isMesh) owners.set(each, index);
      for (const child of each.children) if (!indices.has(child)) visit(child);
    };
    visit(object);
  }
  return owners;
}

/** Tracks of a clip by node index. three.js names tracks by the object: of a node, or of one of its meshes. */
function tracksByNode(clip, nodes) {
  const owner = new Map();
  for (const node of nodes.values()) {
    const add = (object) => {
      if (object !== node.object && [...nodes.values()].some((other) => other.object === object)) return;
      if (!owner.has(object.name)) owner.set(object.name, node.index);
      owner.set(object.uuid, node.index);
    };
    add(node.object);
    for (const child of node.object.children) if (child.isMesh) add(child);
  }
  const found = new Map();
  for (const track of clip.tracks) {
    const dot = track.name.lastIndexOf(".");
    const index = owner.get(track.name.slice(0, dot));
    if (index === undefined) continue;
    const path = PATHS[track.name.slice(dot + 1)];
    const list = found.get(index) ?? found.set(index, []).get(index);
    if (!list.some((each) => each.path === path)) list.push({ path, track });
  }
  return found;
}

const PATHS = {
  position: "translation",
  quaternion: "rotation",
  scale: "scale",
  morphTargetInfluences: "weights",
};

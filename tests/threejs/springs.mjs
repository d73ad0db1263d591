// node springs.mjs THREE FILE [cured] < TASK.json: local rotations of spring joints as three-vrm plays them; JSON.
// TASK: {"dt": s, "nodes": {"3": {"position": [[x, y, z], …], "quaternion": [[x, y, z, w], …]}}}, a driver pose per frame.
// Two faults of three-vrm 3.5.5 are cured from outside with `cured`, see tests/anim/simulation/spring_bones/plain_loop.py.
import { readFileSync } from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { library } from "./load.mjs";

globalThis.self ??= globalThis;

const [folder, file, cured] = process.argv.slice(2);
const task = JSON.parse(readFileSync(0));
const { three, GLTFLoader } = await library(folder);
const springs = path.join(folder, "..", "@pixiv", "three-vrm-springbone", "lib", "three-vrm-springbone.module.js");
const { VRMSpringBoneLoaderPlugin } = await import(pathToFileURL(springs));

const loader = new GLTFLoader();
loader.register((parser) => new VRMSpringBoneLoaderPlugin(parser));
const gltf = await loader.parseAsync(withoutImages(readFileSync(file)), "");
const manager = gltf.userData.vrmSpringBoneManager;
const number = (object) => gltf.parser.associations.get(object)?.nodes;
const nodes = new Map();
gltf.scene.traverse((object) => number(object) !== undefined && !nodes.has(number(object)) && nodes.set(number(object), object));
gltf.scene.updateMatrixWorld(true);
if (cured) for (const joint of manager.joints) cure(joint);
manager.setInitState();

pose(0);
manager.reset();
gltf.scene.updateMatrixWorld(true);
const joints = [...manager.joints].map((joint) => joint.bone);
const count = Math.max(...Object.values(task.nodes).map((each) => (each.position ?? each.quaternion).length));
const frames = [];
for (let frame = 0; frame < count; frame++) {
  pose(frame);
  manager.update(task.dt);
  frames.push(joints.map((bone) => bone.quaternion.toArray()));
}
process.stdout.write(JSON.stringify({ nodes: joints.map(number), frames }));

function pose(frame) {
  for (const [node, { position, quaternion }] of Object.entries(task.nodes)) {
    if (position) nodes.get(Number(node)).position.fromArray(position[frame]);
    if (quaternion) nodes.get(Number(node)).quaternion.fromArray(quaternion[frame]);
  }
  gltf.scene.updateMatrixWorld(true);
}

// The length is that to the tail after the joint's parents have turned; a tail below skipped nodes is where it is.
function cure(joint) {
  if (!joint.child) return;
  const measure = joint._calcWorldSpaceBoneLength;
  joint._calcWorldSpaceBoneLength = function () {
    follow(this.child, this.bone);
    measure.call(this);
  };
  const init = joint.setInitState;
  joint.setInitState = function () {
    init.call(this);
    const tail = this.bone.worldToLocal(new three.Vector3().setFromMatrixPosition(this.child.matrixWorld));
    this._initialLocalChildPosition.copy(tail);
    this._boneAxis.copy(tail).normalize();
  };
}

// The world matrices of an object and of its parents up to an ancestor, whose own is up to date.
function follow(object, ancestor) {
  if (object === ancestor) return;
  follow(object.parent, ancestor);
  object.matrixWorld.multiplyMatrices(object.parent.matrixWorld, object.matrix);
}

// There is no DOM: no images, textures and materials.
function withoutImages(bytes) {
  const length = bytes.readUInt32LE(12);
  const json = JSON.parse(bytes.toString("utf8", 20, 20 + length));
  for (const key of ["images", "textures", "samplers", "materials"]) delete json[key];
  for (const mesh of json.meshes ?? []) for (const each of mesh.primitives) delete each.material;
  let text = Buffer.from(JSON.stringify(json));
  text = Buffer.concat([text, Buffer.alloc(-text.length & 3, " ")]);
  const rest = bytes.subarray(20 + length);
  const head = Buffer.alloc(20);
  [0x46546c67, 2, 20 + text.length + rest.length, text.length, 0x4e4f534a].forEach((each, i) => head.writeUInt32LE(each, 4 * i));
  const whole = Buffer.concat([head, text, rest]);
  return whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length);
}

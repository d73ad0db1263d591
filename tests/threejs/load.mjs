// A glTF file as three.js loads it: nodes by their number, clips, and what the loader leaves out. No DOM, no textures.
import { readFile } from "node:fs/promises";
import path from "node:path";
import { pathToFileURL } from "node:url";

const GLB = 0x46546c67; // "glTF"
const JSON_CHUNK = 0x4e4f534a;

globalThis.ProgressEvent ??= class extends Event {}; // three tells of progress when it reads a data URI

// Returns three's modules from the package in `folder`.
export async function library(folder) {
  const from = (place) => import(pathToFileURL(path.join(folder, place)));
  const three = await from("build/three.module.js");
  const { GLTFLoader } = await from("examples/jsm/loaders/GLTFLoader.js");
  const { MeshoptDecoder } = await from("examples/jsm/libs/meshopt_decoder.module.js");
  await MeshoptDecoder.ready;
  return { three, GLTFLoader, MeshoptDecoder };
}

// Returns {root, nodes, names, clips, ignored} of the default scene; nodes[i] is undefined where the scene has it not.
export async function open({ three, GLTFLoader, MeshoptDecoder }, file) {
  const data = await readFile(file);
  const { json, rest } = split(data);
  for (const buffer of json.buffers ?? []) {
    if (buffer.uri && !buffer.uri.startsWith("data:")) buffer.uri = await inlined(path.dirname(file), buffer.uri);
  }
  const loader = new GLTFLoader();
  loader.setMeshoptDecoder(MeshoptDecoder);
  loader.register(() => ({ name: "no textures", loadTexture: async () => new three.Texture() }));
  const gltf = await loader.parseAsync(rest ? glb(json, rest) : JSON.stringify(json), "");
  const nodes = new Array(json.nodes?.length ?? 0);
  for (const [object, place] of gltf.parser.associations) {
    if (object.isObject3D && place.nodes !== undefined) nodes[place.nodes] = object;
  }
  const names = (json.nodes ?? []).map((node) => node.name ?? "");
  return { root: gltf.scene, nodes, names, clips: gltf.animations, ignored: ignored(json) };
}

// three's loader plays no pointers, and four influences a vertex at most.
function ignored(json) {
  const found = [];
  for (const [number, animation] of (json.animations ?? []).entries()) {
    for (const { target } of animation.channels) {
      const pointer = target.extensions?.KHR_animation_pointer?.pointer;
      if (target.node === undefined) found.push({ clip: animation.name ?? `animation_${number}`, pointer: pointer ?? "" });
    }
  }
  const wide = (json.meshes ?? []).some((mesh) => mesh.primitives.some((one) => "JOINTS_1" in one.attributes));
  if (wide) found.push({ clip: "", pointer: "JOINTS_1" });
  return found;
}

function split(data) {
  if (data.length < 20 || data.readUInt32LE(0) !== GLB) return { json: JSON.parse(data.toString("utf8")), rest: null };
  const length = data.readUInt32LE(12);
  return { json: JSON.parse(data.toString("utf8", 20, 20 + length)), rest: data.subarray(20 + length) };
}

function glb(json, rest) {
  let text = Buffer.from(JSON.stringify(json));
  text = Buffer.concat([text, Buffer.alloc(-text.length & 3, " ")]);
  const head = Buffer.alloc(20);
  [GLB, 2, 20 + text.length + rest.length, text.length, JSON_CHUNK].forEach((each, i) => head.writeUInt32LE(each, 4 * i));
  const whole = Buffer.concat([head, text, rest]);
  return whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length);
}

async function inlined(folder, uri) {
  const bytes = await readFile(path.join(folder, decodeURIComponent(uri)));
  return `data:application/octet-stream;base64,${bytes.toString("base64")}`;
}

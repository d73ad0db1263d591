// node vertices.mjs THREE FILE CLIP TIME: all vertices of the scene at a time of a clip, in the order in which three.js
// meets them, in world space, as float32 x, y, z on stdout.
import { library, open } from "./load.mjs";
import { player, resting } from "./play.mjs";

const [folder, file, clip, time] = process.argv.slice(2);
const modules = await library(folder);
const scene = await open(modules, file);
player(modules.three, scene, resting(scene), scene.clips[Number(clip)])(Number(time));

const found = [];
const place = new modules.three.Vector3();
scene.root.traverse((object) => {
  if (!object.geometry) return;
  if (object.isSkinnedMesh) object.skeleton.update();
  const { position } = object.geometry.attributes;
  for (let i = 0; i < position.count; i++) {
    const own = object.isMesh ? object.getVertexPosition(i, place) : place.fromBufferAttribute(position, i); // points
    own.applyMatrix4(object.matrixWorld);
    found.push(place.x, place.y, place.z);
  }
});
process.stdout.write(Buffer.from(new Float32Array(found).buffer));

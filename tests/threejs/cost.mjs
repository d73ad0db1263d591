// Usage: cost.mjs THREE_FOLDER FILE CLIP: milliseconds to load, to bind and to update a clip, as one JSON line.
import { library, open } from "./load.mjs";

const [folder, file, name] = process.argv.slice(2);
const FRAMES = 200;
const modules = await library(folder);
const began = performance.now();
const { root, clips } = await open(modules, file);
const loaded = performance.now();
const { three } = modules;
const mixer = new three.AnimationMixer(root);
const action = mixer.clipAction(clips.find((clip) => clip.name === name)).play();
const skeletons = new Set();
let draws = 0;
root.traverse((object) => {
  if (object.isMesh) draws += 1;
  if (object.isSkinnedMesh) skeletons.add(object.skeleton);
});
const update = (time) => {
  action.time = time;
  mixer.update(0);
  root.updateMatrixWorld();
  for (const skeleton of skeletons) skeleton.update(); // as the renderer does, once a frame
};
update(0);
const bound = performance.now();
const end = action.getClip().duration;
for (let i = 0; i < FRAMES; i++) update((end * i) / FRAMES); // warms up the compiler
const taken = [];
for (let i = 0; i < FRAMES; i++) {
  const start = performance.now();
  update((end * i) / FRAMES);
  taken.push(performance.now() - start);
}
taken.sort((a, b) => a - b);
console.log(JSON.stringify({ load: loaded - began, bind: bound - loaded, frame: taken[FRAMES / 2], draws }));

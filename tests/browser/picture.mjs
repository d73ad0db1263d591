// node picture.mjs PLAYWRIGHT CHROMIUM THREE TASK: pictures of glTF and USD files by three.js in Chromium.
//
// TASK is JSON: a list of {file, out, time, clip, center, size}; each file is drawn at a time of a clip (an index, null
// for none) by a camera that sees a box of this center and size (m), into the PNG file `out`.
import { createReadStream, existsSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { dirname, extname, join, normalize } from "node:path";
import { pathToFileURL } from "node:url";
import { CHROMIUM_ARGS } from "./drivers.mjs";

const [playwright, executablePath, three, task] = process.argv.slice(2);
const { chromium } = (await import(pathToFileURL(join(playwright, "index.js")))).default;
const TYPES = { ".js": "text/javascript", ".html": "text/html" };
const PAGE = `<!doctype html><body style="margin:0"><script type="importmap">
{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { USDLoader } from "three/addons/loaders/USDLoader.js";
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(512, 512);
document.body.append(renderer.domElement);
window.draw = async ({ url, time, clip, center, size }) => {
  const isUsd = /\\.usd[acz]?$/.test(url);
  const loaded = await new (isUsd ? USDLoader : GLTFLoader)().loadAsync(url);
  const model = isUsd ? loaded : loaded.scene;
  const clips = (isUsd ? loaded.animations : loaded.animations) ?? [];
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xffffff);
  scene.add(model, new THREE.HemisphereLight(0xffffff, 0x888888, 3));
  if (clip !== null && clips.length) {
    const mixer = new THREE.AnimationMixer(model);
    mixer.clipAction(clips[Math.min(clip, clips.length - 1)]).play();
    mixer.setTime(time);
  }
  const camera = new THREE.PerspectiveCamera(35, 1, size / 100, size * 10);
  camera.position.set(center[0] + size, center[1] + 0.5 * size, center[2] + 1.4 * size);
  camera.lookAt(...center);
  model.traverse((each) => (each.frustumCulled = false));
  await new Promise((done) => setTimeout(done, 300));  // images of USD load later
  renderer.render(scene, camera);
  return { clips: clips.map((each) => [each.name, each.duration]), picture: renderer.domElement.toDataURL("image/png") };
};
document.documentElement.dataset.ready = "yes";
</script>`;

const jobs = JSON.parse(task);
const server = createServer((request, response) => {
  const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  const [, kind, ...rest] = path.split("/");
  const folder = kind === "three" ? three : jobs[Number(kind)] ? dirname(jobs[Number(kind)].file) : null;
  if (path === "/") return response.writeHead(200, { "content-type": "text/html" }).end(PAGE);
  const file = folder && join(folder, normalize(`/${rest.join("/")}`));
  if (!file || !existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream" });
  createReadStream(file).pipe(response);
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const browser = await chromium.launch({ executablePath, args: CHROMIUM_ARGS });
const words = [];
try {
  const page = await browser.newPage({ viewport: { width: 512, height: 512 } });
  page.on("console", (message) => words.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => words.push(`error: ${error.stack}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction(() => document.documentElement.dataset.ready, null, { timeout: 60000 });
  const found = [];
  for (const [i, { file, out, ...job }] of jobs.entries()) {
    const url = `/${i}/${encodeURIComponent(file.split("/").at(-1))}`;
    const { clips, picture } = await page.evaluate((told) => window.draw(told), { ...job, url });
    writeFileSync(out, Buffer.from(picture.split(",")[1], "base64"));
    found.push({ file, clips });
  }
  process.stdout.write(JSON.stringify({ found, words }));
} finally {
  await browser.close();
  server.close();
}

// node visit.mjs TASK: tries pages in a browser, with keys and scrubber; in Chromium also by touch on a phone.
//
// TASK is JSON: {engine, library, executable, shots, files}. Writes a JSON list on stdout, for each page {file, ready_ms,
// words, faults, worst}: console messages and requests, checks that failed, and of two files [{clip, time, error}] at
// the times that the page names as the worst. shots: folder for a picture of each page, "" for none.
// Exit code 3: the browser does not start, or has no WebGL.
import { basename, join } from "node:path";
import { launch } from "./drivers.mjs";

const { engine, library, executable, shots, files } = JSON.parse(process.argv[2]);
const READY_MS = 600000; // software GL under load takes minutes for some shaders
const READY = "document.documentElement.dataset.ready || document.documentElement.dataset.error || ''";
// What a link to the page shows
const STATE = `(({ clip, node, show, side, unit, speed, loop, heatScale, tab, sort }) => JSON.stringify([clip, node,
  [...show].sort(), side, unit, speed, loop, heatScale.toPrecision(6), tab, sort, player.stage.cameraText]))(player.state)`;
const PIN = `(() => {
  const spot = player.stage.project(player.worst().point, player.sides[1]);
  const [x, y] = document.querySelector("#pin").style.transform.match(/-?[\\d.]+/g).map(Number);
  return !spot || Math.hypot(spot.x - x, spot.y - y) < 1;
})()`;
const DIRECTION = "player.stage.camera.position.clone().sub(player.stage.controls.target)";
// Canvases of curves and scrubber begin and end at the same pixels
const AXES = `(() => {
  const [one, other] = ["#curves canvas", "#scrub canvas"].map((each) => document.querySelector(each).getBoundingClientRect());
  return document.querySelector("footer").checkVisibility() ? one.left === other.left && one.right === other.right : true;
})()`;
// The panel of curves names a node that moves the same in both files, and none with another track or rest pose
const EQUAL = `(() => {
  const [a, b] = player.sides;
  const isNamed = () => (player.update({ node: null }), player.update({ node }), !document.querySelector("#curves-equal").hidden);
  const isSkinned = (node) => a.meshes.some((mesh) => mesh.isSkinnedMesh && a.owners.get(mesh) === node);
  const isFit = ([node, tracks]) => !isSkinned(node) && tracks.every(({ path }) => path !== "weights") &&
    [...b.nodes.values()].find(({ name }) => name === a.nodes.get(node).name)?.index === node;
  const [node, tracks] = [...a.tracks].find(isFit) ?? [null];
  const own = [player.state.node, b.tracks];
  if (node === null || !player.isPaired) return !a.nodes.size || a.tracks.size < 2 || b.tracks.size < 2;
  const rests = [b.nodes.get(node).rest, { ...a.nodes.get(node).rest }];
  b.tracks = new Map(a.tracks);
  b.nodes.get(node).rest = rests[1];
  const found = [isNamed()];
  const [{ path, track }] = tracks;
  const changed = track.clone();
  changed.createInterpolant = track.createInterpolant; // of cubic splines, which clones lack
  changed.values = track.values.map((value, i) => value + (i % 2));
  b.tracks.set(node, [{ path, track: changed }, ...tracks.slice(1)]);
  found.push(isNamed());
  b.tracks.set(node, tracks.slice(1));
  rests[1][path] = rests[1][path].clone().set(...(path === "rotation" ? [0.6, 0, 0, 0.8] : [7, 7, 7]));
  found.push(isNamed());
  [b.nodes.get(node).rest, b.tracks] = [rests[0], own[1]];
  player.update({ node: own[0] });
  return found.join() === "true,false,false";
})()`;
const NO_ENGINE = 3; // exit code
const browser = await launch(engine, { library, executable }).catch((error) => leave(error.stack ?? error));

function leave(reason) {
  process.stderr.write(`${engine} does not start: ${reason}`);
  process.exit(NO_ENGINE);
}

async function until(page, code) {
  const end = Date.now() + READY_MS;
  while (!(await page.run(code))) {
    if (Date.now() > end) throw new Error(`not within ${READY_MS} ms: ${code}`);
    await new Promise((done) => setTimeout(done, 20));
  }
}

async function open(file, hash, isPhone = false) {
  const began = Date.now();
  const page = await browser.open(file, hash, isPhone);
  await until(page, READY);
  return { page, ms: Date.now() - began };
}

async function tryDesktop(file, faults) {
  const { page, ms } = await open(file, `#t=0&show=&list=${encodeURIComponent(`x"], '`)}`);
  const { words } = page;
  const expect = (isTrue, fault) => isTrue || faults.push(fault);
  const get = page.run;
  const near = async (expected, what) => {
    const got = await get("player.state.time");
    expect(Math.abs(got - expected) < 2e-3, `${what}: ${got} instead of ${expected}`);
  };
  const drawn = async () => until(page, `player.frames > ${await get("player.frames")} + 1`);
  const press = async (key) => {
    await page.press(key);
    await drawn(); // counted from here: the page may have drawn between the question and the key
  };
  const error = await get("document.documentElement.dataset.error ?? ''");
  if (/WebGL/.test(error)) await browser.close().then(() => leave(error));
  expect(!error, `does not load: ${error}`);
  expect(await get(`document.querySelector("#loading").hidden`), "says that it loads, though it is shown");
  const duration = await get("player.duration");
  const clips = await get("player.sides[0].clips.length");
  expect(!(await get("player.stage.cameraText")), "the address has no camera before it moves");
  if (clips) {
    const at = (seconds) => Math.min(seconds, duration);
    await press("ArrowRight");
    await near(at(1 / 30), "ArrowRight");
    await press("Shift+ArrowRight");
    await near(at(at(1 / 30) + 1 / 3), "Shift+ArrowRight");
    await press("ArrowLeft");
    await press("Home");
    await near(0, "Home");
    const keys = await get("player.keys");
    await press(".");
    await near(keys.find((key) => key > 1e-5) ?? duration, "next key");
    await press(",");
    await press("End");
    await near(duration, "End");
    await press("Home");
    await press(" ");
    await until(page, "player.state.time > 0");
    await press("o");
    await until(page, `location.hash.includes("onion")`); // during playback
    await press("o");
    await press(" ");
    expect(!(await get("player.state.playing")), "pauses");
    await press("Home"); // a click on the thumb, had playback led it to the center, would not move it
    await page.click("#scrub input"); // its center
    const middle = await get("player.state.time / player.duration");
    expect(Math.abs(middle - 0.5) < 0.01, `scrubber: ${middle} instead of the middle`);
    await press("Home");
    const clip = await get("player.state.clip");
    await press("n");
    expect((await get("player.state.clip")) === (clip + 1) % clips, "next clip");
    expect(Boolean(await get("player.stage.cameraText")) === clips > 1, "the address has the camera beside another clip");
    await press("p");
    expect((await get("player.state.clip")) === clip, "clip before");
    expect(!(await get("player.stage.cameraText")), "the address has no camera beside the clip that it frames");
  }
  const listed = await get(`document.querySelectorAll("[data-clip]").length`);
  if (await get(`document.querySelector("#list-clips input") !== null`)) {
    await page.click("#tab-clips");
    const first = await get("player.state.clip");
    const names = await get("player.sides[0].clipNames");
    const shown = `[...document.querySelectorAll("[data-clip]")].filter((row) => row.checkVisibility())`;
    await press("/");
    await press(names.at(-1)[0]);
    const wanted = names.filter((name) => name.toLowerCase().includes(names.at(-1)[0].toLowerCase()));
    expect((await get(`${shown}.length`)) === wanted.length, "the filter leaves the clips with these letters");
    await press("Enter");
    expect(wanted.includes(names[await get("player.state.clip")]), "Enter chooses a clip");
    await press("ArrowDown");
    expect(await get(`document.activeElement === ${shown}[0]`), "the arrow leads from the filter to the list");
    await press("ArrowUp");
    await press("Escape");
    expect((await get(`${shown}.length`)) === listed, "Escape ends the filter");
    await press("Escape");
    await get(`player.update({ sort: "duration" })`);
    expect((await get(`document.querySelector("#list-clips").scrollTop`)) === 0, "a sorted list begins at its top");
    const lengths = await get(`${shown}.map((row) => player.sides[0].clips[row.dataset.clip].duration)`);
    expect(lengths.every((length, i) => !i || length <= lengths[i - 1]), "clips by duration");
    await get(`(player.update({ sort: "" }), player.chooseClip(${first}), true)`);
  }
  const hasNodes = await get(`document.querySelector("#show-bones").checkVisibility()`);
  expect(hasNodes || !(await get(`document.querySelector("#show-curves").checkVisibility()`)), "curves without nodes");
  const shows = { w: "wire", o: "onion", c: "clay", ...(hasNodes ? { s: "bones", g: "curves" } : {}) };
  for (const [key, name] of Object.entries(shows)) {
    await press(key);
    expect(await get(`player.state.show.has("${name}")`), `${key} shows ${name}`);
    await press(key);
    expect(!(await get(`player.state.show.has("${name}")`)), `${key} hides ${name}`);
  }
  const units = hasNodes ? [["u", "unit", "values"]] : [];
  for (const [key, name, value] of [["l", "loop", "once"], ...units, ["-", "speed", 0.5], ["+", "speed", 1]]) {
    await press(key);
    expect((await get(`player.state.${name}`)) === value, `${key}: ${name}`);
  }
  if (hasNodes) {
    await press("g");
    expect(await get(AXES), "curves and scrubber have one time axis");
    await page.click("#unit-values");
    expect((await get("player.state.unit")) === "values", "unit");
    await page.click("#unit-degrees");
    await press("g");
  }
  await press("d");
  expect((await get("document.documentElement.dataset.theme")) === "dark", "dark");
  for (const [key, axis] of [["1", 2], ["3", 0], ["7", 1]]) {
    await press(key);
    expect(await get(`${DIRECTION}.normalize().toArray()[${axis}] > 0.999`), `${key} looks along axis ${axis}`);
  }
  const distance = await get(`${DIRECTION}.length()`);
  await press("PageUp");
  expect((await get(`${DIRECTION}.length()`)) < 0.9 * distance, "nearer");
  await press("PageDown");
  await press("f");
  expect(!(await get("player.stage.cameraText")), "F frames everything");
  await press("?");
  expect((await get(`document.querySelectorAll("dialog[open] kbd").length`)) > 18, "sheet of keys");
  await press("Escape");
  expect(!(await get(`document.querySelectorAll("dialog[open]").length`)), "sheet closes");
  if (await get(`document.querySelectorAll("[data-node]").length`)) {
    await page.click("#tab-nodes");
    await page.click("[data-node]");
    expect((await get("player.state.node")) !== null, "chooses a node");
    await press("f");
    expect((await get("player.framed")) === (await get("player.state.node")), "F frames the node");
    await press("f");
    expect((await get("player.framed")) === null, "F again frames everything");
    expect(await get("document.activeElement === document.body"), "the space bar plays after a click in a list");
  }
  if (await get("player.sides.length > 1")) {
    await press("h");
    expect(await get(`player.state.show.has("heat")`), "heat");
    for (const side of ["a", "b", "over", "both"]) {
      await press("b");
      expect((await get("player.state.side")) === side, `side ${side}`);
    }
    for (const side of ["over", "both"]) {
      await press("v");
      expect((await get("player.state.side")) === side, `v: side ${side}`);
    }
    expect(await get(PIN), "the ring is on the worst vertex");
    expect(await get(EQUAL), "names the parents of a node with equal curves");
    const scale = await get("player.state.heatScale");
    await press("]");
    expect((await get("player.state.heatScale")) === 2 * scale, "scale of heat");
    await press("[");
  }
  const worst = await get(`(facts => player.sides.length < 2 ? [] : facts.panels.flatMap(panel => panel.rows)
    .filter(row => row.link).map(({link}) => {
      player.follow(link);
      return {clip: link.clip, time: link.time, error: player.worst().error};
    }))(JSON.parse(document.getElementById("facts").textContent))`);
  await get("(player.stage.camera.position.multiplyScalar(1.2), player.stage.controls.update(), true)");
  expect(await get("player.stage.cameraText.split(',').length === 6"), "the address has the camera");
  await until(page, "location.hash === player.address()");
  const hash = await get("location.hash");
  const [shown, time] = [await get(STATE), await get("player.state.time")];
  await page.close();
  const again = await open(file, hash);
  expect((await again.page.run(STATE)) === shown, `not the same from its address: ${hash}`);
  const there = await again.page.run("player.state.time");
  expect(Math.abs(there - time) < 1e-3, `at ${there} s instead of ${time} s from its address`);
  await again.page.close(); // some drivers know of requests only then
  words.push(...again.page.words);
  return { words, ready_ms: ms, worst };
}

/** Keep a picture of the page in the middle of its first clip, or at its largest error. */
async function keepPicture(file) {
  const { page } = await open(file, "");
  await page.run(`(player.sides.length < 2 && player.update({ playing: false, time: player.duration / 2 }), true)`);
  const before = await page.run("player.frames");
  await until(page, `player.frames > ${before} + 1`);
  await page.shot(join(shots, basename(file).replace(/html$/, `${engine}.png`)));
  await page.close();
}

async function tryPhone(file, faults) {
  const { page } = await open(file, "", true);
  const expect = (isTrue, fault) => isTrue || faults.push(`phone: ${fault}`);
  const get = page.run;
  expect(!(await get("player.state.playing")), "moves under reduced motion");
  expect(await get("document.documentElement.scrollWidth <= innerWidth"), "scrolls sideways");
  if (await get(`document.querySelector("#pin").checkVisibility()`)) {
    expect(await get(`document.querySelector("#pin b").getBoundingClientRect().right <= innerWidth`), "the error is cut off");
  }
  if (await get(`player.sides.length > 1 && document.querySelector("#list-report [data-link]") !== null`)) {
    expect(await get(`document.querySelector("#list-report [aria-current]") !== null`), "marks the error that it shows");
  }
  await page.click("#menu");
  const clips = await get(`document.querySelectorAll("[data-clip]").length`);
  if (clips) {
    await page.click("#tab-clips");
    await page.click(`[data-clip="${clips - 1}"]`);
    expect((await get("player.state.clip")) === clips - 1, "taps a clip");
    expect(await get(`document.querySelector("#clip-name").checkVisibility()`), "names the clip");
    if (await get(`document.querySelectorAll("[data-node]").length`)) {
      await page.click("#menu");
      await page.click("#tab-nodes");
      await page.click("[data-node]");
      expect(!(await get(`document.querySelector("#side").checkVisibility()`)), "the list closes behind a node");
      await page.click("#show-curves");
    }
    if (await get("player.state.playing")) await page.click("#play");
    expect(!(await get("player.state.playing")), "taps pause");
  } else await page.click("#menu");
  if (await get(`document.querySelector("#show-bones").checkVisibility()`)) {
    if (!(await get(`player.state.show.has("bones")`))) await page.click("#show-bones");
    expect(await get(`player.state.show.has("bones")`), "taps skeleton");
  }
  await page.click("#menu");
  for (const tab of await get(`[...document.querySelectorAll("[data-tab]")].map((each) => each.id)`)) {
    await page.click(`#${tab}`);
    const small = await get(`[...document.querySelectorAll("button, select, summary, input")]
      .filter(each => each.checkVisibility() && each.getBoundingClientRect().height < 44)
      .map(each => each.id || each.textContent)`);
    expect(!small.length, `smaller than 44 px in ${tab}: ${small}`);
    expect(await get("document.documentElement.scrollWidth <= innerWidth"), `scrolls sideways in ${tab}`);
  }
  await page.close();
  return page.words;
}

const found = [];
for (const file of files) {
  const faults = [];
  try {
    const { words, ready_ms, worst } = await tryDesktop(file, faults);
    if (engine === "chromium") words.push(...(await tryPhone(file, faults)));
    if (shots) await keepPicture(file);
    found.push({ file, ready_ms, words, faults, worst });
  } catch (error) {
    found.push({ file, ready_ms: null, words: [], faults: [...faults, String(error)], worst: [] });
  }
}
await browser.close();
process.stdout.write(JSON.stringify(found), () => process.exit(0)); // whatever a driver left running

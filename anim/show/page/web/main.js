// The page of `gltf-anim view`: loads the files in it, and connects state, picture, timeline and lists.

import { Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import { Bones } from "./bones.js";
import { Curves } from "./curves.js";
import { facts, readFile } from "./data.js";
import { $, setPressed } from "./dom.js";
import { formatLength, formatTime, roundUp } from "./format.js";
import { GRADIENT, MAX_LIVE_VERTICES, countVertices, measure, nodeColors, paint, pairMeshes } from "./heat.js";
import { listenToKeys, openSheet } from "./keyboard.js";
import { applyMaterials } from "./materials.js";
import { Onion } from "./onion.js";
import { fillSidebar, markClip, markNode, scrollToClip } from "./sidebar.js";
import { Side } from "./side.js";
import { Stage } from "./stage.js";
import {
  LOOPS,
  SHOWS,
  SIDES,
  SPEEDS,
  cycle,
  onChange,
  readHash,
  state,
  toggleShow,
  update,
  writeHash,
} from "./state.js";
import { Timeline } from "./timeline.js";

const STEP_S = 1 / 30;
const KEY_TOLERANCE_S = 1e-5;
const MAX_TICK_S = 0.1; // of the clock between two pictures, after the tab was hidden
const MAX_PICK_PX = 18;
const HEAT_PER_DIAGONAL = 0.01; // scale of heat where no error is known

class Player {
  constructor(sides) {
    this.sides = sides;
    this.stage = new Stage($("#view canvas"), sides);
    this.extras = sides.map((side) => ({ bones: new Bones(side), onion: new Onion(side) }));
    this.pairs = pairMeshes(sides);
    this.isLive = countVertices(this.pairs) <= MAX_LIVE_VERTICES;
    this.timeline = new Timeline($("#scrub"), (time) => this.seek(time, { pause: true }));
    this.curves = new Curves($("#curves"), (time) => this.seek(time, { pause: true }));
    this.isDirty = true;
    this.last = 0;
    this.stage.controls.addEventListener("change", () => (this.isDirty = true));
  }

  get duration() {
    return Math.max(1e-6, ...this.sides.map((side) => side.clip?.duration ?? 0));
  }

  /** Key times of the chosen node's tracks; of all tracks if it has none. */
  get keys() {
    const [side] = this.sides;
    const chosen = state.node === null ? [] : side.tracks?.get(state.node) ?? [];
    const tracks = chosen.length ? chosen.map((each) => each.track) : side.clip?.tracks ?? [];
    return [...new Set(tracks.flatMap((track) => [...track.times]))].sort((p, q) => p - q);
  }

  chooseClip(index, time = 0) {
    const [a, b] = this.sides;
    a.choose(a.clips[index]);
    if (b) b.choose(b.clips[facts.partners?.[index] ?? this.#samePlace(index)]);
    const direction = 1;
    state.clip = -1; // so that listeners hear of the same clip in a new file, too
    update({ clip: index, time: Math.max(0, Math.min(time, this.duration)), direction });
  }

  #samePlace(index) {
    const [a, b] = this.sides;
    const named = b.clipNames.indexOf(a.clipNames[index]);
    if (named >= 0) return named;
    return a.clips.length === b.clips.length && !Object.keys(facts.partners ?? {}).length ? index : -1;
  }

  seek(time, { pause = false } = {}) {
    update({ time: Math.max(0, Math.min(time, this.duration)), playing: pause ? false : state.playing });
  }

  play() {
    if (!this.sides[0].clip) return;
    const atEnd = state.loop === "once" && state.time >= this.duration;
    update({ playing: !state.playing, time: atEnd ? 0 : state.time, direction: 1 });
  }

  /** Go to a clip, node and time of the file, as a finding or a worst position names them. */
  follow({ clip, node, time }) {
    if (clip !== undefined && clip !== null && clip !== state.clip) this.chooseClip(clip);
    if (node !== undefined && node !== null) update({ node });
    if (time !== undefined && time !== null) this.seek(time, { pause: true });
    document.body.classList.remove("with-side");
  }

  nextKey(direction) {
    const keys = direction > 0 ? this.keys : this.keys.reverse();
    const next = keys.find((key) => direction * (key - state.time) > KEY_TOLERANCE_S);
    this.seek(next ?? (direction > 0 ? this.duration : 0), { pause: true });
  }

  /** Largest distance between both files in the present pose. */
  worst() {
    for (const side of this.sides) side.pose(state.time);
    return measure(this.pairs);
  }

  resetHeatScale() {
    const known = facts.errors?.[state.clip]?.max;
    update({ heatScale: known ? roundUp(known) : roundUp(2 * this.stage.radius * HEAT_PER_DIAGONAL) });
  }

  advance(seconds) {
    let time = state.time + seconds * state.speed * state.direction;
    const { duration } = this;
    if (time >= 0 && time <= duration) return this.seek(time);
    if (state.loop === "loop") return this.seek(((time % duration) + duration) % duration);
    if (state.loop === "once") return update({ time: duration, playing: false });
    time = time > duration ? 2 * duration - time : -time;
    update({ direction: -state.direction, time: Math.max(0, Math.min(time, duration)) });
  }

  tick(now) {
    const seconds = Math.min((now - this.last) / 1000, MAX_TICK_S);
    this.last = now;
    if (state.playing) this.advance(seconds);
    if (this.stage.controls.update() || this.isDirty) {
      this.isDirty = false;
      this.draw();
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  draw() {
    for (const side of this.sides) side.pose(state.time);
    const heat = this.#drawHeat();
    this.stage.draw((side) => {
      const { bones, onion } = this.extras[this.sides.indexOf(side)];
      onion.update(state.show.has("onion"), state.time);
      bones.update(state.show.has("bones"), this.stage.radius, this.#nodeIn(side), heat && side === this.sides[1] ? heat : null);
    });
    this.timeline.move(state.time);
    if (state.show.has("curves")) this.#drawCurves();
  }

  /** Color B; return colors of nodes instead where no mesh has a counterpart. */
  #drawHeat() {
    const isShown = state.show.has("heat") && this.sides.length > 1;
    const pin = $("#pin");
    pin.hidden = true;
    if (this.sides.length < 2) return null;
    let worst = null;
    if (isShown && (this.isLive || !state.playing)) worst = paint(this.pairs, state.heatScale);
    else if (!state.playing) worst = measure(this.pairs);
    $("#worst").textContent = worst?.mesh ? formatLength(worst.error) : this.pairs.length ? "" : "other vertices";
    if (worst?.mesh && isShown) {
      const spot = this.stage.project(worst.point, this.sides[1]);
      pin.hidden = !spot;
      if (spot) pin.style.transform = `translate(${spot.x}px, ${spot.y}px)`;
      pin.firstElementChild.textContent = formatLength(worst.error);
    }
    return isShown && !this.pairs.length ? nodeColors(this.sides, state.heatScale) : null;
  }

  /** The chosen node of A in a side: the same one, or that of the same name. */
  #nodeIn(side) {
    if (state.node === null || side === this.sides[0]) return state.node;
    const name = this.sides[0].nodes.get(state.node)?.name;
    return [...side.nodes.values()].find((node) => node.name === name)?.index ?? null;
  }

  #drawCurves() {
    const sides = this.sides.map((side) => {
      const index = this.#nodeIn(side);
      const node = index === null ? null : side.nodes.get(index);
      return { tracks: side.tracks?.get(index) ?? [], rest: node?.rest.quaternion };
    });
    const name = state.node === null ? null : this.sides[0].nodes.get(state.node)?.name;
    $("#curves-name").textContent = name ?? "Curves";
    const message = name ? `'${name}' has no track in this clip` : "Choose a node in the list, or click a joint";
    this.curves.draw({ sides, duration: this.duration, time: state.time, unit: state.unit, message });
  }

  drawTimeline() {
    const curve = facts.errors?.[state.clip] ?? null;
    this.timeline.draw({ duration: this.duration, keys: this.keys, curve: curve?.times?.length ? curve : null });
  }

  applyMaterials() {
    const heated = new Set(state.show.has("heat") ? this.pairs.map(([, mesh]) => mesh) : []);
    for (const side of this.sides) applyMaterials(side, state.show, heated);
  }

  /** The node nearest to a click, within some pixels. */
  pick(x, y) {
    let best = { distance: MAX_PICK_PX, index: null };
    const place = new Vector3();
    for (const node of this.extras[0].bones.nodes) {
      const spot = this.stage.project(place.setFromMatrixPosition(node.object.matrixWorld), this.stage.shown[0]);
      const distance = spot ? Math.hypot(spot.x - x, spot.y - y) : Infinity;
      if (distance < best.distance) best = { distance, index: node.index };
    }
    if (best.index !== null) update({ node: best.index, show: new Set([...state.show, "curves"]) });
  }
}

function bindings(player) {
  const isPair = player.sides.length > 1;
  const step = (direction) => (event) =>
    player.seek(state.time + direction * STEP_S * (event.shiftKey ? 10 : 1), { pause: true });
  return [
    { keys: [" "], label: "play or pause", run: () => player.play() },
    { keys: ["ArrowLeft", "ArrowRight"], label: "1/30 s; with shift 1/3 s", run: (event) => step(event.key === "ArrowLeft" ? -1 : 1)(event) },
    { keys: [",", "."], label: "key before, next key", run: (event) => player.nextKey(event.key === "," ? -1 : 1) },
    { keys: ["Home", "End"], label: "start, end", run: (event) => player.seek(event.key === "Home" ? 0 : player.duration, { pause: true }) },
    { keys: ["p", "n"], label: "clip before, next clip", run: (event) => chooseNext(player, event.key.toLowerCase() === "p" ? -1 : 1) },
    { keys: ["-", "+"], label: "slower, faster", run: (event) => changeSpeed(event.key === "-" ? -1 : 1) },
    { keys: ["l"], label: "loop, once, ping-pong", run: () => cycle("loop", LOOPS) },
    { keys: ["f"], label: "frame everything", run: () => fit(player) },
    { keys: ["s"], label: "skeleton", run: () => toggleShow("bones") },
    { keys: ["w"], label: "wireframe", run: () => toggleShow("wire") },
    { keys: ["o"], label: "onion skins", run: () => toggleShow("onion") },
    { keys: ["c"], label: "clay", run: () => toggleShow("clay") },
    { keys: ["g"], label: "curves of the chosen node", run: () => toggleShow("curves") },
    { keys: ["u"], label: "rotation as degrees from rest, or values", run: () => cycle("unit", ["degrees", "values"]) },
    { keys: ["h"], label: "heat of the error", run: () => toggleShow("heat"), isShown: isPair },
    { keys: ["[", "]"], label: "scale of the heat", run: (event) => update({ heatScale: state.heatScale * (event.key === "[" ? 0.5 : 2) }), isShown: isPair },
    { keys: ["b"], label: "both, A, B", run: () => cycle("side", SIDES), isShown: isPair },
    { keys: ["d"], label: "light or dark", run: () => update({ theme: isDark() ? "light" : "dark" }) },
    { keys: ["?"], label: "this sheet", run: openSheet },
  ];
}

function chooseNext(player, direction) {
  const count = player.sides[0].clips.length;
  if (!count) return;
  player.chooseClip((state.clip + direction + count) % count);
  scrollToClip(state.clip);
}

function changeSpeed(direction) {
  const next = SPEEDS.indexOf(state.speed) + direction;
  if (SPEEDS[next]) update({ speed: SPEEDS[next] });
}

function fit(player) {
  player.stage.fit(player.duration);
  $("#floor").textContent = player.stage.floorLabel;
  player.isDirty = true;
}

function isDark() {
  return state.theme === "auto" ? matchMedia("(prefers-color-scheme: dark)").matches : state.theme === "dark";
}

/** Bring the page in line with what changed. */
function render(player, changed) {
  const has = (...names) => names.some((name) => changed.has(name));
  player.isDirty = true;
  if (has("clip")) {
    markClip(state.clip);
    $("#clip-name").textContent = player.sides[0].clipNames[state.clip] ?? "";
    player.resetHeatScale();
  }
  if (has("clip", "node")) {
    markNode(state.node, new Set(player.sides[0].tracks?.keys() ?? []));
    player.drawTimeline();
  }
  if (has("theme")) {
    document.documentElement.dataset.theme = isDark() ? "dark" : "light";
    player.drawTimeline();
  }
  if (has("show")) {
    for (const name of SHOWS) setPressed($(`#show-${name}`), state.show.has(name));
    $("#curves").hidden = !state.show.has("curves");
    $("#legend").hidden = !(state.show.has("heat") && player.sides.length > 1);
    player.applyMaterials();
  }
  if (has("side")) {
    for (const name of SIDES) setPressed($(`#side-${name}`), state.side === name);
    document.body.dataset.side = state.side;
  }
  if (has("playing")) {
    $("#play").classList.toggle("playing", state.playing);
    $("#play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
  }
  if (has("unit")) $("#unit").textContent = state.unit === "degrees" ? "degrees from rest" : "values";
  if (has("heatScale")) $("#heat-most").textContent = formatLength(state.heatScale);
  if (has("speed")) $("#speed").value = String(state.speed);
  if (has("loop")) $("#loop").value = state.loop;
  if (!state.playing) writeHash(() => hashOf(player));
}

function hashOf(player) {
  const [side] = player.sides;
  return {
    clip: side.clipNames[state.clip],
    t: state.time.toFixed(3),
    node: state.node === null ? null : side.nodes.get(state.node)?.name,
    show: [...state.show].join(","),
    side: state.side === "both" ? null : state.side,
    theme: state.theme === "auto" ? null : state.theme,
  };
}

function connect(player) {
  onChange((changed) => render(player, changed));
  listenToKeys(bindings(player));
  $("#play").addEventListener("click", () => player.play());
  $("#help").addEventListener("click", openSheet);
  $("#fit").addEventListener("click", () => fit(player));
  $("#theme").addEventListener("click", () => update({ theme: isDark() ? "light" : "dark" }));
  $("#menu").addEventListener("click", () => document.body.classList.toggle("with-side"));
  $("#unit").addEventListener("click", () => cycle("unit", ["degrees", "values"]));
  $("#speed").addEventListener("change", (event) => update({ speed: Number(event.target.value) }));
  $("#loop").addEventListener("change", (event) => update({ loop: event.target.value }));
  for (const name of SHOWS) $(`#show-${name}`).addEventListener("click", () => toggleShow(name));
  for (const name of SIDES) $(`#side-${name}`).addEventListener("click", () => update({ side: name }));
  let down = null;
  const canvas = $("#view canvas");
  canvas.addEventListener("pointerdown", (event) => (down = event));
  canvas.addEventListener("pointerup", (event) => {
    const isClick = down && Math.hypot(event.offsetX - down.offsetX, event.offsetY - down.offsetY) < 4;
    if (isClick && state.show.has("bones")) player.pick(event.offsetX, event.offsetY);
  });
  new ResizeObserver(() => {
    player.drawTimeline();
    player.isDirty = true;
  }).observe($("#view"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => render(player, new Set(["theme"])));
}

/** The state that the URL, else the page, asks for. */
function begin(player) {
  const [side] = player.sides;
  const asked = readHash(facts.view ?? {});
  const clip = side.clipNames.indexOf(asked.clip);
  const nodes = [...side.nodes.values()];
  const node = nodes.find((each) => each.name === asked.node) ?? nodes.find((each) => `#${each.index}` === asked.node);
  update({ theme: asked.theme, side: asked.side });
  if (side.clips.length) player.chooseClip(Math.max(clip, 0), asked.time ?? 0);
  fit(player);
  player.resetHeatScale();
  if (asked.scale) update({ heatScale: asked.scale });
  update({ node: node?.index ?? null, show: asked.show });
  const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  update({ playing: side.clips.length > 0 && asked.time === null && !isCalm });
  render(player, new Set(Object.keys(state)));
}

async function main() {
  const root = document.documentElement;
  root.dataset.theme = isDark() ? "dark" : "light";
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  const sides = [];
  for (const [i, id] of ["a", "b"].entries()) {
    const bytes = await readFile(id);
    if (bytes) sides.push(new Side(await loader.parseAsync(bytes, ""), facts.files[i]));
  }
  document.body.classList.toggle("pair", sides.length > 1);
  $("#legend .scale").style.background = GRADIENT;
  const player = new Player(sides);
  fillSidebar(sides, facts, {
    chooseClip: (index) => {
      player.chooseClip(index);
      document.body.classList.remove("with-side");
    },
    chooseNode: (node) => update({ node: state.node === node ? null : node, show: new Set([...state.show, "curves"]) }),
    follow: (link) => player.follow(link),
  });
  connect(player);
  begin(player);
  player.draw();
  requestAnimationFrame((now) => player.tick(now));
  globalThis.player = Object.assign(player, { state, update }); // for scripts and tests
  root.dataset.ready = "1";
}

main().catch((error) => {
  document.documentElement.dataset.error = String(error);
  $("#message").textContent = `This file can't be shown: ${error.message ?? error}`;
  $("#message").hidden = false;
});

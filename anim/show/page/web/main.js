// The page of `gltf-anim view`: loads the files in it, and connects state, picture, timeline and lists.

import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import { bindings, fit, frame, isDark } from "./bindings.js";
import { markClip, sortClips } from "./clips.js";
import { facts, hasNodes, readFile } from "./data.js";
import { $, make, setPressed } from "./dom.js";
import { formatLength } from "./format.js";
import { GRADIENT } from "./heat.js";
import { listenToKeys, openSheet } from "./keyboard.js";
import { Player } from "./player.js";
import { fillSidebar, markLink, markNode, markTab, scrollToChosen, showSide } from "./sidebar.js";
import { Side } from "./side.js";
import { OF_NODES, SHOWS, SIDES, UNITS, hashText, onChange, readHash, state, toggleShow, update, writeHash } from "./state.js";

const NO_CLIP = "no animation";

/** Bring the page in line with what changed. */
function render(player, changed) {
  const has = (...names) => names.some((name) => changed.has(name));
  player.isDirty = true;
  if (has("clip")) {
    markClip(state.clip);
    $("#clip-name").textContent = player.sides[0].clipNames[state.clip] ?? NO_CLIP;
    player.resetHeatScale();
    player.applyMaterials();
  }
  if (has("clip", "node")) {
    markNode(state.node, new Set(player.sides[0].tracks?.keys() ?? []));
    player.compareCurves();
    player.drawTimeline();
  }
  if (has("theme")) {
    document.documentElement.dataset.theme = isDark() ? "dark" : "light";
    player.drawTimeline();
  }
  if (has("show")) {
    const isNodeless = state.show.has("curves") && $("#curves").hidden && state.node === null;
    if (isNodeless && $("#tab-nodes")) update({ tab: "nodes" }); // to choose one
    for (const name of SHOWS) setPressed($(`#show-${name}`), state.show.has(name));
    $("#curves").hidden = !state.show.has("curves");
    player.applyMaterials();
  }
  if (has("clip", "show")) $("#legend").hidden = !(state.show.has("heat") && player.isPaired);
  if (has("side")) {
    for (const name of SIDES) setPressed($(`#side-${name}`), state.side === name);
    document.body.dataset.side = state.side;
  }
  if (has("playing")) {
    $("#play").classList.toggle("playing", state.playing);
    $("#play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
  }
  if (has("unit")) for (const name of UNITS) setPressed($(`#unit-${name}`), state.unit === name);
  if (has("tab")) markTab(state.tab);
  if (has("sort")) sortClips(player.sides[0], facts);
  if (has("clip", "node", "tab")) scrollToChosen();
  if (has("heatScale")) $("#heat-most").textContent = formatLength(state.heatScale);
  if (has("speed")) $("#speed").value = String(state.speed);
  if (has("loop")) $("#loop").value = state.loop;
  const isMore = [...changed].some((name) => name !== "time" && name !== "direction");
  if (isMore || !state.playing) writeHash(() => hashOf(player)); // the time of playback when it ends
}

function hashOf(player) {
  const [side] = player.sides;
  const { node = null, show = [] } = facts.view ?? {};
  return {
    clip: side.clips.length ? clipText(side, state.clip) : null,
    t: state.time.toFixed(3),
    node: state.node === null ? unless(node === null, "") : side.nodes.get(state.node)?.name,
    show: state.show.size ? [...state.show].join(",") : unless(!show.length, ""),
    side: unless(state.side === "both", state.side),
    theme: unless(state.theme === "auto", state.theme),
    unit: unless(state.unit === "degrees", state.unit),
    list: state.tab,
    sort: state.sort || null,
    speed: unless(state.speed === 1, state.speed),
    loop: unless(state.loop === "loop", state.loop),
    scale: unless(state.heatScale === player.ownHeatScale, state.heatScale),
    camera: player.stage.cameraText || null,
  };
}

/** A value of the address, or null where the page has it without an address. */
function unless(isDefault, value) {
  return isDefault ? null : value;
}

/** The clip in the address: its name, or "#" and its index where a clip before it has the same name, or it reads so. */
function clipText({ clipNames }, index) {
  const name = clipNames[index];
  return clipNames.indexOf(name) === index && !/^#\d+$/.test(name) ? name : `#${index}`;
}

/** Index of the clip that the address names, -1 for none. */
function clipIndex({ clipNames }, text) {
  const numbered = clipNames.findIndex((_, i) => `#${i}` === text);
  return numbered >= 0 ? numbered : clipNames.indexOf(text);
}

function connect(player) {
  onChange((changed) => render(player, changed));
  listenToKeys(bindings(player));
  $("#play").addEventListener("click", () => player.play());
  $("#help").addEventListener("click", openSheet);
  $("#fit").addEventListener("click", () => frame(player));
  $("#theme").addEventListener("click", () => update({ theme: isDark() ? "light" : "dark" }));
  $("#menu").addEventListener("click", () => showSide(!document.body.classList.contains("with-side")));
  for (const name of UNITS) $(`#unit-${name}`).addEventListener("click", () => update({ unit: name }));
  $("#speed").addEventListener("change", (event) => update({ speed: Number(event.target.value) }));
  $("#loop").addEventListener("change", (event) => update({ loop: event.target.value }));
  for (const name of SHOWS) $(`#show-${name}`).addEventListener("click", () => toggleShow(name));
  for (const name of SIDES) $(`#side-${name}`).addEventListener("click", () => update({ side: name }));
  player.stage.controls.addEventListener("change", () => writeHash(() => hashOf(player)));
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

/** What rows of the lists do; on a phone, where the lists cover the picture, they close. */
function actions(player) {
  const closing = (action) => (argument) => {
    action(argument);
    showSide(false);
  };
  return {
    chooseClip: closing((index) => player.chooseClip(index)),
    chooseNode: closing((node) =>
      update({ node: state.node === node ? null : node, show: new Set([...state.show, "curves"]) }),
    ),
    follow: closing((link) => player.follow(link)),
  };
}

/** The state that the URL, else the page, asks for. */
function begin(player) {
  const [side] = player.sides;
  const asked = readHash(facts.view ?? {});
  const clip = clipIndex(side, asked.clip);
  const nodes = [...side.nodes.values()];
  const node = nodes.find((each) => each.name === asked.node) ?? nodes.find((each) => `#${each.index}` === asked.node);
  const { theme, unit, speed, loop } = asked;
  update({ theme, unit, speed, loop, tab: player.firstTab, sort: asked.sort, side: asked.side });
  if (side.clips.length) player.chooseClip(Math.max(clip, 0), asked.time ?? 0);
  const show = [...asked.show].filter((name) => hasNodes(facts) || !OF_NODES.includes(name));
  update({ node: node?.index ?? null, show: new Set(show) });
  fit(player); // of the picture's height above curves
  if (asked.camera) player.stage.moveCamera(asked.camera);
  player.resetHeatScale();
  if (asked.scale) update({ heatScale: asked.scale });
  if (asked.tab && document.getElementById(`tab-${asked.tab}`)) update({ tab: asked.tab }); // curves without a node chose another
  const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  update({ playing: side.clips.length > 0 && asked.time === null && !isCalm });
  render(player, new Set(Object.keys(state)));
  if (!state.playing) markLink(state.clip, state.time);
}

/** Name meshes that are not shown beside the picture. */
function nameHidden(tag, count) {
  if (count) tag.append(make("i", { class: "dim" }, `without ${count} ${count === 1 ? "mesh" : "meshes"}`));
}

async function main() {
  const root = document.documentElement;
  root.dataset.theme = isDark() ? "dark" : "light";
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  const sides = [];
  for (const [i, id] of ["a", "b"].entries()) {
    const bytes = await readFile(id);
    if (bytes) sides.push(new Side(await loader.parseAsync(bytes, ""), facts.files[i], facts.hidden?.[i]));
  }
  document.body.classList.toggle("pair", sides.length > 1);
  document.body.classList.toggle("cache", !hasNodes(facts));
  document.body.classList.toggle("static", !sides[0].clips.length);
  for (const [i, { numHidden }] of sides.entries()) nameHidden($(i ? "#tag-b" : "#tag-a"), numHidden);
  $("#legend .scale").style.background = GRADIENT;
  const player = new Player(sides);
  player.firstTab = fillSidebar(sides, facts, actions(player));
  connect(player);
  begin(player);
  player.draw();
  $("#loading").hidden = true;
  requestAnimationFrame((now) => player.tick(now));
  const address = () => hashText(hashOf(player));
  globalThis.player = Object.assign(player, { state, update, address }); // for scripts and tests
  root.dataset.ready = "1";
}

main().catch((error) => {
  document.documentElement.dataset.error = String(error);
  $("#message").textContent = `This file can't be shown: ${error.message ?? error}`;
  $("#message").hidden = false;
  $("#loading").hidden = true;
});

// What the keys do.

import { lookFrom, zoomTo } from "./camera.js";
import { nextClip } from "./clips.js";
import { facts, hasNodes } from "./data.js";
import { $ } from "./dom.js";
import { openSheet } from "./keyboard.js";
import { focusFilter } from "./sidebar.js";
import { LOOPS, SIDES, SPEEDS, UNITS, cycle, state, toggleShow, update } from "./state.js";

const STEP_S = 1 / 30;
const ZOOM = 1.25; // of the camera's distance, by a key

/** All keys, in the order of the sheet. */
export function bindings(player) {
  const isPair = player.sides.length > 1;
  const isShown = hasNodes(facts);
  const step = (direction) => (event) =>
    player.seek(state.time + direction * STEP_S * (event.shiftKey ? 10 : 1), { pause: true });
  return [
    { keys: [" "], label: "play or pause", run: () => player.play() },
    {
      keys: ["ArrowLeft", "ArrowRight"],
      label: "1/30 s; with shift 1/3 s",
      run: (event) => step(event.key === "ArrowLeft" ? -1 : 1)(event),
    },
    { keys: [",", "."], label: "key before, next key", run: (event) => player.nextKey(event.key === "," ? -1 : 1) },
    {
      keys: ["Home", "End"],
      label: "start, end",
      run: (event) => player.seek(event.key === "Home" ? 0 : player.duration, { pause: true }),
    },
    {
      keys: ["p", "n"],
      label: "clip before, next clip",
      run: (event) => chooseNext(player, event.key.toLowerCase() === "p" ? -1 : 1),
    },
    { keys: ["-", "+"], label: "slower, faster", run: (event) => changeSpeed(event.key === "-" ? -1 : 1) },
    { keys: ["l"], label: "loop, once, ping-pong", run: () => cycle("loop", LOOPS) },
    { keys: ["f"], label: "frame the chosen node; again: everything", run: () => frame(player) },
    {
      keys: ["1", "3", "7"],
      label: "from the front, the side, above",
      run: ({ key }) => lookFrom(player.stage, { 1: "front", 3: "side", 7: "above" }[key]),
    },
    {
      keys: ["PageUp", "PageDown"],
      label: "nearer, farther",
      run: ({ key }) => zoomTo(player.stage, key === "PageUp" ? 1 / ZOOM : ZOOM, 0, 0),
    },
    { keys: ["s"], label: "skeleton", run: () => toggleShow("bones"), isShown },
    { keys: ["w"], label: "wireframe", run: () => toggleShow("wire") },
    { keys: ["o"], label: "onion skins", run: () => toggleShow("onion") },
    { keys: ["c"], label: "clay", run: () => toggleShow("clay") },
    { keys: ["g"], label: "curves of the chosen node", run: () => toggleShow("curves"), isShown },
    { keys: ["u"], label: "rotation as degrees from rest, or values", run: () => cycle("unit", UNITS), isShown },
    { keys: ["h"], label: "heat of the error", run: () => toggleShow("heat"), isShown: isPair },
    {
      keys: ["[", "]"],
      label: "scale of the heat",
      run: (event) => update({ heatScale: state.heatScale * (event.key === "[" ? 0.5 : 2) }),
      isShown: isPair,
    },
    { keys: ["b"], label: "both, A, B, A over B", run: () => cycle("side", SIDES), isShown: isPair },
    {
      keys: ["v"],
      label: "A as a ghost over B; again: both",
      run: () => update({ side: state.side === "over" ? "both" : "over" }),
      isShown: isPair,
    },
    { keys: ["/"], label: "filter the list, then ↑ ↓", run: focusFilter },
    { keys: ["d"], label: "light or dark", run: () => update({ theme: isDark() ? "light" : "dark" }) },
    { keys: ["?"], label: "this sheet", run: openSheet },
  ];
}

function chooseNext(player, direction) {
  const next = nextClip(state.clip, direction);
  if (next !== null) player.chooseClip(next);
}

function changeSpeed(direction) {
  const next = SPEEDS.indexOf(state.speed) + direction;
  if (SPEEDS[next]) update({ speed: SPEEDS[next] });
}

/** Frame the chosen node; everything where none is chosen, or where F framed it before. */
export function frame(player) {
  if (state.node === null || player.framed === state.node) return fit(player);
  player.frameNode();
}

/** Frame everything. */
export function fit(player) {
  player.framed = null;
  player.stage.fit(player.duration);
  $("#floor").textContent = player.stage.floorLabel;
  player.isDirty = true;
}

export function isDark() {
  return state.theme === "auto" ? matchMedia("(prefers-color-scheme: dark)").matches : state.theme === "dark";
}

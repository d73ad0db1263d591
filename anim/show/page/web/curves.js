// Curves of the chosen node: as three.js evaluates them, with keys and the tangents of cubic splines.

import { Quaternion } from "three";
import { roundNumbers, timeAxis } from "./axis.js";
import { begin, ink } from "./canvas.js";
import { formatNumber, lengthUnit } from "./format.js";
import { isCubic } from "./side.js";

const SAMPLES = 320;
const MAX_DOTS = 160; // keys per track drawn as dots
const MAX_WEIGHTS = 12; // morph targets drawn
const TITLE = 22; // px above a graph
const FOOT = 8; // px below it
const MIN_LABEL_PX = 20; // between labels of values
const MIN_RANGE_PER_VALUE = 1e-3; // of a graph; less is rounding
const MIN_RANGE_DEGREES = 1;
const EQUAL_PER_VALUE = 1e-5; // of the largest value of a track: rounding in float32
const REST_UNITS = { translation: 0, rotation: 180 / Math.PI, scale: 0 }; // least size of values for this tolerance
const COLORS = ["--x", "--y", "--z", "--w"];
const AXES = ["x", "y", "z", "w"];
const PATH_UNITS = { translation: "m", rotation: "", scale: "×", weights: "" };
const UNIT_TEXTS = { m: " m", "": "", "×": "×", "°": "°" };

export class Curves {
  constructor(panel, seek) {
    this.canvas = panel.querySelector("canvas");
    const timeAt = (event) => timeAxis(this.canvas.clientWidth, this.duration).time(event.offsetX);
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) seek(timeAt(event));
    });
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      seek(timeAt(event));
    });
  }

  /** sides: tracks of the chosen node per file, [{path, track}], and its rest pose. */
  draw({ sides, duration, time, unit, message }) {
    this.duration = Math.max(duration, 1e-6);
    const { context, width, height } = begin(this.canvas);
    const axis = timeAxis(width, this.duration);
    const paths = [...new Set(sides.flatMap((side) => side.tracks.map((each) => each.path)))];
    if (!paths.length) {
      context.fillStyle = ink("--dim");
      context.font = "13px system-ui, sans-serif";
      context.fillText(message, axis.left, height / 2);
      return;
    }
    context.fillStyle = ink("--line");
    context.globalAlpha = 0.6;
    for (const at of axis.labels) context.fillRect(Math.round(axis.x(at)), 0, 1, height);
    context.globalAlpha = 1;
    const part = height / paths.length;
    for (const [i, path] of paths.entries()) {
      const graphs = sides.flatMap((side, which) =>
        side.tracks.filter((each) => each.path === path).map((each) => ({ which, ...graph(each, side.rest?.rotation, unit) })),
      );
      if (i) {
        context.fillStyle = ink("--line");
        context.fillRect(0, Math.round(i * part), width, 1);
      }
      this.#drawGraph(context, { graphs, path, time, top: i * part, height: part, axis });
    }
    context.fillStyle = ink("--accent");
    context.fillRect(axis.x(time) - 0.75, 0, 1.5, height);
  }

  #drawGraph(context, { graphs, path, time, top, height, axis }) {
    const samples = Array.from({ length: SAMPLES + 1 }, (_, i) => (this.duration * i) / SAMPLES);
    const lines = graphs.map((each) => samples.map(each.at));
    const all = lines.flat(2);
    let [low, high] = [Math.min(...all), Math.max(...all)];
    const size = Math.max(Math.abs(low), Math.abs(high));
    const least = graphs[0].unit === "°" ? MIN_RANGE_DEGREES : size * MIN_RANGE_PER_VALUE;
    if (high - low < least || !size) [low, high] = [low - (least || 1), high + (least || 1)];
    const { x } = axis;
    const y = (value) => top + height - FOOT - ((height - TITLE - FOOT) * (value - low)) / (high - low);
    const values = roundNumbers(low, high, (height - TITLE - FOOT) / MIN_LABEL_PX);
    drawValues(context, { values, size, unit: graphs[0].unit, y, axis });
    for (const [g, each] of graphs.entries()) {
      context.setLineDash(each.which ? [4, 3] : []);
      context.globalAlpha = each.which ? 0.75 : 1;
      for (let c = 0; c < each.size; c++) {
        context.strokeStyle = ink(COLORS[c % 4]);
        context.lineWidth = 1.5;
        context.beginPath();
        samples.forEach((at, i) => context.lineTo(x(at), y(lines[g][i][c])));
        context.stroke();
      }
      context.setLineDash([]);
      drawKeys(context, each, x, y);
    }
    context.globalAlpha = 1;
    this.#drawTitle(context, graphs, path, time, top, axis.left);
  }

  #drawTitle(context, graphs, path, time, top, left) {
    context.font = "600 11px system-ui, sans-serif";
    context.fillStyle = ink("--text");
    const write = (text) => {
      context.fillText(text, left, top + 15);
      left += context.measureText(text).width + 10;
    };
    write(path);
    context.font = "11px system-ui, sans-serif";
    const [first] = graphs;
    const values = first.at(time);
    for (let c = 0; c < first.size; c++) {
      context.fillStyle = ink(COLORS[c % 4]);
      const name = path === "weights" ? `${c}` : AXES[c];
      write(`${name} ${formatNumber(values[c])}${UNIT_TEXTS[first.unit]}`);
    }
    context.fillStyle = ink("--dim");
    write(first.times.length === 1 ? "1 key" : `${first.times.length} keys`);
  }
}

/** The value axis: labels with their unit, and a line across the graph at each. */
function drawValues(context, { values, size, unit, y, axis }) {
  const [name, factor] = unit === "m" ? lengthUnit(size) : [unit, 1];
  context.textAlign = "right";
  for (const value of values) {
    context.fillStyle = ink("--line");
    context.fillRect(axis.left, Math.round(y(value)), axis.right - axis.left, 1);
    context.fillStyle = ink("--dim");
    context.fillText(`${Number((value * factor).toPrecision(6))}${UNIT_TEXTS[name] ?? ` ${name}`}`, axis.left - 8, y(value) + 4);
  }
  context.textAlign = "left";
}

/** Whether a node moves the same in both files, each {tracks: [{path, track}], rest}: its tracks, else its rest pose. */
export function areEqual(one, other, duration) {
  const tracks = [...one.tracks, ...other.tracks];
  if (!tracks.length || tracks.some(({ path }) => path === "weights")) return false; // no parent deforms a mesh
  const keys = tracks.flatMap(({ track }) => [...track.times]);
  const times = [...keys, ...Array.from({ length: SAMPLES + 1 }, (_, i) => (duration * i) / SAMPLES)];
  return Object.entries(REST_UNITS).every(([path, size]) => {
    const [mine, its] = [one, other].map((node) => valuesOver(times, node, path, one.rest));
    const tolerance = EQUAL_PER_VALUE * mine.reduce((most, value) => Math.max(most, Math.abs(value)), size);
    return mine.every((value, i) => Math.abs(value - its[i]) <= tolerance);
  });
}

/** Values of a path of a node at times, from its track or its rest pose; rotations from the rest of the first file. */
function valuesOver(times, { tracks, rest }, path, { rotation }) {
  const found = tracks.find((each) => each.path === path);
  if (found) return times.map(graph(found, rotation, "degrees").at).flat();
  const values = rest[path].toArray();
  const shown = path === "rotation" ? rotationVector(values, rotation) : values;
  return times.flatMap(() => shown);
}

function drawKeys(context, { times, size, at, tangents, which }, x, y) {
  if (times.length > MAX_DOTS || which) return;
  for (const [k, time] of times.entries()) {
    const values = at(time);
    for (let c = 0; c < size; c++) {
      context.fillStyle = ink(COLORS[c % 4]);
      context.strokeStyle = context.fillStyle;
      if (tangents) drawTangent(context, tangents, times, k, c, values[c], x, y);
      context.fillRect(x(time) - 2, y(values[c]) - 2, 4, 4);
    }
  }
}

/** Handles of a cubic key, a third of the segment long, as in editors. */
function drawTangent(context, tangents, times, k, c, value, x, y) {
  context.lineWidth = 1;
  context.globalAlpha = 0.6;
  for (const [direction, slopes] of [[-1, tangents.in], [1, tangents.out]]) {
    const other = times[k + direction];
    if (other === undefined) continue;
    const reach = (other - times[k]) / 3;
    context.beginPath();
    context.moveTo(x(times[k]), y(value));
    context.lineTo(x(times[k] + reach), y(value + slopes(k, c) * reach));
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** Values of a track over time, as numbers or as degrees from the rest rotation. */
function graph({ path, track }, rest, unit) {
  const width = track.getValueSize() / (isCubic(track) ? 3 : 1);
  // As stored: rotations are played by normalized copies
  const shown = unit === "values" && track.stored ? Object.create(track, { values: { value: track.stored } }) : track;
  const interpolant = shown.createInterpolant(new Float32Array(width));
  const times = [...track.times];
  const raw = (time) => [...interpolant.evaluate(Math.max(times[0], Math.min(time, times.at(-1))))];
  if (path === "rotation" && unit === "degrees") {
    return { times, size: 3, unit: "°", at: (time) => rotationVector(raw(time), rest) };
  }
  const size = path === "weights" ? Math.min(width, MAX_WEIGHTS) : width;
  const tangents = isCubic(track) ? tangentsOf(track, width) : null;
  return { times, size, unit: PATH_UNITS[path], at: (time) => raw(time).slice(0, size), tangents };
}

/** Slopes per second; glTF stores in-tangent, value and out-tangent of each key. */
function tangentsOf(track, width) {
  const slope = (part) => (k, c) => track.values[3 * width * k + part * width + c];
  return { in: slope(0), out: slope(2) };
}

/** Axis times angle, in degrees, of the rotation from rest. */
function rotationVector(values, rest) {
  const turn = new Quaternion(...values).normalize().premultiply(rest.clone().conjugate());
  if (turn.w < 0) turn.set(-turn.x, -turn.y, -turn.z, -turn.w);
  const sine = Math.hypot(turn.x, turn.y, turn.z);
  const factor = sine < 1e-9 ? 2 : (2 * Math.atan2(sine, turn.w)) / sine;
  return [turn.x, turn.y, turn.z].map((part) => (part * factor * 180) / Math.PI);
}

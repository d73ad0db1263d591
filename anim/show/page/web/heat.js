// Heat: vertices of B colored by the distance to the same vertices of A.
//
// three.js poses both on the CPU (0.4 to 2 µs per vertex), so that any number of morph targets and joints works.

import { BufferAttribute, Color, Vector3 } from "three";
import { lookOf, setColors } from "./materials.js";

export const MAX_LIVE_VERTICES = 60000; // more are colored only while paused
const STOPS = [[0, 0xdedbd6], [0.35, 0xffd166], [0.7, 0xf3722c], [1, 0xb5121b]].map(([at, hex]) => [at, new Color(hex)]);

/** CSS gradient of the legend. */
export const GRADIENT = `linear-gradient(90deg, ${STOPS.map(([at, color]) => `#${color.getHexString()} ${at * 100}%`)})`;

/** Color of a distance as a fraction of the scale. */
export function heatColor(fraction, color) {
  const value = Math.min(fraction, 1);
  const next = STOPS.findIndex(([at]) => at >= value);
  if (next < 1) return color.copy(STOPS[Math.max(next, 0)][1]);
  const [[low, first], [high, second]] = [STOPS[next - 1], STOPS[next]];
  return color.lerpColors(first, second, (value - low) / (high - low));
}

/** Meshes of A and B whose vertices correspond, and which vertices. */
export class MeshPairs {
  /** nodes: of each file, those whose meshes correspond in this order, null for all meshes of a file; else by name. */
  constructor(sides, nodes) {
    this.sides = sides;
    this.fixed = sides.length < 2 ? [] : nodes ? this.#byNodes(nodes) : byName(sides);
    // The meshes of a cache correspond as a whole; those that are not shown, of a flip-book, have no size
    this.isWhole = Boolean(nodes) && nodes.includes(null);
    this.known = this.isWhole ? nodes.map((list, i) => (list ? meshesOn(sides[i], list) : null)) : null;
    /** Meshes of B that can be colored. */
    this.heated = new Set(this.isWhole ? this.known[1] ?? sides[1].meshes : this.fixed.map((span) => span.after));
    this.isEmpty = !this.spans().length;
  }

  #byNodes([first, second]) {
    if (!first || !second) return [];
    return first.flatMap((node, i) => zip(meshesOn(this.sides[0], [node]), meshesOn(this.sides[1], [second[i]])));
  }

  /** Ranges of vertices that correspond: [{before, first, after, start, length}]. */
  spans() {
    if (!this.isWhole) return this.fixed;
    const shown = this.known.map((list, i) => list ?? this.sides[i].meshes.filter(hasSize));
    return zip(...shown);
  }

  get vertexCount() {
    return this.spans().reduce((sum, span) => sum + span.length, 0);
  }
}

/** Meshes of B with those of A that have as many vertices: by node and primitive name, then by order. */
function byName(sides) {
  const [a, b] = sides.map((side) => side.meshes);
  const free = new Set(a);
  return b.flatMap((mesh, i) => {
    const fits = (other) => free.has(other) && count(other) === count(mesh);
    const other = a.find((each) => fits(each) && each.name === mesh.name) ?? (fits(a[i]) ? a[i] : null);
    free.delete(other);
    return other ? zip([other], [mesh]) : [];
  });
}

/** Vertices of two lists of meshes, one mesh after the other; none if one list has more vertices. */
function zip(olds, news) {
  if (total(olds) !== total(news)) return [];
  const spans = [];
  const [p, q] = [{ mesh: 0, vertex: 0 }, { mesh: 0, vertex: 0 }];
  while (p.mesh < olds.length && q.mesh < news.length) {
    const [before, after] = [olds[p.mesh], news[q.mesh]];
    const length = Math.min(count(before) - p.vertex, count(after) - q.vertex);
    if (length) spans.push({ before, first: p.vertex, after, start: q.vertex, length });
    for (const [at, mesh] of [[p, before], [q, after]]) {
      at.vertex += length;
      if (at.vertex === count(mesh)) Object.assign(at, { mesh: at.mesh + 1, vertex: 0 });
    }
  }
  return spans;
}

function meshesOn(side, nodes) {
  return nodes.flatMap((node) => side.meshes.filter((mesh) => side.owners.get(mesh) === node));
}

function hasSize(mesh) {
  return Math.abs(mesh.matrixWorld.determinant()) > 0;
}

function total(meshes) {
  return meshes.reduce((sum, mesh) => sum + count(mesh), 0);
}

/** The largest distance between paired vertices in the present pose: {error, vertex, mesh, point}. */
export function measure(spans, visit = () => {}) {
  const [p, q, point] = [new Vector3(), new Vector3(), new Vector3()];
  const worst = { error: 0, vertex: -1, mesh: null, point };
  for (const { before, first, after, start, length } of spans) {
    for (let i = 0; i < length; i++) {
      before.getVertexPosition(first + i, p).applyMatrix4(before.matrixWorld);
      after.getVertexPosition(start + i, q).applyMatrix4(after.matrixWorld);
      const error = p.distanceTo(q);
      if (error > worst.error || !worst.mesh) {
        Object.assign(worst, { error, vertex: start + i, mesh: after, point: point.copy(q) });
      }
      visit(after, start + i, error);
    }
  }
  return worst;
}

/** Measure, and color the meshes of B on the way. scale: m that are fully red. */
export function paint(spans, scale) {
  const color = new Color();
  for (const mesh of new Set(spans.map((span) => span.after))) {
    lookOf(mesh).heatColors ??= new BufferAttribute(new Float32Array(3 * count(mesh)), 3);
    setColors(mesh, lookOf(mesh).heatColors);
  }
  return measure(spans, (mesh, vertex, error) => {
    heatColor(error / scale, color).toArray(lookOf(mesh).heatColors.array, 3 * vertex);
  });
}

/** Distances of nodes of B from those of the same name in A, where meshes can't be paired: colors by index. */
export function nodeColors(sides, scale) {
  const [a, b] = sides;
  const byName = new Map([...a.nodes.values()].map((node) => [node.name, node]));
  const [p, q] = [new Vector3(), new Vector3()];
  const colors = new Map();
  for (const node of b.nodes.values()) {
    const other = byName.get(node.name);
    if (!other) continue;
    p.setFromMatrixPosition(node.object.matrixWorld);
    q.setFromMatrixPosition(other.object.matrixWorld);
    colors.set(node.index, heatColor(p.distanceTo(q) / scale, new Color()));
  }
  return colors;
}

function count(mesh) {
  return mesh.geometry.attributes.position.count;
}

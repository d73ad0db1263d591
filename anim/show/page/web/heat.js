// Heat: vertices of B colored by the distance to the same vertices of A.
//
// three.js poses both on the CPU (0.4 to 2 µs per vertex), so that any number of morph targets and joints works.

import { BufferAttribute, Color, Vector3 } from "three";
import { setColors } from "./materials.js";

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

/** Meshes of B with those of A that have as many vertices: by node and primitive name, then by order. */
export function pairMeshes(sides) {
  if (sides.length < 2) return [];
  const [a, b] = sides.map((side) => side.meshes);
  const free = new Set(a);
  const pairs = [];
  for (const [i, mesh] of b.entries()) {
    const fits = (other) => free.has(other) && count(other) === count(mesh);
    const other = a.find((each) => fits(each) && each.name === mesh.name) ?? (fits(a[i]) ? a[i] : null);
    if (!other) continue;
    free.delete(other);
    pairs.push([other, mesh]);
  }
  return pairs;
}

export function countVertices(pairs) {
  return pairs.reduce((sum, [, mesh]) => sum + count(mesh), 0);
}

/** The largest distance between paired vertices in the present pose: {error, vertex, mesh, point}. */
export function measure(pairs, visit = () => {}) {
  const [p, q, point] = [new Vector3(), new Vector3(), new Vector3()];
  const worst = { error: 0, vertex: -1, mesh: null, point };
  for (const [before, after] of pairs) {
    for (let i = 0; i < count(after); i++) {
      before.getVertexPosition(i, p).applyMatrix4(before.matrixWorld);
      after.getVertexPosition(i, q).applyMatrix4(after.matrixWorld);
      const error = p.distanceTo(q);
      if (error > worst.error) Object.assign(worst, { error, vertex: i, mesh: after, point: point.copy(q) });
      visit(after, i, error);
    }
  }
  return worst;
}

/** Measure, and color the meshes of B on the way. scale: m that are fully red. */
export function paint(pairs, scale) {
  const color = new Color();
  for (const [, mesh] of pairs) {
    mesh.userData.heatColors ??= new BufferAttribute(new Float32Array(3 * count(mesh)), 3);
    setColors(mesh, mesh.userData.heatColors);
  }
  return measure(pairs, (mesh, vertex, error) => {
    heatColor(error / scale, color).toArray(mesh.userData.heatColors.array, 3 * vertex);
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

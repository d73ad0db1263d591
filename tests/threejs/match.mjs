// What of one file is what of the other: nodes and clips by name, then by order; surfaces by vertex, else by node.
import { carried } from "./surfaces.mjs";

const SAME = 1e-6; // of the diagonal: vertices nearer than this in their own space are the same vertex

// Returns the other file's object for each node of the truth; undefined where it has none.
export function nodes(truth, other) {
  const pairs = byName(truth.names, other.names);
  const sameOrder = truth.names.length === other.names.length;
  return truth.names.map((name, i) => other.nodes[pairs[i] ?? (sameOrder && !name && !other.names[i] ? i : -1)]);
}

// Returns {pairs: [[clip, clip or undefined]], missing: [name], extra: [name]}.
export function clips(truth, other) {
  const found = byName(truth.map((each) => each.name), other.map((each) => each.name));
  const left = other.map((_, i) => i).filter((i) => !found.includes(i));
  const all = truth.map((clip, i) => [clip, other[found[i] ?? left.shift()]]);
  return {
    pairs: all,
    missing: all.filter(([, theirs]) => !theirs).map(([ours]) => ours.name),
    extra: left.map((i) => other[i].name),
  };
}

// Returns [truth's, other's] for each surface of the truth, and of how many the other's own vertices are taken. Where
// the vertices don't agree (peers quantize and reorder meshes), the truth's vertices ride on the other's nodes.
export function surfacePairs(truth, other, objects, nodesOfTruth, size) {
  const counterpart = byOrderIn(truth, other, objects);
  const morphing = other.filter((each) => each.targets.length);
  let own = 0;
  const pairs = truth.map((ours) => {
    const theirs = counterpart(ours);
    if (theirs && agree(ours, theirs, SAME * size)) return own++, [ours, theirs];
    const carriers = ours.carriers.map((carrier) => matched(carrier, objects, nodesOfTruth));
    const morphed = ours.targets.length ? morphing.shift()?.mesh : ours.mesh;
    if (morphed?.morphTargetInfluences?.length !== ours.mesh.morphTargetInfluences?.length) {
      throw new Error(`the morph targets of node ${ours.node} are not in the other file`);
    }
    return [ours, carried(ours, carriers, morphed)];
  });
  return { pairs, own };
}

function byName(wanted, offered) {
  const places = new Map();
  offered.forEach((name, i) => name && places.set(name, [...(places.get(name) ?? []), i]));
  return wanted.map((name) => places.get(name)?.shift());
}

// The n-th primitive on a node is the n-th primitive on the node that it is in the other file.
function byOrderIn(truth, other, objects) {
  return (ours) => {
    const place = truth.filter((each) => each.node === ours.node).indexOf(ours);
    const object = objects[ours.node];
    return other.filter(({ mesh }) => object && (mesh === object || mesh.parent === object))[place];
  };
}

function agree(ours, theirs, tolerance) {
  if (ours.points.length !== theirs.points.length || ours.targets.length !== theirs.targets.length) return false;
  return ours.points.every((each, i) => Math.abs(each - theirs.points[i]) <= tolerance);
}

function matched(carrier, objects, nodesOfTruth) {
  const number = nodesOfTruth.indexOf(carrier);
  if (!objects[number]) throw new Error(`node ${number} '${carrier.name}' carries vertices and is not in the other file`);
  return objects[number];
}

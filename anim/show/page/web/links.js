// Links from nodes to their parents: bones, and those that only guide others, such as roots and controls of IK.

import { Vector3 } from "three";

const MAX_END_PER_RADIUS = 0.35; // length of a bone to a node without vertices, in radii of the model; longer to controls

/**
 * Links [parent, child] between the nearest of the shown nodes: {bones, guides}. In a file with skins a bone begins below
 * a node that moves vertices, and ends at one that does, itself or by its children; or it is the short end of a chain.
 */
export function nodeLinks(side, nodes) {
  const indices = new Set(nodes.map((node) => node.index));
  const links = nodes.flatMap((node) => {
    const parent = ancestors(side, node).find((each) => indices.has(each.index));
    return parent ? [[parent, node]] : [];
  });
  const isSkinned = side.meshes.some((mesh) => mesh.isSkinnedMesh);
  if (!isSkinned) return { bones: links, guides: [] };
  const moving = movingNodes(side);
  const above = new Set([...moving].flatMap((index) => ancestors(side, side.nodes.get(index)).map((each) => each.index)));
  const maxEnd = MAX_END_PER_RADIUS * radiusOf(nodes);
  const isBone = ([parent, child]) => {
    const isBelow = [parent, ...ancestors(side, parent)].some((each) => moving.has(each.index));
    if (!isBelow) return false;
    if (moving.has(child.index) || above.has(child.index)) return true;
    return moving.has(parent.index) && distance(parent, child) <= maxEnd;
  };
  return { bones: links.filter(isBone), guides: links.filter((link) => !isBone(link)) };
}

/** Parent, its parent and so on, of a node. */
function ancestors(side, node) {
  const found = [];
  for (let each = side.nodes.get(node.parent); each; each = side.nodes.get(each.parent)) found.push(each);
  return found;
}

/** Indices of nodes with meshes of their own, and of joints with weights. */
function movingNodes(side) {
  const byObject = new Map([...side.nodes.values()].map((node) => [node.object, node.index]));
  const found = new Set();
  for (const mesh of side.meshes) {
    if (!mesh.isSkinnedMesh) found.add(side.owners.get(mesh));
    else for (const joint of weightedJoints(mesh.geometry.attributes)) found.add(byObject.get(mesh.skeleton.bones[joint]));
  }
  found.delete(undefined);
  return found;
}

function weightedJoints({ skinIndex, skinWeight }) {
  const found = new Set();
  for (let i = 0; i < (skinWeight?.count ?? 0); i++) {
    for (let c = 0; c < skinWeight.itemSize; c++) if (skinWeight.getComponent(i, c) > 0) found.add(skinIndex.getComponent(i, c));
  }
  return found;
}

function radiusOf(nodes) {
  const place = new Vector3();
  const low = new Vector3(Infinity, Infinity, Infinity);
  const high = low.clone().negate();
  for (const node of nodes) {
    place.setFromMatrixPosition(node.object.matrixWorld);
    low.min(place);
    high.max(place);
  }
  return high.distanceTo(low) / 2;
}

function distance(one, other) {
  const [p, q] = [one, other].map((node) => new Vector3().setFromMatrixPosition(node.object.matrixWorld));
  return p.distanceTo(q);
}

// Links from nodes to their parents: bones, and those that only guide others, such as roots and controls of IK.

import { Box3, Vector3 } from "three";

const MAX_END_PER_RADIUS = 0.35; // length of a bone to a node without vertices, in radii of the model; longer to controls

/**
 * Links [parent, child] between the nearest of the shown nodes of a posed side: {bones, guides}. In a file with skins a
 * bone begins below a node that moves vertices, and ends at one that does, itself or by its children; or it is the short
 * end of a chain.
 */
export function nodeLinks(side, shown) {
  const links = nearestLinks(side, new Set(shown.map((node) => node.index)));
  if (!side.meshes.some((mesh) => mesh.isSkinnedMesh)) return { bones: links, guides: [] };
  const moving = movingNodes(side);
  const [above, below] = [aboveNodes(side, moving), belowNodes(side, moving)];
  const maxEnd = MAX_END_PER_RADIUS * radiusOf(shown);
  const isBone = ([parent, child]) => {
    if (!below.has(parent.index)) return false;
    if (above.has(child.index)) return true;
    return moving.has(parent.index) && positionOf(parent).distanceTo(positionOf(child)) <= maxEnd;
  };
  return { bones: links.filter(isBone), guides: links.filter((link) => !isBone(link)) };
}

/** Links of shown nodes to the nearest shown one above each. Nodes of a side begin with the parents. */
function nearestLinks({ nodes }, shown) {
  const nearest = new Map([[null, null]]); // by parent: it, or what is shown above it
  const links = [];
  for (const node of nodes.values()) {
    const parent = nearest.get(node.parent);
    nearest.set(node.index, shown.has(node.index) ? node : parent);
    if (parent && shown.has(node.index)) links.push([parent, node]);
  }
  return links;
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

/** The nodes themselves and all above them. */
function aboveNodes({ nodes }, indices) {
  const found = new Set();
  for (const index of indices) {
    for (let each = nodes.get(index); each && !found.has(each.index); each = nodes.get(each.parent)) found.add(each.index);
  }
  return found;
}

/** The nodes themselves and all below them. */
function belowNodes({ nodes }, indices) {
  const found = new Set();
  for (const { index, parent } of nodes.values()) if (indices.has(index) || found.has(parent)) found.add(index);
  return found;
}

function radiusOf(nodes) {
  return new Box3().setFromPoints(nodes.map(positionOf)).getSize(new Vector3()).length() / 2;
}

function positionOf(node) {
  return new Vector3().setFromMatrixPosition(node.object.matrixWorld);
}

// The skeleton: an octahedron from each joint to its child, seen through the skin; dashes from roots and to controls.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  InstancedMesh,
  LineDashedMaterial,
  LineSegments,
  Matrix4,
  MeshLambertMaterial,
  OctahedronGeometry,
  Quaternion,
  Vector3,
} from "three";
import { nodeLinks } from "./links.js";

const BONE_COLOR = 0x8fa8d8;
const CHOSEN_COLOR = 0xff9d2e;
const WIDTH_PER_LENGTH = 0.13;
const JOINT_PER_RADIUS = 0.011;
const DASH_PER_RADIUS = 0.02;
const UP = new Vector3(0, 1, 0);

export class Bones {
  constructor(side) {
    this.side = side;
    this.nodes = shownNodes(side);
    const { bones, guides } = nodeLinks(side, this.nodes);
    [this.links, this.guides] = [bones, guides];
    this.lines = dashes(guides.length);
    this.bones = instances(boneShape(), this.links.length);
    this.joints = instances(new OctahedronGeometry(1, 1), this.nodes.length);
    side.overlay.add(this.lines, this.bones, this.joints);
  }

  /** Follow the pose. chosen: index of the highlighted node. colors: of nodes by index, instead of their own. */
  update(isShown, radius, chosen, colors) {
    this.bones.visible = this.lines.visible = isShown;
    this.joints.visible = isShown || Boolean(colors);
    if (!this.joints.visible) {
      if (chosen !== null && this.side.nodes.has(chosen)) this.#mark(radius, chosen);
      return;
    }
    const [from, to, along, size] = [new Vector3(), new Vector3(), new Vector3(), new Vector3()];
    const [matrix, turn, color] = [new Matrix4(), new Quaternion(), new Color()];
    for (const [i, [parent, child]] of this.links.entries()) {
      from.setFromMatrixPosition(parent.object.matrixWorld);
      to.setFromMatrixPosition(child.object.matrixWorld);
      const length = along.subVectors(to, from).length();
      turn.setFromUnitVectors(UP, along.normalize());
      const width = Math.min(length * WIDTH_PER_LENGTH, radius * 0.05);
      this.bones.setMatrixAt(i, matrix.compose(from, turn, size.set(width, length, width)));
      this.bones.setColorAt(i, color.set(parent.index === chosen ? CHOSEN_COLOR : BONE_COLOR));
    }
    for (const [i, node] of this.nodes.entries()) {
      const isChosen = node.index === chosen;
      from.setFromMatrixPosition(node.object.matrixWorld);
      size.setScalar(radius * JOINT_PER_RADIUS * (isChosen ? 1.8 : 1));
      this.joints.setMatrixAt(i, matrix.compose(from, turn.identity(), size));
      this.joints.setColorAt(i, color.set(isChosen ? CHOSEN_COLOR : colors?.get(node.index) ?? 0xffffff));
    }
    this.#show(this.links.length, this.nodes.length);
    this.#moveLines(radius);
  }

  #moveLines(radius) {
    const place = new Vector3();
    const ends = this.lines.geometry.attributes.position;
    for (const [i, node] of this.guides.flat().entries()) {
      place.setFromMatrixPosition(node.object.matrixWorld).toArray(ends.array, 3 * i);
    }
    ends.needsUpdate = true;
    this.lines.computeLineDistances();
    this.lines.material.dashSize = this.lines.material.gapSize = radius * DASH_PER_RADIUS;
  }

  /** Only the chosen node, while the skeleton is not shown. */
  #mark(radius, chosen) {
    const place = new Vector3().setFromMatrixPosition(this.side.nodes.get(chosen).object.matrixWorld);
    const size = new Vector3().setScalar(radius * JOINT_PER_RADIUS * 1.5);
    this.joints.setMatrixAt(0, new Matrix4().compose(place, new Quaternion(), size));
    this.joints.setColorAt(0, new Color(CHOSEN_COLOR));
    this.joints.visible = this.nodes.length > 0;
    this.#show(0, 1);
  }

  #show(bones, joints) {
    this.bones.count = bones;
    this.joints.count = joints;
    for (const mesh of [this.bones, this.joints]) {
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }
}

/** Joints of skins and animated nodes; all nodes of a file that has neither. */
function shownNodes(side) {
  const animated = new Set();
  for (const clip of side.gltf.parser.json.animations ?? []) {
    for (const channel of clip.channels) animated.add(channel.target.node);
  }
  const nodes = [...side.nodes.values()];
  const found = nodes.filter((node) => node.isJoint || animated.has(node.index));
  return found.length ? found : nodes;
}

function boneShape() {
  const shape = new OctahedronGeometry(1);
  const place = shape.attributes.position;
  for (let i = 0; i < place.count; i++) {
    const y = place.getY(i);
    place.setY(i, y > 0.5 ? 1 : y < -0.5 ? 0 : 0.16);
  }
  shape.computeVertexNormals();
  return shape;
}

function dashes(count) {
  const shape = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(6 * count), 3));
  const lines = new LineSegments(shape, new LineDashedMaterial({ color: BONE_COLOR, depthTest: false, transparent: true }));
  lines.frustumCulled = false;
  lines.renderOrder = 10;
  lines.visible = false;
  return lines;
}

function instances(shape, count) {
  // Without a depth test bones are seen through the skin; convex shapes need none among their own faces
  const material = new MeshLambertMaterial({ depthTest: false, transparent: true, opacity: 0.92, flatShading: true });
  const mesh = new InstancedMesh(shape, material, Math.max(count, 1));
  mesh.frustumCulled = false;
  mesh.renderOrder = 10;
  mesh.visible = false;
  return mesh;
}

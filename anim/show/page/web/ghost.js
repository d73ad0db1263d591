// The ghost of A over B: where A is outside of B, and fainter where it is inside. Where both surfaces agree, B keeps its colors.

import {
  AlwaysStencilFunc,
  DoubleSide,
  EqualStencilFunc,
  IncrementStencilOp,
  KeepStencilOp,
  MeshBasicMaterial,
  NotEqualStencilFunc,
  PerspectiveCamera,
  ReplaceStencilOp,
  Vector3,
} from "three";

const COLOR = 0x2f62f6;
const OUTSIDE_OPACITY = 0.5;
const INSIDE_OPACITY = 0.25; // none over heat, whose colors would change
const TOLERANCE_PER_RADIUS = 0.0025; // between surfaces that agree

export class Ghost {
  constructor() {
    this.camera = new PerspectiveCamera();
    // Each pixel once: 1 in the stencil where A is not behind B, then what is 0, then what is before B
    const inside = { stencilFunc: EqualStencilFunc, stencilRef: 0, stencilZPass: IncrementStencilOp, depthTest: false };
    this.front = ghostly({ colorWrite: false, stencilFunc: AlwaysStencilFunc, stencilRef: 1 });
    this.inside = ghostly({ opacity: INSIDE_OPACITY, ...inside });
    this.outside = ghostly({ opacity: OUTSIDE_OPACITY, stencilFunc: NotEqualStencilFunc, stencilRef: 2 });
  }

  /** Draw the models of a posed file over the picture of another by the same camera. hidden: objects to leave out. */
  draw(renderer, { scene }, camera, { target, radius, hidden, isHeat }) {
    const shift = depthShift(camera, target, TOLERANCE_PER_RADIUS * radius);
    const wasShown = hidden.map((each) => each.visible);
    for (const each of hidden) each.visible = false;
    renderer.autoClear = false;
    const inside = isHeat ? [] : [[this.front, -1], [this.inside, 0]];
    for (const [material, direction] of [...inside, [this.outside, 1]]) {
      this.camera.copy(camera);
      this.camera.projectionMatrix.elements[10] -= direction * shift;
      scene.overrideMaterial = material;
      renderer.render(scene, this.camera);
    }
    scene.overrideMaterial = null;
    renderer.autoClear = true;
    hidden.forEach((each, i) => (each.visible = wasShown[i]));
  }
}

/** Difference of depth, in normalized coordinates, of two points at the target that are `length` apart. */
function depthShift(camera, target, length) {
  const distance = new Vector3().copy(camera.position).distanceTo(target);
  return Math.abs(camera.projectionMatrix.elements[14] / distance ** 2) * length;
}

function ghostly(options) {
  return new MeshBasicMaterial({
    color: COLOR,
    side: DoubleSide,
    transparent: true,
    depthWrite: false,
    stencilWrite: true,
    stencilFail: KeepStencilOp,
    stencilZFail: KeepStencilOp,
    stencilZPass: ReplaceStencilOp,
    ...options,
  });
}

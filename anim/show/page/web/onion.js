// Onion skins: the model at four other times behind it, before in blue and after in orange; gray beside heat.

import { AnimationMixer, MeshBasicMaterial } from "three";
import { clone } from "three/examples/jsm/utils/SkeletonUtils.js";

const STEPS = [-2, -1, 1, 2];
const STEP_PER_DURATION = 1 / 12;
const BEFORE_COLOR = 0x3b82f6;
const AFTER_COLOR = 0xf97316;
const HEAT_COLOR = 0x8c8f96; // of both, which no color of the heat is
const BEHIND = 1e8; // units of depth: farther than everything else

export class Onion {
  constructor(side) {
    this.side = side;
    this.ghosts = [];
  }

  update(isShown, time, isHeat) {
    if (!isShown || !this.side.clip) {
      for (const ghost of this.ghosts) ghost.root.removeFromParent();
      this.ghosts = [];
      return;
    }
    if (!this.ghosts.length || this.clip !== this.side.clip) this.#build();
    const duration = this.clip.duration;
    for (const ghost of this.ghosts) {
      ghost.material.color.set(isHeat ? HEAT_COLOR : ghost.step < 0 ? BEFORE_COLOR : AFTER_COLOR);
      const then = time + ghost.step * duration * STEP_PER_DURATION;
      ghost.root.visible = then >= 0 && then <= duration;
      ghost.action.time = Math.max(0, Math.min(then, duration));
      ghost.mixer.update(0);
    }
  }

  #build() {
    this.update(false, 0);
    this.clip = this.side.clip;
    this.ghosts = STEPS.map((step) => {
      const root = clone(this.side.root);
      const material = new MeshBasicMaterial({
        transparent: true,
        opacity: Math.abs(step) === 1 ? 0.22 : 0.11,
        depthWrite: false,
        polygonOffset: true,
        polygonOffsetUnits: BEHIND,
      });
      root.traverse((object) => {
        if (object.isMesh) object.material = material;
      });
      this.side.overlay.add(root);
      const mixer = new AnimationMixer(root);
      return { step, root, mixer, material, action: mixer.clipAction(this.clip).play() };
    });
  }
}

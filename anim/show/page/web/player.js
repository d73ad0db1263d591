// The player: files, time, picture, timeline and curves, in the state that `state.js` holds.

import { Vector3 } from "three";
import { Bones } from "./bones.js";
import { Curves, areEqual } from "./curves.js";
import { facts } from "./data.js";
import { $ } from "./dom.js";
import { formatLength, roundUp } from "./format.js";
import { MAX_LIVE_VERTICES, MeshPairs, measure, nodeColors, paint } from "./heat.js";
import { applyMaterials } from "./materials.js";
import { Onion } from "./onion.js";
import { Stage } from "./stage.js";
import { state, update } from "./state.js";
import { Timeline } from "./timeline.js";

const KEY_TOLERANCE_S = 1e-5;
const MAX_TICK_S = 0.1; // of the clock between two pictures, after the tab was hidden
const MAX_PICK_PX = 18;
const PIN_LABEL_PX = 15; // from the ring's center to its label
const HEAT_PER_DIAGONAL = 0.01; // scale of heat where no error is known

/** The files of the page, what is shown of them, and time. */
export class Player {
  constructor(sides) {
    this.sides = sides;
    this.stage = new Stage($("#view canvas"), sides);
    for (const side of sides) side.pose(0);
    this.extras = sides.map((side) => ({ bones: new Bones(side), onion: new Onion(side) }));
    this.pairs = new MeshPairs(sides, facts.meshes);
    this.isLive = this.pairs.vertexCount <= MAX_LIVE_VERTICES;
    this.timeline = new Timeline($("#scrub"), (time) => this.seek(time, { pause: true }));
    this.curves = new Curves($("#curves"), (time) => this.seek(time, { pause: true }));
    this.firstTab = ""; // name of the list that is shown at first
    this.isDirty = true;
    this.last = 0;
    this.frames = 0; // animation frames so far
    this.framed = null; // index of the node that F framed
    this.stage.controls.addEventListener("change", () => (this.isDirty = true));
  }

  get duration() {
    return Math.max(1e-6, ...this.sides.map((side) => side.clip?.duration ?? 0));
  }

  /** Whether both files play the clip; B may lack it. */
  get isPaired() {
    const [a, b] = this.sides;
    return Boolean(b) && (Boolean(b.clip) || !a.clip);
  }

  /** Key times of the chosen node's tracks; of all tracks if it has none. */
  get keys() {
    const [side] = this.sides;
    const chosen = state.node === null ? [] : side.tracks?.get(state.node) ?? [];
    const tracks = chosen.length ? chosen.map((each) => each.track) : side.clip?.tracks ?? [];
    return [...new Set(tracks.flatMap((track) => [...track.times]))].sort((p, q) => p - q);
  }

  chooseClip(index, time = 0) {
    const [a, b] = this.sides;
    a.choose(a.clips[index]);
    if (b) b.choose(b.clips[facts.partners?.[index] ?? this.#samePlace(index)]);
    const direction = 1;
    state.clip = -1; // so that listeners hear of the same clip in a new file, too
    update({ clip: index, time: Math.max(0, Math.min(time, this.duration)), direction });
  }

  #samePlace(index) {
    const [a, b] = this.sides;
    const named = b.clipNames.indexOf(a.clipNames[index]);
    if (named >= 0) return named;
    return a.clips.length === b.clips.length && !Object.keys(facts.partners ?? {}).length ? index : -1;
  }

  seek(time, { pause = false } = {}) {
    update({ time: Math.max(0, Math.min(time, this.duration)), playing: pause ? false : state.playing });
  }

  play() {
    if (!this.sides[0].clip) return;
    const atEnd = state.loop === "once" && state.time >= this.duration;
    update({ playing: !state.playing, time: atEnd ? 0 : state.time, direction: 1 });
  }

  /** Go to a clip, node and time of the file, as a finding or a worst position names them. */
  follow({ clip, node, time }) {
    if (clip !== undefined && clip !== null && clip !== state.clip) this.chooseClip(clip);
    if (node !== undefined && node !== null) update({ node });
    if (time !== undefined && time !== null) this.seek(time, { pause: true });
  }

  nextKey(direction) {
    const keys = direction > 0 ? this.keys : this.keys.reverse();
    const next = keys.find((key) => direction * (key - state.time) > KEY_TOLERANCE_S);
    this.seek(next ?? (direction > 0 ? this.duration : 0), { pause: true });
  }

  /** Largest distance between both files in the present pose. */
  worst() {
    for (const side of this.sides) side.pose(state.time);
    return measure(this.pairs.spans());
  }

  /** Scale of the heat that suits the clip: m that are fully red. */
  get ownHeatScale() {
    const known = facts.errors?.[state.clip]?.max;
    return known ? roundUp(known) : roundUp(2 * this.stage.radius * HEAT_PER_DIAGONAL);
  }

  resetHeatScale() {
    update({ heatScale: this.ownHeatScale });
  }

  advance(seconds) {
    let time = state.time + seconds * state.speed * state.direction;
    const { duration } = this;
    if (time >= 0 && time <= duration) return this.seek(time);
    if (state.loop === "loop") return this.seek(((time % duration) + duration) % duration);
    if (state.loop === "once") return update({ time: duration, playing: false });
    time = time > duration ? 2 * duration - time : -time;
    update({ direction: -state.direction, time: Math.max(0, Math.min(time, duration)) });
  }

  tick(now) {
    const seconds = Math.min((now - this.last) / 1000, MAX_TICK_S);
    this.last = now;
    this.frames++;
    if (state.playing) this.advance(seconds);
    if (this.stage.controls.update() || this.isDirty) {
      this.isDirty = false;
      this.draw();
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  draw() {
    for (const side of this.sides) side.pose(state.time);
    const worst = this.#measure();
    const isShown = state.show.has("heat") && this.isPaired;
    const heat = isShown && this.pairs.isEmpty ? nodeColors(this.sides, state.heatScale) : null;
    this.stage.draw((side) => {
      const { bones, onion } = this.extras[this.sides.indexOf(side)];
      onion.update(state.show.has("onion"), state.time, isShown);
      const colors = side === this.sides[1] ? heat : null;
      bones.update(state.show.has("bones"), this.stage.radius, this.#nodeIn(side), colors);
    });
    this.#markWorst(isShown ? worst : null); // after the picture, whose camera it needs
    this.timeline.move(state.time);
    if (state.show.has("curves")) this.#drawCurves();
  }

  /** Largest distance in the present pose, without a mesh if unknown; colors B on the way where heat is shown. */
  #measure() {
    if (this.sides.length < 2) return null;
    const isHeat = state.show.has("heat");
    const isMeasured = this.isPaired && (!state.playing || (isHeat && this.isLive));
    const spans = isMeasured ? this.pairs.spans() : [];
    const worst = isHeat ? paint(spans, state.heatScale) : measure(spans);
    const reason = !this.isPaired ? "has no such clip" : this.pairs.isEmpty ? "other vertices" : "";
    $("#worst").textContent = worst?.mesh ? formatLength(worst.error) : reason;
    return worst;
  }

  #markWorst(worst) {
    const spot = worst?.mesh ? this.stage.project(worst.point, this.sides[1]) : null;
    const pin = $("#pin");
    pin.hidden = !spot;
    if (!spot) return;
    pin.style.transform = `translate(${spot.x}px, ${spot.y}px)`;
    const label = pin.firstElementChild;
    label.textContent = formatLength(worst.error);
    pin.classList.toggle("at-edge", spot.x + PIN_LABEL_PX + label.offsetWidth > pin.parentNode.clientWidth);
  }

  /** The chosen node of A in a side: the same one, or that of the same name. */
  #nodeIn(side) {
    if (state.node === null || side === this.sides[0]) return state.node;
    const name = this.sides[0].nodes.get(state.node)?.name;
    return [...side.nodes.values()].find((node) => node.name === name)?.index ?? null;
  }

  /** Aim the camera at the chosen node, where the shown file has it. */
  frameNode() {
    const [side] = this.stage.shown;
    const node = side.nodes.get(this.#nodeIn(side));
    if (!node) return;
    side.pose(state.time);
    this.stage.frame(side, node);
    this.framed = state.node;
    this.isDirty = true;
  }

  /** Name the parents where the chosen node has the same curves in both files. */
  compareCurves() {
    const nodes = this.isPaired ? this.sides.map((side) => this.#motionIn(side)) : [];
    const isKnown = nodes.length > 1 && nodes.every(({ rest, isSkinned }) => rest && !isSkinned);
    $("#curves-equal").hidden = !(isKnown && areEqual(...nodes, this.duration));
  }

  /** Tracks and rest pose of the chosen node in a side, and whether it only names a mesh that joints move. */
  #motionIn(side) {
    const index = this.#nodeIn(side);
    const isSkinned = side.meshes.some((mesh) => mesh.isSkinnedMesh && side.owners.get(mesh) === index);
    return { tracks: side.tracks?.get(index) ?? [], rest: side.nodes.get(index)?.rest, isSkinned };
  }

  #drawCurves() {
    const sides = this.sides.map((side) => this.#motionIn(side));
    const name = state.node === null ? null : this.sides[0].nodes.get(state.node)?.name;
    $("#curves-name").textContent = name ?? "Curves";
    const message = name ? `'${name}' has no track in this clip` : "Choose a node in the list, or click a joint";
    this.curves.draw({ sides, duration: this.duration, time: state.time, unit: state.unit, message });
  }

  drawTimeline() {
    const curve = facts.errors?.[state.clip] ?? null;
    this.timeline.draw({ duration: this.duration, keys: this.keys, curve: curve?.times?.length ? curve : null });
  }

  applyMaterials() {
    const heated = new Set(state.show.has("heat") && this.isPaired ? this.pairs.heated : []);
    for (const side of this.sides) applyMaterials(side, state.show, heated);
  }

  /** The node nearest to a click, within some pixels. */
  pick(x, y) {
    let best = { distance: MAX_PICK_PX, index: null };
    const place = new Vector3();
    for (const node of this.extras[0].bones.nodes) {
      const spot = this.stage.project(place.setFromMatrixPosition(node.object.matrixWorld), this.stage.shown[0]);
      const distance = spot ? Math.hypot(spot.x - x, spot.y - y) : Infinity;
      if (distance < best.distance) best = { distance, index: node.index };
    }
    if (best.index !== null) update({ node: best.index, show: new Set([...state.show, "curves"]) });
  }
}

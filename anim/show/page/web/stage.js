// The picture: renderer, one camera for both files, floor, and the frame that fits what moves.

import { Box3, Mesh, PerspectiveCamera, PlaneGeometry, ShaderMaterial, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { formatLength, roundDown } from "./format.js";
import { Ghost } from "./ghost.js";
import { state } from "./state.js";
import { listenToWheel, zoomTo } from "./camera.js";

const FIT_TIMES = 5; // of the clip
const MAX_FIT_VERTICES = 400; // per mesh and time
const FILLED = 0.8; // of the view's height or width, by the model
const MIN_FRAME_PER_RADIUS = 0.15; // radius around a framed node, in radii of the model
const MAX_PIXEL_RATIO = 2;
const CAMERA_DIGITS = 3; // of the camera in the address, below the radius of the model
const MAX_DECIMALS = 12;
const MAX_ZOOM = 50; // of the wheel, from the camera that frames everything
const FLOOR_RADII = 6; // radius of the floor, in radii of the model
const DIRECTION = new Vector3(0.55, 0.28, 0.85); // of the camera: from a front at +Z, a little from the left and above

export class Stage {
  constructor(canvas, sides) {
    this.sides = sides;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, stencil: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MAX_PIXEL_RATIO));
    this.renderer.setScissorTest(true);
    this.camera = new PerspectiveCamera(32);
    listenToWheel(canvas, (scale, x, y) => this.#zoom(scale, x, y));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.dampingFactor = 0.12;
    this.floors = sides.map((side) => {
      const mesh = floor();
      side.scene.add(mesh);
      return mesh;
    });
    this.ghost = new Ghost();
    this.radius = 1;
    this.cell = 1;
    this.framed = ""; // camera that frames everything, as text, and what it frames
  }

  /** 1 if the figures look along +Z, -1 along -Z; of two files those of the first. */
  get front() {
    return this.sides[0].front;
  }

  get shown() {
    if (state.side === "both" || this.sides.length < 2) return this.sides;
    return [this.sides[state.side === "a" ? 0 : 1]];
  }

  /** Aim the camera at everything that moves, at some times of the clip, so that it fills a view. */
  fit(duration) {
    const points = this.#points(duration);
    const box = new Box3().setFromPoints(points);
    if (box.isEmpty()) box.set(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
    const center = box.getCenter(new Vector3());
    this.radius = box.getSize(new Vector3()).length() / 2 || 1;
    const distance = this.#distance(points, center);
    this.camera.near = distance / 100;
    this.camera.far = distance * 50;
    this.camera.position.copy(this.#direction).setLength(distance).add(center);
    this.controls.target.copy(center);
    this.controls.minDistance = distance / MAX_ZOOM;
    this.controls.maxDistance = distance * 10;
    this.controls.update();
    this.framed = `${this.#camera} ${this.#subject}`;
    this.cell = roundDown(this.radius / 2);
    for (const mesh of this.floors) {
      mesh.scale.setScalar(this.radius * FLOOR_RADII);
      mesh.position.set(center.x, box.min.y, center.z);
      mesh.material.uniforms.cell.value = this.cell;
    }
  }

  /** Aim the camera from its present direction at a node of a posed file: its children and its own meshes. */
  frame(side, node) {
    const nodes = [...side.nodes.values()].filter((each) => each === node || each.parent === node.index);
    const points = nodes.map((each) => new Vector3().setFromMatrixPosition(each.object.matrixWorld));
    for (const mesh of side.meshes) if (side.owners.get(mesh) === node.index) addVertices(points, mesh);
    const box = new Box3().setFromPoints(points);
    const radius = Math.max(box.getSize(new Vector3()).length() / 2, this.radius * MIN_FRAME_PER_RADIUS);
    const { clientWidth, clientHeight } = this.renderer.domElement.parentNode;
    const aspect = Math.min(1, clientWidth / clientHeight / this.shown.length);
    const distance = radius / (Math.tan((this.camera.fov * Math.PI) / 360) * FILLED * aspect);
    const offset = this.camera.position.clone().sub(this.controls.target).setLength(distance);
    box.getCenter(this.controls.target);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
  }

  /** Position and target of the camera for the address: "x,y,z,x,y,z"; "" while it frames the clip and side shown. */
  get cameraText() {
    return `${this.#camera} ${this.#subject}` === this.framed ? "" : this.#camera;
  }

  /** From the target to the camera that frames everything. */
  get #direction() {
    return DIRECTION.clone().multiply(new Vector3(this.front, 1, this.front));
  }

  get #subject() {
    return `${state.clip} ${this.shown.length}`;
  }

  get #camera() {
    const decimals = Math.max(0, Math.min(CAMERA_DIGITS - Math.floor(Math.log10(this.radius)), MAX_DECIMALS));
    const parts = [...this.camera.position.toArray(), ...this.controls.target.toArray()];
    return parts.map((part) => String(Number(part.toFixed(decimals)))).join(",");
  }

  /** Put the camera where `cameraText` says; text that names no camera changes nothing. */
  moveCamera(text) {
    const parts = text.split(",").map((part) => (part.trim() ? Number(part) : NaN));
    const [position, target] = [new Vector3(...parts.slice(0, 3)), new Vector3(...parts.slice(3))];
    if (parts.length !== 6 || !parts.every(Number.isFinite) || position.equals(target)) return;
    this.camera.position.copy(position);
    this.controls.target.copy(target);
    this.controls.update();
  }

  /** Zoom to a point of the canvas in CSS pixels: to that of its view. */
  #zoom(scale, x, y) {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentNode;
    const part = width / this.shown.length;
    zoomTo(this, scale, (2 * (x % part)) / part - 1, 1 - (2 * y) / height);
  }

  /** Positions of some vertices of all files, at some times; of nodes where there is no mesh. */
  #points(duration) {
    const points = [];
    for (const side of this.sides) {
      for (let i = 0; i < FIT_TIMES; i++) {
        side.pose((duration * i) / (FIT_TIMES - 1));
        for (const mesh of side.meshes) addVertices(points, mesh);
        if (side.meshes.length) continue;
        for (const node of side.nodes.values()) points.push(node.object.getWorldPosition(new Vector3()));
      }
    }
    return points;
  }

  /** The least distance of the camera from which all points are inside a view, with a margin. */
  #distance(points, center) {
    const { clientWidth, clientHeight } = this.renderer.domElement.parentNode;
    const aspect = clientWidth / clientHeight / this.shown.length;
    const tangent = Math.tan((this.camera.fov * Math.PI) / 360) * FILLED;
    const toCamera = this.#direction.normalize();
    const right = new Vector3(0, 1, 0).cross(toCamera).normalize();
    const up = toCamera.clone().cross(right);
    const spot = new Vector3();
    let distance = this.radius * 0.5;
    for (const point of points) {
      spot.subVectors(point, center);
      const needed = Math.max(Math.abs(spot.dot(right)) / (tangent * aspect), Math.abs(spot.dot(up)) / tangent);
      distance = Math.max(distance, needed + spot.dot(toCamera));
    }
    return distance;
  }

  get floorLabel() {
    return `grid ${formatLength(this.cell)}`;
  }

  /** Draw the shown files side by side; `prepare(side)` puts each in its pose first. */
  draw(prepare) {
    const { renderer, camera, shown } = this;
    const { clientWidth: width, clientHeight: height } = renderer.domElement.parentNode;
    const ratio = renderer.getPixelRatio();
    const canvas = renderer.domElement;
    if (canvas.width !== Math.floor(width * ratio) || canvas.height !== Math.floor(height * ratio)) {
      renderer.setSize(width, height, false);
    }
    const part = Math.floor(width / shown.length);
    camera.aspect = part / height;
    camera.updateProjectionMatrix();
    const ink = getComputedStyle(document.documentElement).getPropertyValue("--floor").trim();
    for (const [i, side] of shown.entries()) {
      prepare(side);
      this.floors[this.sides.indexOf(side)].material.uniforms.ink.value = Number(ink);
      renderer.setViewport(i * part, 0, part, height);
      renderer.setScissor(i * part, 0, part, height);
      renderer.render(side.scene, camera);
    }
    if (state.side === "over" && this.sides.length > 1) this.#drawGhost();
  }

  #drawGhost() {
    const [side] = this.sides;
    const hidden = [this.floors[0], side.overlay];
    const isHeat = state.show.has("heat");
    const { target } = this.controls;
    this.ghost.draw(this.renderer, side, this.camera, { target, radius: this.radius, hidden, isHeat });
  }

  /** Position of a point of the scene on the screen: CSS pixels in the view that shows `side`; null if behind. */
  project(point, side) {
    const index = this.shown.indexOf(side);
    if (index < 0) return null;
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentNode;
    const part = width / this.shown.length;
    const spot = point.clone().project(this.camera);
    if (spot.z > 1) return null;
    return { x: index * part + ((spot.x + 1) / 2) * part, y: ((1 - spot.y) / 2) * height };
  }
}

function addVertices(points, mesh) {
  const count = mesh.geometry.attributes.position.count;
  const step = Math.max(1, Math.floor(count / MAX_FIT_VERTICES));
  for (let i = 0; i < count; i += step) {
    points.push(mesh.getVertexPosition(i, new Vector3()).applyMatrix4(mesh.matrixWorld));
  }
}

/** A grid that fades out, with lines of one pixel at any distance. */
function floor() {
  const material = new ShaderMaterial({
    transparent: true,
    depthWrite: false,
    uniforms: { cell: { value: 1 }, ink: { value: 0.5 } },
    vertexShader: `
      varying vec2 place;
      varying vec2 from_center;
      void main() {
        vec4 world = modelMatrix * vec4(position, 1.0);
        place = world.xz;
        from_center = uv * 2.0 - 1.0;
        gl_Position = projectionMatrix * viewMatrix * world;
      }`,
    fragmentShader: `
      uniform float cell;
      uniform float ink;
      varying vec2 place;
      varying vec2 from_center;
      float lines(float size) {
        vec2 at = place / size;
        vec2 distance_px = abs(fract(at - 0.5) - 0.5) / max(fwidth(at), vec2(1e-6));
        return 1.0 - min(min(distance_px.x, distance_px.y), 1.0);
      }
      void main() {
        float fade = 1.0 - smoothstep(0.1, 0.75, length(from_center));
        gl_FragColor = vec4(vec3(ink), fade * max(lines(cell) * 0.3, lines(cell * 5.0) * 0.55));
      }`,
  });
  const mesh = new Mesh(new PlaneGeometry(2, 2).rotateX(-Math.PI / 2), material);
  mesh.renderOrder = -1;
  return mesh;
}

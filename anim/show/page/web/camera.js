// The camera by wheel and keys. What is below the cursor stays there: OrbitControls would take the whole canvas for one
// view, and here are up to two.

import { Vector3 } from "three";

const SCALE_PER_PX = 1.0005; // of the camera's distance; up is nearer
const MODE_PX = [1, 16, 100]; // of wheel events in pixels, lines and pages
const PINCH = 10; // pinches of a trackpad come as wheel events with Ctrl and small steps
const DIRECTIONS = { front: [0, 0, 1], side: [1, 0, 0], above: [0, 1, 1e-4] };

/** Zoom by the wheel in place of OrbitControls; it must be called before they listen. Fingers are left to them. */
export function listenToWheel(canvas, zoom) {
  const onWheel = (event) => {
    event.preventDefault();
    event.stopImmediatePropagation();
    const pixels = event.deltaY * MODE_PX[event.deltaMode] * (event.ctrlKey ? PINCH : 1);
    zoom(SCALE_PER_PX ** pixels, event.offsetX, event.offsetY);
  };
  canvas.addEventListener("wheel", onWheel, { passive: false });
}

/**
 * Scale the distances of camera and target from the point of the target's plane at (x, y), each from -1 to 1 in a view.
 * The direction of the view stays. minDistance, maxDistance: of the camera from its target.
 */
export function zoomTo({ camera, controls }, scale, x, y) {
  const { target, minDistance, maxDistance } = controls;
  const distance = camera.position.distanceTo(target);
  const allowed = Math.max(minDistance, Math.min(distance * scale, maxDistance)) / distance;
  camera.updateMatrixWorld(); // of several events before a picture
  const ray = new Vector3(x, y, 0.5).unproject(camera).sub(camera.position);
  const ahead = target.clone().sub(camera.position);
  const point = ray.multiplyScalar(ahead.lengthSq() / ray.dot(ahead)).add(camera.position);
  for (const each of [camera.position, target]) each.sub(point).multiplyScalar(allowed).add(point);
  controls.update();
}

/** Look at the target from the "front", the "side" or "above", at the present distance. */
export function lookFrom({ camera, controls, front }, name) {
  const distance = camera.position.distanceTo(controls.target);
  const [x, y, z] = DIRECTIONS[name];
  camera.position.set(x * front, y, z * front).setLength(distance).add(controls.target);
  controls.update();
}

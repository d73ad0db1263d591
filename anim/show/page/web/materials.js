// Materials of the models: their own, clay, and heat; as surfaces or as wire.

import { DoubleSide, MeshLambertMaterial } from "three";

const CLAY_COLOR = 0xb9b2a8;
const looks = new WeakMap();

/** Materials and colors of a mesh; not in its userData, which three.js writes as JSON, textures too, for each clone. */
export function lookOf(mesh) {
  if (!looks.has(mesh)) looks.set(mesh, { own: mesh.material, ownColors: mesh.geometry.attributes.color ?? null });
  return looks.get(mesh);
}

/** Give every mesh of a side the material of the chosen view. heated: meshes with heat in their colors. */
export function applyMaterials(side, show, heated) {
  for (const mesh of side.meshes) {
    const wanted = heated.has(mesh) ? heatMaterial(mesh) : show.has("clay") ? clayMaterial(mesh) : null;
    mesh.material = wanted ?? lookOf(mesh).own;
    for (const material of [mesh.material].flat()) {
      if ("wireframe" in material) material.wireframe = show.has("wire");
    }
    if (!heated.has(mesh)) restoreColors(mesh);
  }
}

function clayMaterial(mesh) {
  return (lookOf(mesh).clay ??= plain(mesh, { color: CLAY_COLOR }));
}

function heatMaterial(mesh) {
  return (lookOf(mesh).heat ??= plain(mesh, { vertexColors: true }));
}

function plain(mesh, options) {
  return new MeshLambertMaterial({ ...options, side: DoubleSide, flatShading: !mesh.geometry.attributes.normal });
}

/** Put the colors of heat into a mesh's geometry; its own are kept. */
export function setColors(mesh, colors) {
  if (mesh.geometry.attributes.color !== colors) mesh.geometry.setAttribute("color", colors);
  colors.needsUpdate = true;
}

function restoreColors(mesh) {
  const own = lookOf(mesh).ownColors;
  if ((mesh.geometry.attributes.color ?? null) === own) return;
  if (own) mesh.geometry.setAttribute("color", own);
  else mesh.geometry.deleteAttribute("color");
}

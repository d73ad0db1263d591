// Materials of the models: their own, clay, and heat; as surfaces or as wire.

import { DoubleSide, MeshLambertMaterial } from "three";

const CLAY_COLOR = 0xb9b2a8;

/** Give every mesh of a side the material of the chosen view. heated: meshes with heat in their colors. */
export function applyMaterials(side, show, heated) {
  for (const mesh of side.meshes) {
    const wanted = heated.has(mesh) ? heatMaterial(mesh) : show.has("clay") ? clayMaterial(mesh) : null;
    mesh.material = wanted ?? mesh.userData.ownMaterial;
    for (const material of [mesh.material].flat()) {
      if ("wireframe" in material) material.wireframe = show.has("wire");
    }
    if (!heated.has(mesh)) restoreColors(mesh);
  }
}

function clayMaterial(mesh) {
  mesh.userData.clay ??= plain(mesh, { color: CLAY_COLOR });
  return mesh.userData.clay;
}

function heatMaterial(mesh) {
  mesh.userData.heat ??= plain(mesh, { vertexColors: true });
  return mesh.userData.heat;
}

function plain(mesh, options) {
  return new MeshLambertMaterial({ ...options, side: DoubleSide, flatShading: !mesh.geometry.attributes.normal });
}

/** Put the colors of heat into a mesh's geometry; its own are kept. */
export function setColors(mesh, colors) {
  const data = mesh.userData;
  if (data.ownColors === undefined) data.ownColors = mesh.geometry.attributes.color ?? null;
  if (mesh.geometry.attributes.color !== colors) mesh.geometry.setAttribute("color", colors);
  colors.needsUpdate = true;
}

function restoreColors(mesh) {
  const own = mesh.userData.ownColors;
  if (own === undefined || mesh.geometry.attributes.color === own) return;
  if (own) mesh.geometry.setAttribute("color", own);
  else mesh.geometry.deleteAttribute("color");
}

"""Document → GLB that three.js plays without any other file: packed, and rewritten where that is exact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Document, Json, copy_json, json_array
from anim.gltf.io import container
from anim.gltf.io.buffers import Resolve
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.meshes import Meshes
from anim.gltf.validation.buffer_layout import DRACO
from anim.gltf.validation.channel_targets import EXTENSION as POINTER
from anim.gltf.writing.draco_decoding import decode_draco
from anim.show.page.embedded_images import embed_images
from anim.show.page.embedded_names import separate_meshes, separate_names
from anim.show.page.embedded_nodes import show_scene
from anim.show.page.embedded_references import drop_references
from anim.show.page.embedded_tracks import resolve_pointers, rewrite_tracks
from anim.show.page.packing import Packing
from anim.show.page.sticks import add_sticks
from anim.units import list_some, plural

UNLIT = "KHR_materials_unlit"  # three.js fails on it where the file does not name it
MAX_INFLUENCES = 4  # per vertex in three.js
# Extensions that three.js knows; it warns of all others that a file requires
KNOWN = frozenset(
    """
    EXT_materials_bump EXT_mesh_gpu_instancing EXT_meshopt_compression EXT_texture_avif EXT_texture_webp
    KHR_lights_punctual KHR_materials_anisotropy KHR_materials_clearcoat KHR_materials_dispersion
    KHR_materials_emissive_strength KHR_materials_ior KHR_materials_iridescence KHR_materials_sheen
    KHR_materials_specular KHR_materials_transmission KHR_materials_unlit KHR_materials_volume KHR_mesh_quantization
    KHR_meshopt_compression KHR_texture_transform
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)
REPLACED = frozenset({DRACO, POINTER, "KHR_texture_basisu"})  # rewritten here, or named in a note of their own


@dataclass(frozen=True, slots=True)
class Embedded:
    """glb: the bytes of a GLB without external files. notes: lines about what three.js shows otherwise, or not."""

    glb: bytes
    notes: list[str]


def embed(document: Document, resolve: Resolve | None = None) -> Embedded:
    """Return a document as one GLB for three.js, which reads no other file and no network.

    Buffers and images are packed in. Pointers to a node's translation, rotation, scale, or to morph weights become
    plain channels, Draco becomes plain accessors; images that cannot be read are left out of their materials; a file
    without a mesh gets sticks; names that three.js takes for one differ; there are no cameras. Everything else is
    unchanged, and so is `document`. meshopt stays compressed.
    resolve: returns the bytes of a file in the input's folder by its relative path; None if the input has no folder.
    Raises FormatError or UnsupportedError if clips or meshes cannot be read.
    """
    notes: list[str] = []
    reader.clips(document)
    document = _decode_draco(document, notes)
    notes += _check_meshes(document)
    if not any("mesh" in node for node in json_array(document.json, "nodes")) and not notes:
        document, bare = add_sticks(document), document
        notes += [] if document is bare else ["no mesh: shown as sticks from joint to joint"]
    document = resolve_pointers(document)
    json, packing = copy_json(document.json), Packing(document)
    notes += show_scene(json)
    notes += rewrite_tracks(json)
    notes += drop_references(json)
    separate_meshes(json)
    notes += separate_names(json)
    notes += embed_images(json, document, packing, resolve)
    notes += _name_extensions(json)
    return Embedded(b"".join(piece.tobytes() for piece in container.glb(packing.document(json))), notes)


def _decode_draco(document: Document, notes: list[str]) -> Document:
    """The document with plain accessors; without DracoPy, without the primitives in Draco."""
    meshes = json_array(document.json, "meshes")
    used = [i for i, mesh in enumerate(meshes) if any(map(_is_draco, mesh["primitives"]))]
    if not used:
        return document
    try:
        return decode_draco(document, used)
    except UnsupportedError as error:
        notes.append(f"{plural(len(used), 'mesh', 'meshes')} not drawn: {error.problem}")
    json = copy_json(document.json)
    for i in used:
        mesh = json["meshes"][i]
        mesh["primitives"] = [each for each in mesh["primitives"] if not _is_draco(each)]
    empty = {i for i in used if not json["meshes"][i]["primitives"]}
    for node in json_array(json, "nodes"):
        if node.get("mesh") in empty:
            for key in ("mesh", "skin", "weights"):
                node.pop(key, None)
    return Document(json, document.buffers)


def _is_draco(primitive: Json) -> bool:
    return DRACO in primitive.get("extensions", {})


def _check_meshes(document: Document) -> list[str]:
    """Raise FormatError for meshes that cannot be read; note those with more influences than three.js uses."""
    accessors = Accessors(document)
    accessors.check_total(reader.vertex_accessors(document.json))
    meshes, wide = Meshes(document, accessors), 0
    skins = json_array(document.json, "skins")
    for i, node in enumerate(json_array(document.json, "nodes")):
        if "mesh" in node:
            joints = len(skins[node["skin"]]["joints"]) if "skin" in node else 0
            try:
                wide += meshes.mesh(node["mesh"], joint_count=joints).joints.shape[1] > MAX_INFLUENCES
            except FormatError as error:
                raise error.at(f"node {i}") from None
    if not wide:
        return []
    return [f"{plural(wide, 'mesh', 'meshes')} shown with {MAX_INFLUENCES} influences per vertex, not all"]


def _name_extensions(json: Json) -> list[str]:
    """Drop required extensions that three.js warns of, and name those it needs, in place; return a note."""
    if UNLIT not in json.get("extensionsUsed", ()) and any(map(_is_unlit, json_array(json, "materials"))):
        json["extensionsUsed"] = [*json.get("extensionsUsed", ()), UNLIT]
    required = json.pop("extensionsRequired", [])
    if known := [name for name in required if name in KNOWN]:
        json["extensionsRequired"] = known
    unknown = [name for name in required if name not in KNOWN | REPLACED]
    for key in ("extensionsUsed", "extensionsRequired"):
        if DRACO in json.get(key, ()):
            json[key] = [name for name in json[key] if name != DRACO]
    return [f"shown without {list_some(unknown)}, which the file requires"] if unknown else []


def _is_unlit(material: Any) -> bool:
    extensions = material.get("extensions") if isinstance(material, dict) else None
    return isinstance(extensions, dict) and UNLIT in extensions

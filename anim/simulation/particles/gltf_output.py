"""Particles → nodes of a document, as a node each with one shared mesh, or as joints of one skinned mesh."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from anim.arrays import Floats
from anim.gltf.authoring import add_clips
from anim.gltf.document import Document, Json, json_array
from anim.gltf.writing.append import append_accessors, append_mesh, append_nodes
from anim.gltf.writing.writer import replace_clips
from anim.model import Clip
from anim.simulation.particles import tracks

MATERIAL: Json = {
    "name": "particle",
    "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.45, 0.1, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6},
    "emissiveFactor": [1.0, 0.4, 0.05],
}
Paths = Sequence[Sequence[tracks.ParticlePath]]  # of each node
VERTICES = 34962  # target of a buffer view


def add_particles(
    document: Document,
    paths: Paths,
    *,
    size: float,
    start: float,
    end: float,
    name: str,
    form: str = "node",
    merge: tuple[int, Clip] | None = None,
) -> Document:
    """Return the document with a node for every particle alive at a time, and a clip that moves them.

    size: m, radius. start, end: s, of the clip. form: a name in FORMS. merge: index and clip that gets the tracks,
    instead of a new one.
    """
    document, indices = FORMS[form](document, paths, size, name)
    moving = [
        track
        for node, own in zip(indices, paths, strict=True)
        for track in tracks.make_tracks(node, own, size, end, start)
    ]
    if merge is not None:
        number, clip = merge
        return replace_clips(document, {number: Clip(clip.name, (*clip.tracks, *moving))})
    return add_clips(document, [Clip(name, tuple(moving))])


def add_nodes(document: Document, paths: Paths, size: float, name: str) -> tuple[Document, list[int]]:
    """Return the document with a node per particle, all with one mesh: a draw call each, and plays everywhere."""
    corners, faces = tracks.octahedron()
    document, mesh = append_mesh(document, name, corners, faces, normals=corners, material=MATERIAL)
    return append_nodes(document, [{**node, "mesh": mesh} for node in _nodes(paths, name)])


def add_joints(document: Document, paths: Paths, size: float, name: str) -> tuple[Document, list[int]]:
    """Return the document with one skinned mesh, and a joint per particle below one node: a single draw call.

    Vertices are bound in the middle of each joint's first path, so that the mesh at rest has the size of the whole.
    """
    corners, faces = tracks.octahedron()
    count = len(paths)
    centers = np.array([own[0].positions[len(own[0].positions) // 2] for own in paths])
    positions = (centers[:, None] + size * corners).reshape(-1, 3)
    indices = (faces + len(corners) * np.arange(count)[:, None, None]).reshape(-1, 3)
    document, mesh = append_mesh(
        document, name, positions, indices, normals=np.tile(corners, (count, 1)), material=MATERIAL
    )
    joints = np.zeros((len(positions), 4), "<u2")
    joints[:, 0] = np.repeat(np.arange(count), len(corners))
    weights = np.zeros((len(positions), 4), "<f4")
    weights[:, 0] = 1.0
    contents = [(joints, VERTICES), (weights, VERTICES), (_inverse_binds(centers, size), None)]
    document, accessors = append_accessors(document, contents)
    document, children = append_nodes(document, _nodes(paths, name), in_scene=False)
    json = dict(document.json)
    meshes, skins = [*json_array(json, "meshes")], [*json_array(json, "skins")]
    primitive = meshes[mesh]["primitives"][0]
    attributes = {**primitive["attributes"], "JOINTS_0": accessors[0], "WEIGHTS_0": accessors[1]}
    meshes[mesh] = {**meshes[mesh], "primitives": [{**primitive, "attributes": attributes}]}
    root = len(json_array(json, "nodes"))
    skins.append({"name": name, "joints": children, "inverseBindMatrices": accessors[2], "skeleton": root})
    json |= {"meshes": meshes, "skins": skins}
    document = Document(json, document.buffers, document.chunks, document.indent)
    group: Json = {"name": name, "children": children}
    document, _ = append_nodes(document, [group, {"name": f"{name}_mesh", "mesh": mesh, "skin": len(skins) - 1}])
    return document, children


FORMS: dict[str, Callable[[Document, Paths, float, str], tuple[Document, list[int]]]] = {
    "node": add_nodes,
    "skin": add_joints,
}


def _nodes(paths: Paths, name: str) -> list[Json]:
    """JSON of a node per particle, without size until its birth."""
    digits = len(str(len(paths) - 1))
    return [
        {"name": f"{name}_{i:0{digits}}", "translation": _start(own), "scale": [0.0, 0.0, 0.0]}
        for i, own in enumerate(paths)
    ]


def _start(paths: Sequence[tracks.ParticlePath]) -> list[float]:
    return [round(float(value), 6) for value in paths[0].positions[0]]


def _inverse_binds(centers: Floats, size: float) -> Floats:
    """Inverse bind matrices (N, 16), columns first: from the mesh to the unit octahedron of each joint."""
    matrices = np.zeros((len(centers), 4, 4), "<f4")
    matrices[:, [0, 1, 2], [0, 1, 2]] = 1 / size
    matrices[:, 3, :3] = -centers / size
    matrices[:, 3, 3] = 1.0
    return np.asarray(matrices.reshape(-1, 16))

"""Document → Skeleton, Clips, Scene: what the file's numbers mean, every fault named with its place."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import AnimError, FormatError
from anim.gltf import channels, hierarchy
from anim.gltf.accessors import Accessors
from anim.gltf.document import Document, Json, items
from anim.gltf.meshes import Meshes
from anim.maths import matrix
from anim.model import Clip, Instance, Scene, Skeleton, Skin

MAX_SHEAR = 1e-4  # relative; what float32 products of rotations and scales leave behind is below


def skeleton(document: Document) -> Skeleton:
    """Return all nodes in their rest pose; a `matrix` is taken apart, and kept whole where it is sheared."""
    nodes = items(document.json, "nodes")
    n = len(nodes)
    translation, rotation, scale = np.zeros((n, 3)), np.tile((0.0, 0.0, 0.0, 1.0), (n, 1)), np.ones((n, 3))
    sheared: dict[int, Floats] = {}
    for i, node in enumerate(nodes):
        if "matrix" in node:
            local = np.array(node["matrix"], float).reshape(4, 4).T[:3]
            translation[i], rotation[i], scale[i], shear = matrix.decompose(local)
            if shear > MAX_SHEAR:
                sheared[i] = local
            continue
        if "translation" in node:
            translation[i] = node["translation"]
        if "rotation" in node:
            rotation[i] = _unit(node["rotation"], i)
        if "scale" in node:
            scale[i] = node["scale"]
    return Skeleton(
        tuple(node.get("name", "") for node in nodes),
        np.array(hierarchy.parents(document.json), np.int64),
        translation,
        rotation,
        scale,
        np.array(list(sheared), np.int64),
        np.array(list(sheared.values())).reshape(-1, 3, 4),
    )


def clips(document: Document, accessors: Accessors | None = None) -> tuple[Clip, ...]:
    """Return the animations of the file in its order; channels without any target are left out, as glTF says.

    Raises FormatError with clip, track and target for the first fault.
    """
    accessors = accessors or Accessors(document)
    reader = channels.Reader(document, accessors)
    with np.errstate(invalid="ignore"):  # a signaling NaN; tracks refuse any NaN
        return tuple(_clip(i, animation, reader) for i, animation in enumerate(items(document.json, "animations")))


def names(document: Document) -> tuple[str, ...]:
    """Return the names of the animations, empty where one has none, without reading them."""
    return tuple(animation.get("name", "") for animation in items(document.json, "animations"))


def scene(
    document: Document, accessors: Accessors | None = None, *, normals: bool = False, tangents: bool = False
) -> Scene:
    """Return the skeleton with every mesh on it, nodes depth-first in the order of the file's scenes.

    normals, tangents: read those of vertices and morph targets too.
    Raises UnsupportedError where vertices are hidden by an extension that is not handled (Draco).
    """
    accessors = accessors or Accessors(document)
    meshes = Meshes(document, accessors, normals=normals, tangents=tangents)
    skins = [_skin(i, skin, accessors) for i, skin in enumerate(items(document.json, "skins"))]
    nodes = items(document.json, "nodes")
    instances = []
    for number in depth_first(document.json):
        node = nodes[number]
        if "mesh" not in node:
            continue
        skin = skins[node["skin"]] if "skin" in node else None
        mesh = meshes.mesh(node["mesh"], joint_count=len(skin.joints) if skin is not None else 0)
        instances.append(Instance(number, mesh, skin, _weights_at_rest(node, mesh.rest_weights)))
    return Scene(skeleton(document), tuple(instances))


def depth_first(json: Json) -> Iterator[int]:
    """Yield node numbers depth-first: from the roots of the scenes, each once, then from roots in no scene."""
    nodes = items(json, "nodes")
    parents = hierarchy.parents(json)
    roots = [root for scene in items(json, "scenes") for root in scene.get("nodes", ())]
    roots += [i for i, parent in enumerate(parents) if parent < 0]
    seen: set[int] = set()
    stack = list(reversed(roots))
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        yield node
        stack.extend(reversed(nodes[node].get("children", ())))


def label(name: str, number: int) -> str:
    """Return how messages call a clip: "clip 'walk'", or "clip 3" where it has no name."""
    return f"clip '{name}'" if name else f"clip {number}"


def _clip(number: int, animation: Json, reader: channels.Reader) -> Clip:
    name = animation.get("name", "")
    try:
        tracks = [reader.track(animation, i) for i in range(len(animation["channels"]))]
        return Clip(name, tuple(track for track in tracks if track is not None))
    except AnimError as error:
        if not error.where.startswith("clip"):
            error.at(label(name, number))
        raise


def _skin(number: int, skin: Json, accessors: Accessors) -> Skin:
    joints: Ints = np.array(skin["joints"], np.int64)
    try:
        if "inverseBindMatrices" not in skin:
            return Skin(joints, np.broadcast_to(np.eye(4)[:3], (len(joints), 3, 4)))
        return Skin(joints, accessors.matrices(skin["inverseBindMatrices"])[: len(joints), :3])
    except AnimError as error:
        raise error.at(f"skin {number}") from None


def _weights_at_rest(node: Json, of_mesh: Floats) -> Floats:
    weights = np.array(node.get("weights", of_mesh), float)
    if len(weights) != len(of_mesh):
        raise FormatError(f"node has {len(weights)} weights for {len(of_mesh)} morph targets")
    return weights


def _unit(rotation: list[float], node: int) -> Floats:
    q: Floats = np.array(rotation, float)
    length = float(np.sqrt(q @ q))
    if length == 0:
        raise FormatError("rotation is zero (expected a unit quaternion)", where=f"nodes[{node}]")
    return q / length

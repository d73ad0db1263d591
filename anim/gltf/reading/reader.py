"""Document → Skeleton, Clips, Scene; errors state the position in the file."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import AnimError, FormatError, ShapeError, UnsupportedError
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading import animations, node_matrix
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.meshes import BYTES_PER_MORPH, BYTES_PER_POSED_VERTEX, Meshes
from anim.gltf.reading.repeated_keys import BYTES_PER_INSPECTED_KEY, check_repeated_keys
from anim.gltf.reading.scene_nodes import check_not_required, depth_first
from anim.gltf.validation import hierarchy
from anim.model import Clip, MeshInstance, MorphedNode, Scene, Skeleton, Skin
from anim.units import FEW, list_some


def skeleton(document: Document) -> Skeleton:
    """Return all nodes in their rest pose; a `matrix` is decomposed, or kept whole if it has none of these parts."""
    _check(document)
    return _skeleton(document, hierarchy.parents(document.json))


def _skeleton(document: Document, parents: Sequence[int]) -> Skeleton:
    nodes = json_array(document.json, "nodes")
    n = len(nodes)
    translation, rotation, scale = np.zeros((n, 3)), np.tile((0.0, 0.0, 0.0, 1.0), (n, 1)), np.ones((n, 3))
    for key, values in (("translation", translation), ("scale", scale)):
        if having := [i for i, node in enumerate(nodes) if key in node]:
            values[having] = [nodes[i][key] for i in having]
    sheared: dict[int, Floats] = {}
    for i, node in enumerate(nodes):
        if "matrix" in node:  # without the other three, by the schema
            translation[i], rotation[i], scale[i], whole = node_matrix.decompose(node["matrix"])
            if whole is not None:
                sheared[i] = whole
        elif "rotation" in node:
            rotation[i] = _unit(node["rotation"], i)
    return Skeleton(
        tuple(node.get("name", "") for node in nodes),
        np.array(parents, np.int64),
        translation,
        rotation,
        scale,
        np.array(list(sheared), np.int64),
        np.array(list(sheared.values())).reshape(-1, 3, 4),
        _morphed_nodes(document.json),
    )


def clips(document: Document, accessors: Accessors | None = None, *, limited: bool = True) -> tuple[Clip, ...]:
    """Return the animations of the file in its order, without channels that have no target.

    Channels without a target are ignored as glTF requires. limited: whether keys that many tracks share are limited;
    not in a document that was just written, whose source was. Raises FormatError with clip, track and target for the
    first fault.
    """
    _check(document)
    accessors = accessors or Accessors(document)
    accessors.check_keys(_sampled_accessors(document.json))
    with np.errstate(invalid="ignore"):  # a signaling NaN; tracks refuse any NaN
        reader = animations.Reader(document, accessors)
        found = tuple(_clip(i, each, reader) for i, each in enumerate(json_array(document.json, "animations")))
    if limited:
        check_repeated_keys(found, accessors.budget)
    return found


def readable_clips(document: Document, accessors: Accessors) -> tuple[dict[int, Clip], list[AnimError]]:
    """Return the readable animations by index, and the errors of the others."""
    found: dict[int, Clip] = {}
    faults: list[AnimError] = []
    try:
        accessors.check_keys(_sampled_accessors(document.json))
    except UnsupportedError as error:
        return {}, [error]
    with np.errstate(invalid="ignore"):
        reader = animations.Reader(document, accessors)
        for i, animation in enumerate(json_array(document.json, "animations")):
            try:
                found[i] = _clip(i, animation, reader)
            except AnimError as error:
                faults.append(error)
    try:
        check_repeated_keys(found.values(), accessors.budget, BYTES_PER_INSPECTED_KEY)
    except UnsupportedError as error:
        return {}, [*faults, error]
    return found, faults


def names(document: Document) -> tuple[str, ...]:
    """Return the animation names, "" for unnamed ones, without reading the animations."""
    _check(document)
    return tuple(animation.get("name", "") for animation in json_array(document.json, "animations"))


def scene(
    document: Document,
    accessors: Accessors | None = None,
    skeleton: Skeleton | None = None,
    *,
    normals: bool = False,
    tangents: bool = False,
    repeats: bool = True,
) -> Scene:
    """Return the skeleton and its meshes, nodes depth-first in the order of the file's scenes.

    skeleton: the document's, if the caller has it. normals, tangents: read those of vertices and morph targets too.
    repeats: store vertices again for the last primitives of a mesh that only repeat earlier ones (`Mesh.repeats`):
    measures, for which those move alike, leave that out.
    A mesh with EXT_mesh_gpu_instancing is included once, on its node (`scene_nodes.instanced_nodes`).
    Raises UnsupportedError if vertices cannot be read: Draco without the package DracoPy, an unknown compression,
    EXT_mesh_gpu_instancing where the file requires it.
    """
    _check(document)
    check_not_required(document)
    accessors = accessors or Accessors(document)
    accessors.check_total(vertex_accessors(document.json))
    meshes = Meshes(document, accessors, normals=normals, tangents=tangents, repeats=repeats)
    skins = [_skin(i, skin, accessors) for i, skin in enumerate(json_array(document.json, "skins"))]
    nodes = json_array(document.json, "nodes")
    instances = []
    parents = hierarchy.parents(document.json) if skeleton is None else skeleton.parents.tolist()
    has_meshes = any("mesh" in node for node in nodes)  # files of motion alone have 100 000 nodes to walk through
    for number in depth_first(document.json, parents) if has_meshes else ():
        node = nodes[number]
        if "mesh" not in node:
            continue
        skin = skins[node["skin"]] if "skin" in node else None
        mesh = meshes.mesh(node["mesh"], joint_count=len(skin.joints) if skin is not None else 0)
        instances.append(MeshInstance(number, mesh, skin, _weights_at_rest(node, mesh.rest_weights)))
    accessors.budget.check(BYTES_PER_POSED_VERTEX * sum(len(each.mesh.positions) for each in instances))
    num_morphs = sum(len(each.mesh.targets) for each in instances)
    accessors.budget.check(BYTES_PER_MORPH * num_morphs, f"{num_morphs} morph targets of all instances of meshes")
    return Scene(_skeleton(document, parents) if skeleton is None else skeleton, tuple(instances))


def skins(document: Document) -> tuple[tuple[int, Skin], ...]:
    """Return the nodes with a skinned mesh, each with its skin, without reading vertices."""
    accessors = Accessors(document)
    found = [_skin(i, skin, accessors) for i, skin in enumerate(json_array(document.json, "skins"))]
    return tuple(
        (i, found[node["skin"]]) for i, node in enumerate(json_array(document.json, "nodes")) if "skin" in node
    )


def clip_label(name: str, number: int, what: str = "clip") -> str:
    """Return a label for messages: "clip 'walk'", or "clip #3" for an unnamed clip (or another `what`)."""
    return f"{what} {quote_clip(name, number)}"


def clip_labels(clips: Sequence[tuple[str, int]]) -> str:
    """Return a label for several clips, by names and indices: "clips 'walk', #3, 'run' and 4 more"."""
    if len(clips) == 1:
        return clip_label(*clips[0])
    return f"clips {list_some([quote_clip(*each) for each in clips], FEW)}"


def quote_clip(name: str, number: int) -> str:
    """Return a clip's name for sentences: "'walk'", or "#3" for an unnamed one."""
    return f"'{name}'" if name else clip_name(name, number)


def choose_option(numbers: Collection[int]) -> str:
    """Return the options that select clips by index; "" if they are too many to list.

    choose_option([0, 2]) → " --clip '#0' --clip '#2'"
    """
    return "".join(f" --clip '#{number}'" for number in numbers) if len(numbers) <= FEW else ""


def clip_name(name: str, number: int) -> str:
    """Return a clip's name for tables and lists, "#3" for an unnamed one, as in selections."""
    return name or f"#{number}"


def vertex_accessors(json: Json) -> Iterator[int]:
    """Yield the accessors of positions and their morph targets, which are always read."""
    for mesh in json_array(json, "meshes"):
        for primitive in mesh["primitives"]:
            for attributes in (primitive["attributes"], *primitive.get("targets", ())):
                if "POSITION" in attributes:
                    yield attributes["POSITION"]


def _sampled_accessors(json: Json) -> Iterator[int]:
    """Accessors of all keys."""
    for animation in json_array(json, "animations"):
        for sampler in animation["samplers"]:
            yield sampler["input"]
            yield sampler["output"]


def _check(document: object) -> None:
    if not isinstance(document, Document):
        raise ShapeError(
            f"document is {type(document).__name__} (expected a Document)",
            help='container.read(np.fromfile("walk.glb", np.uint8)) gives one',
        )


def _clip(number: int, animation: Json, reader: animations.Reader) -> Clip:
    name = animation.get("name", "")
    if not animation["channels"]:
        return Clip(name, ())
    try:
        tracks = [reader.track(animation, i) for i in range(len(animation["channels"]))]
        return Clip(name, tuple([track for track in tracks if track is not None]))
    except AnimError as error:
        if not error.where.startswith("clip"):
            error.at(clip_label(name, number))
        raise


def _skin(number: int, skin: Json, accessors: Accessors) -> Skin:
    joints: Ints = np.array(skin["joints"], np.int64)
    try:
        if "inverseBindMatrices" not in skin:
            return Skin(joints, np.broadcast_to(np.eye(4)[:3], (len(joints), 3, 4)))
        return Skin(joints, accessors.matrices(skin["inverseBindMatrices"])[: len(joints), :3])
    except AnimError as error:
        raise error.at(f"skin {number}") from None


def _morphed_nodes(json: Json) -> tuple[MorphedNode, ...]:
    """The nodes with morph targets, with their weights at rest; without those that `scene` refuses."""
    primitives = (mesh["primitives"] for mesh in json_array(json, "meshes"))
    counts = [max((len(each.get("targets", ())) for each in of_mesh), default=0) for of_mesh in primitives]
    if not any(counts):
        return ()
    found = []
    for i, node in enumerate(json_array(json, "nodes")):
        mesh = node.get("mesh", -1)
        if not 0 <= mesh < len(counts) or not counts[mesh]:
            continue
        weights = node.get("weights") or json["meshes"][mesh].get("weights") or [0.0] * counts[mesh]
        if len(weights) == counts[mesh]:
            found.append(MorphedNode(i, mesh, tuple(map(float, weights)), bool(node.get("weights"))))
    return tuple(found)


def _weights_at_rest(node: Json, of_mesh: Floats) -> Floats:
    weights = np.array(node.get("weights") or of_mesh, float)
    if len(weights) != len(of_mesh):
        raise FormatError(f"node has {len(weights)} weights for {len(of_mesh)} morph targets")
    return weights


def _unit(rotation: list[float], node: int) -> Floats:
    q: Floats = np.array(rotation, float)
    length = float(np.sqrt(q @ q))
    if length == 0:
        raise FormatError("rotation is zero (expected a unit quaternion)", where=f"nodes[{node}]")
    return q / length

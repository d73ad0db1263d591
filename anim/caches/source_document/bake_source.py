"""The document that a cache is a bake of, and the primitives that its vertices belong to."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

from anim.errors import RangeError
from anim.gltf.document import Document, Json, json_array, node_label
from anim.gltf.io.source import Source
from anim.gltf.reading.scene_nodes import depth_first
from anim.model import MeshPart, VertexCache

BAKED_SUFFIX = " (baked)"  # of the names of new nodes
Span = tuple[int, int]  # of vertices: first, last + 1


class BakeSource(NamedTuple):
    """Source document of a bake: formats that store materials take them from it.

    clip: index of the baked animation, whose channels of other nodes stay; None for none. left_out: nodes whose meshes
    are removed. in_mesh_space: whether the vertices are in the space of their mesh's node. keep_skeleton: keep skins
    and the channels of joints. num_clips: animations of the file, if the document has fewer.
    """

    document: Document
    clip: int | None = None
    left_out: frozenset[int] = frozenset()
    in_mesh_space: bool = False
    keep_skeleton: bool = False
    num_clips: int = 0


class BakedMesh(NamedTuple):
    """A node with a baked mesh: its index, that of the mesh, and the vertices of each primitive in the cache.

    A primitive without vertices has an empty span.
    """

    node: int
    mesh: int
    spans: tuple[Span, ...]

    @property
    def vertices(self) -> Span:
        """Vertices of all primitives."""
        return self.spans[0][0], self.spans[-1][1]


def baked_meshes(cache: VertexCache, document: Document) -> tuple[BakedMesh, ...]:
    """Return the meshes of a document that the vertices of a cache belong to, in the order of the vertices.

    By the nodes of the cache's parts; without parts, the skinned and morphed meshes, or all meshes, if they have as
    many vertices. Raises RangeError if the vertices do not fit.
    """
    json = document.json
    by_parts = _by_parts(cache.parts, json)
    if by_parts is not None:
        return by_parts
    nodes = [i for i in depth_first(json) if "mesh" in json["nodes"][i]]
    deformed = [i for i in nodes if "skin" in json["nodes"][i] or _is_morphed(json, i)]
    counts = []
    for chosen in (deformed, nodes):
        found = _in_order(json, chosen)
        counts.append(found[-1].vertices[1] if found else 0)
        if found and counts[-1] == cache.vertex_count:
            return tuple(each for each in found if each.vertices[0] < each.vertices[1])
    raise RangeError(
        f"the cache has {cache.vertex_count} vertices, the meshes of the source have {counts[1]} ({counts[0]} of "
        "skinned and morphed ones)",
        help="bake the same file, with all vertices in the order of the file (`vertex_order` file), or leave the "
        "materials out (no `onto`)",
    )


def self_contained(document: Document, source: Source | None, meshes: Collection[int]) -> Document:
    """Return a document with the images of its source inside, and meshes without Draco data."""
    from anim.gltf.io import images  # `diff` only looks for bakes
    from anim.gltf.writing.draco_decoding import decode_draco

    return images.embed(decode_draco(document, meshes), None if source is None else source.folder)


def _by_parts(parts: Sequence[MeshPart], json: Json) -> tuple[BakedMesh, ...] | None:
    """Meshes on the nodes of the parts; None if a part has another count of vertices than its primitive."""
    nodes = list(dict.fromkeys(part.node for part in parts))
    if not nodes or any(not 0 <= i < len(json_array(json, "nodes")) or "mesh" not in json["nodes"][i] for i in nodes):
        return None
    found = _in_order(json, nodes)
    spans = [span for each in found for span in each.spans if span[0] < span[1]]
    return tuple(found) if spans == [part.vertices for part in parts] else None


def _in_order(json: Json, nodes: Iterable[int]) -> list[BakedMesh]:
    """Meshes on nodes, their vertices one after another."""
    at, found = 0, []
    for node in nodes:
        mesh, spans = json["nodes"][node]["mesh"], []
        for primitive in json["meshes"][mesh]["primitives"]:
            position = primitive["attributes"].get("POSITION")
            count = 0 if position is None else json["accessors"][position]["count"]
            spans.append((at, at + count))
            at += count
        found.append(BakedMesh(node, mesh, tuple(spans)))
    return found


def _is_morphed(json: Json, node: int) -> bool:
    primitives = json["meshes"][json["nodes"][node]["mesh"]]["primitives"]
    return any(primitive.get("targets") for primitive in primitives)


def baked_name(json: Json, node: int) -> str:
    """Return the name of a new node with the baked mesh of a node."""
    return f"{json['nodes'][node].get('name') or node_label(json, node)}{BAKED_SUFFIX}"

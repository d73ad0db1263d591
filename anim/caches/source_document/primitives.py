"""Primitives with baked vertices; all other properties are those of the source's primitives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from anim.arrays import AnyArray, Floats
from anim.caches.formats.gltf_stream import signed
from anim.caches.source_document.bake_source import BakedMesh, Span
from anim.gltf.document import Json
from anim.gltf.writing.append import VERTICES
from anim.gltf.writing.new_accessors import NewAccessors

REPLACED = ("POSITION", "NORMAL", "TANGENT", "JOINTS_", "WEIGHTS_")  # attributes of the source that are not kept


class BakedVertices:
    """Vertices of one shape of a cache, as attributes of primitives.

    positions, normals, tangents: (V, 3), the latter None if not baked. handedness: (V,) of tangents.
    """

    def __init__(
        self, positions: AnyArray, normals: AnyArray | None, tangents: AnyArray | None, handedness: Floats | None
    ) -> None:
        self._positions, self._normals, self._tangents, self._handedness = positions, normals, tangents, handedness

    def attributes(self, new: NewAccessors, span: Span, old: Mapping[str, int]) -> dict[str, int]:
        """Add accessors of the vertices of a primitive; directions only where it had normals before."""
        rows = slice(*span)
        found = {"POSITION": new.add(self._positions[rows].astype("<f4"), target=VERTICES, bounds=True)}
        if self._normals is not None and "NORMAL" in old:
            found["NORMAL"] = new.add(self._normals[rows].astype("<f4"), target=VERTICES)
            if self._tangents is not None and self._handedness is not None:
                tangents = signed(self._tangents[rows], self._handedness[rows])
                found["TANGENT"] = new.add(tangents, target=VERTICES)
        return found


def baked_primitives(
    new: NewAccessors,
    source: Json,
    baked: BakedMesh,
    vertices: BakedVertices,
    targets: Mapping[Span, Sequence[dict[str, int]]],
) -> list[Json]:
    """Return the primitives of a mesh with new vertices; those without vertices are unchanged.

    targets: morph targets of each span of vertices; none for absent ones.
    """
    found = []
    for primitive, span in zip(source["meshes"][baked.mesh]["primitives"], baked.spans, strict=True):
        if span[0] == span[1]:
            found.append(primitive)
            continue
        old = primitive["attributes"]
        kept = {name: index for name, index in old.items() if not name.startswith(REPLACED)}
        rest = {key: value for key, value in primitive.items() if key not in ("attributes", "targets")}
        each: Json = {**rest, "attributes": {**vertices.attributes(new, span, old), **kept}}
        if targets.get(span):
            each["targets"] = list(targets[span])
        found.append(each)
    return found


def baked_mesh(source: Json, baked: BakedMesh, primitives: list[Json]) -> Json:
    """Return the source's mesh with other primitives, without the names of its morph targets."""
    mesh = {**source["meshes"][baked.mesh], "primitives": primitives}
    mesh.pop("weights", None)
    if isinstance(mesh.get("extras"), dict) and "targetNames" in mesh["extras"]:
        mesh["extras"] = {key: value for key, value in mesh["extras"].items() if key != "targetNames"}
        if not mesh["extras"]:
            del mesh["extras"]
    return mesh

"""Edit a source document: detach skinned meshes, place baked ones, and animate them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import AnyArray, Bools, Floats
from anim.caches.source_document import retained_channels
from anim.caches.source_document.bake_source import BakedMesh, BakeSource, Span
from anim.caches.source_document.excluded_meshes import drop_meshes
from anim.caches.source_document.expression_binds import drop_binds
from anim.caches.source_document.first_person import move_annotations
from anim.caches.source_document.instanced_nodes import check_copies
from anim.caches.source_document.placement import Placement, detach_meshes
from anim.caches.source_document.primitives import BakedVertices, baked_primitives
from anim.caches.source_document.winding import ReversedFaces, find_negative_determinants
from anim.gltf.document import Document, Json, copy_json, json_array
from anim.gltf.writing.new_accessors import NewAccessors, edit_document

CLIP_NAME = "cache"  # of a bake without a clip


@dataclass(slots=True)
class DocumentEdit:
    """A source document under edit.

    json: the edited copy. new: accessors for it. channels, samplers: of the baked clip, besides those that stay.
    roots: nodes with vertices in world space. replaced: meshes of the source in whose place there is a page.
    """

    source: BakeSource
    meshes: Sequence[BakedMesh]
    json: Json
    new: NewAccessors
    channels: list[Json] = field(default_factory=list)
    samplers: list[Json] = field(default_factory=list)
    roots: set[int] = field(default_factory=set)
    replaced: set[int] = field(default_factory=set)
    _reversed: ReversedFaces = field(init=False)
    _is_mirrored: Bools = field(init=False)  # (N,) of the source's nodes
    _placement: Placement = field(init=False)

    def __post_init__(self) -> None:
        self._reversed = ReversedFaces(self.source.document)
        self._is_mirrored = find_negative_determinants(self.source.document.json)
        self._placement = Placement.of(self.json, self.source)

    @classmethod
    def of(cls, source: BakeSource, meshes: Sequence[BakedMesh]) -> DocumentEdit:
        """Return an edit in which the nodes of baked and left-out meshes have none.

        Only nodes, scenes and the list of meshes are copied; all else is shared with the source, and replaced whole.
        """
        json = dict(source.document.json)
        for key in ("nodes", "scenes"):
            if key in json:
                json[key] = copy_json(json[key])
        json["meshes"] = list(json["meshes"])
        detach_meshes(json, {each.node for each in meshes} | source.left_out)
        return cls(source, meshes, json, NewAccessors(len(json_array(json, "accessors"))))

    def primitives(
        self, baked: BakedMesh, vertices: BakedVertices, targets: Mapping[Span, Sequence[dict[str, int]]]
    ) -> list[Json]:
        """Return the primitives of a baked mesh, in world space with reversed faces if its node mirrors them."""
        found = baked_primitives(self.new, self.source.document.json, baked, vertices, targets)
        if self.source.in_mesh_space or not self._is_mirrored[baked.node]:
            return found
        return [
            self._reversed.of(self.new, each, span[1] - span[0]) if span[0] < span[1] else each
            for each, span in zip(found, baked.spans, strict=True)
        ]

    def place(self, baked: BakedMesh, mesh: Json, node: Json) -> int:
        """Add a mesh in place of a baked one, on a node with the properties of `node`; return the node's index."""
        index = self._placement.add_mesh(mesh, baked.mesh)
        placed = self._placement.place_node(baked, {**node, "mesh": index})
        if not self.source.in_mesh_space:
            self.roots.add(placed)
        return placed

    def add_mesh(self, mesh: Json, old: int | None) -> int:
        """Add a mesh without a node, at the index of an `old` one that nothing uses; return its index."""
        if old is not None and old not in self.replaced:  # a mesh that several nodes share has pages for each
            self.replaced.add(old)
            return self._placement.add_mesh(mesh, old)
        self.json["meshes"].append(mesh)
        return len(self.json["meshes"]) - 1

    def place_new_node(self, baked: BakedMesh, node: Json) -> int:
        """Add a new node in the space of a baked mesh, with the properties of `node`; return its index."""
        return self._placement.place_new_node(baked, node)

    def place_group(self, baked: BakedMesh, nodes: Sequence[Json], parent: Json) -> int:
        """Add nodes below a new one, `parent`, in the space of a baked mesh; return the index of the first node."""
        return self._placement.place_group(baked, nodes, parent)

    def animate(self, nodes: Sequence[int], path: str, times: Floats, values: AnyArray) -> None:
        """Add a linear sampler, and a channel for it on each of the nodes."""
        keys = self.new.add(times.astype("<f4")[:, None], bounds=True)
        sampler = self.add_sampler(keys, self.new.add(np.ascontiguousarray(values)))
        self.channels += [{"sampler": sampler, "target": {"node": node, "path": path}} for node in nodes]

    def add_sampler(self, keys: int, values: int, interpolation: str = "LINEAR") -> int:
        """Add a sampler of two accessors; return its index among the new ones."""
        self.samplers.append({"input": keys, "output": values, "interpolation": interpolation})
        return len(self.samplers) - 1

    def require(self, *extensions: str, optional: bool = False) -> None:
        """Name extensions as used and required, or as used only."""
        for key in ("extensionsUsed",) if optional else ("extensionsUsed", "extensionsRequired"):
            names = self.json.get(key, [])
            if missing := [name for name in extensions if name not in names]:
                self.json[key] = [*names, *missing]

    def document(self) -> Document:
        """Return the edited document: one clip, no left-out meshes, no skins, binds and bytes that nothing uses.

        Raises UnsupportedError for copies of a mesh that would be lost or elsewhere.
        """
        check_copies(self.source, self.json, {each.node for each in self.meshes})
        clip = self._clip()
        detached = {each.node for each in self.meshes} | self.source.left_out
        drop_binds(self.json, self.source.document.json, detached)
        move_annotations(self.json, self.source.document.json, self._placement.new_nodes, detached)
        left_out = {self.source.document.json["nodes"][node]["mesh"] for node in self.source.left_out}
        drop_meshes(self.json, left_out, clip)
        if not self.source.keep_skeleton:
            retained_channels.drop_unused_skins(self.json)
        if clip["channels"]:
            self.json["animations"] = [clip]
        else:
            self.json.pop("animations", None)
        return edit_document(self.source.document, self.json, self.new)

    def _clip(self) -> Json:
        """The baked clip: new channels, and those of the source's clip that still move something."""
        if self.source.clip is None:
            return {"name": CLIP_NAME, "channels": self.channels, "samplers": self.samplers}
        old = self.json["animations"][self.source.clip]
        nodes = {each.node for each in self.meshes} | self.source.left_out
        kept = retained_channels.retained_channels(
            old, self.source.document.json, self.json, nodes, self.roots, keep_skeleton=self.source.keep_skeleton
        )
        kept += self._placement.groups.channels(kept)
        used = sorted({channel["sampler"] for channel in kept})
        number = {index: len(self.samplers) + i for i, index in enumerate(used)}
        channels = self.channels + [{**channel, "sampler": number[channel["sampler"]]} for channel in kept]
        return {**old, "channels": channels, "samplers": self.samplers + [old["samplers"][i] for i in used]}

"""Nodes and meshes of a document that take the place of its skinned ones."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.caches.source_document.bake_source import BakedMesh, BakeSource, baked_name
from anim.caches.source_document.visibility_groups import VisibilityGroups
from anim.gltf.document import Json, json_array
from anim.gltf.validation import hierarchy

TRANSFORMS = ("translation", "rotation", "scale", "matrix")


def detach_meshes(json: Json, nodes: Collection[int]) -> None:
    """Remove mesh, skin and weights from nodes, in place."""
    for node in nodes:
        for key in ("mesh", "skin", "weights"):
            json["nodes"][node].pop(key, None)


@dataclass(slots=True)
class Placement:
    """Nodes and meshes of an edited document, in place, with what each baked mesh asks about all of them.

    parents: of each node, −1 for roots. roots: the nodes of each scene. joints: nodes that are joints of a skin.
    num_users: number of nodes with each mesh. groups: those that hide meshes at the roots. new_nodes: by the node of a
    baked mesh, those that have it now.
    """

    json: Json
    source: BakeSource
    parents: list[int]
    roots: list[set[int]]
    joints: frozenset[int]
    num_users: Counter[int]
    groups: VisibilityGroups
    new_nodes: dict[int, list[int]] = field(default_factory=dict)
    _scenes: dict[int, frozenset[int]] = field(default_factory=dict)  # that hold a node of the source, if it was asked
    _scenes_by_root: dict[int, frozenset[int]] = field(init=False)

    def __post_init__(self) -> None:
        """Find the scenes of each root."""
        found: defaultdict[int, set[int]] = defaultdict(set)
        for i, roots in enumerate(self.roots):
            for root in roots:
                found[root].add(i)
        self._scenes_by_root = {root: frozenset(scenes) for root, scenes in found.items()}

    @classmethod
    def of(cls, json: Json, source: BakeSource) -> Placement:
        """Return the placement in a document whose baked meshes are detached."""
        return cls(
            json,
            source,
            hierarchy.parents(json),
            [set(scene.get("nodes", ())) for scene in json_array(json, "scenes")],
            frozenset(joint for skin in json_array(source.document.json, "skins") for joint in skin["joints"]),
            Counter(node["mesh"] for node in json_array(json, "nodes") if "mesh" in node),
            VisibilityGroups(json["nodes"], np.array(hierarchy.parents(source.document.json), np.int64)),
        )

    def add_mesh(self, mesh: Json, old: int) -> int:
        """Store a mesh in place of the `old` one, or after all if a node uses that; return its index."""
        if self.num_users[old]:
            self.json["meshes"].append(mesh)
            return len(self.json["meshes"]) - 1
        self.json["meshes"][old] = mesh
        return old

    def place_node(self, baked: BakedMesh, node: Json) -> int:
        """Add what `node` has to the node of a baked mesh, or to a new node in its space; return the index.

        Vertices in mesh space stay on their node, or below it if `node` has a transform. Vertices in world space belong
        to a root: the node itself, without its transform, if it has no children and is no joint, else a new one.
        """
        own, in_mesh_space = self.json["nodes"][baked.node], self.source.in_mesh_space
        is_free = not own.get("children") and baked.node not in self.joints and not in_mesh_space
        if not is_free and (not in_mesh_space or any(key in node for key in (*TRANSFORMS, "extras"))):
            return self.place_new_node(baked, node)
        if not in_mesh_space:
            self._make_root(baked.node)
            for key in TRANSFORMS:
                own.pop(key, None)
        extras = own.get("extras")
        own.update(node)
        if isinstance(extras, dict) and "extras" in node:
            own["extras"] = {**extras, **node["extras"]}
        self._count(baked, baked.node, node)
        return baked.node

    def place_new_node(self, baked: BakedMesh, node: Json) -> int:
        """Append a node, below that of a baked mesh, or in world space to the scenes that hold it; return its index."""
        self.json["nodes"].append({"name": baked_name(self.json, baked.node), **node})
        index = len(self.json["nodes"]) - 1
        if self.source.in_mesh_space:
            self.json["nodes"][baked.node].setdefault("children", []).append(index)
        else:
            self._add_root(self.groups.place(index, baked.node), self._scenes_of(baked.node))
        self._count(baked, index, node)
        return index

    def place_group(self, baked: BakedMesh, nodes: Sequence[Json], parent: Json) -> int:
        """Append nodes below a new `parent`, which is placed like a new node; return the index of the first one."""
        first, count = len(self.json["nodes"]), len(nodes)
        self.json["nodes"] += nodes
        for i, node in enumerate(nodes):
            self._count(baked, first + i, node)
        self.place_new_node(baked, {"children": list(range(first, first + count)), **parent})
        return first

    def _count(self, baked: BakedMesh, index: int, node: Json) -> None:
        """Count a node of a baked mesh, if it has a mesh."""
        if "mesh" in node:
            self.num_users[node["mesh"]] += 1
            self.new_nodes.setdefault(baked.node, []).append(index)

    def _scenes_of(self, node: int) -> list[int]:
        """Indices of the scenes that hold a node."""
        path = []
        while node >= 0 and node not in self._scenes:
            path.append(node)
            node = self.parents[node]
        found = self._scenes.get(node, frozenset[int]())
        for each in reversed(path):
            found |= self._scenes_by_root.get(each, frozenset())
            self._scenes[each] = found
        return sorted(found)

    def _make_root(self, node: int) -> None:
        """Move a node from its parent to the roots of the scenes that hold it."""
        scenes, above = self._scenes_of(node), self.parents[node]
        if above >= 0:
            parent = self.json["nodes"][above]
            parent["children"].remove(node)
            if not parent["children"]:
                del parent["children"]
            self.parents[node] = -1
        self._add_root(self.groups.place(node, above), scenes)

    def _add_root(self, node: int, scenes: Collection[int]) -> None:
        for i in scenes:
            if node not in self.roots[i]:
                self.roots[i].add(node)
                self.json["scenes"][i]["nodes"].append(node)

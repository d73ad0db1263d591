"""Paths of the prims of skeletons and meshes, known before any is defined, so that all are defined in one change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from anim.exchange.usd_skel.node_prims import NodePrims
from anim.exchange.usd_skel.skeleton_group import SkeletonGroup
from anim.model import MeshInstance, Skeleton


class StageLayout(NamedTuple):
    """Paths of the Mesh prims by node, and of the Skeleton prims by group; both with type names, in the stage's order.

    meshes: {node: path}. skeletons: [path]. prims: [(path, type name)].
    """

    meshes: dict[int, str]
    skeletons: list[str]
    prims: list[tuple[str, str]]


def lay_out(
    skeleton: Skeleton, nodes: NodePrims, plain: Sequence[MeshInstance], groups: Sequence[SkeletonGroup]
) -> StageLayout:
    """Return the layout: `plain` instances below their nodes, and skeletons with their members below the anchors."""
    found = StageLayout({}, [], [])
    for instance in plain:
        _add_mesh(found, nodes, instance, instance.node, instance.mesh.name)
    for group in groups:
        path = nodes.names.child(nodes.path(group.anchor), "skeleton")
        found.skeletons.append(path)
        found.prims.extend(((path, "Skeleton"), (f"{path}/animation", "SkelAnimation")))
        for instance, _ in group.members:
            is_own = instance.node == group.anchor
            name = instance.mesh.name if is_own else skeleton.names[instance.node]
            _add_mesh(found, nodes, instance, group.anchor, name)
    return found


def _add_mesh(layout: StageLayout, nodes: NodePrims, instance: MeshInstance, parent: int, name: str) -> None:
    path = nodes.names.child(nodes.path(parent), name or f"mesh{instance.node}")
    layout.meshes[instance.node] = path
    layout.prims.append((path, "Mesh"))

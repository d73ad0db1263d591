"""Meshes of two glTF files that correspond, and bakes with pages or morph targets instead of a skin."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence

import numpy as np

from anim.caches.source_document.bake_source import BAKED_SUFFIX
from anim.gltf.document import Document, json_array
from anim.model import Mesh, MeshInstance, Scene, VertexCache

TARGET_TOLERANCE = 1e-3  # of the largest offset, of targets that are stored as integers


def pages_of(document: Document) -> VertexCache | None:
    """Return the flip-book in a document, or None."""
    if not any(isinstance(node.get("extras"), dict) for node in json_array(document.json, "nodes")):
        return None
    from anim.caches.formats.flipbook_reader import read_pages  # imports the writers of caches

    return read_pages(document)


def is_bake_of(old: Scene, new: Scene, num_clips: int) -> bool:
    """Return whether the new scene has a skinned or morphed mesh of the old one with morph targets of its own.

    num_clips: of the new file. A bake has at most one: files with more, and other morph targets, are two versions.
    """
    if not any(each.skin is None and len(each.mesh.targets) for each in new.instances):
        return False
    pairs = ((old.instances[i], new.instances[k]) for i, k in instance_pairs(old, new))
    return any(
        before.skin is not None or (num_clips <= 1 and _has_other_targets(before.mesh, after.mesh))
        for before, after in pairs
        if after.skin is None and len(after.mesh.targets)
    )


def _has_other_targets(old: Mesh, new: Mesh) -> bool:
    """Return True for two morphed meshes with different targets: weights of one mean nothing to the other."""
    if not len(old.targets) or old.targets.shape != new.targets.shape:
        return len(old.targets) > 0
    return float(np.abs(old.targets - new.targets).max()) > TARGET_TOLERANCE * float(np.abs(old.targets).max())


def node_pairs(old: Scene, new: Scene) -> Iterator[tuple[int, int]]:
    """Yield the nodes of meshes that correspond by name and number of vertices."""
    for i, k in instance_pairs(old, new):
        yield old.instances[i].node, new.instances[k].node


def instance_pairs(old: Scene, new: Scene) -> Iterator[tuple[int, int]]:
    """Yield the indices of instances that correspond by node name, else by mesh name, each used once."""
    free: dict[tuple[str, str, int], list[int]] = {}  # the first of a list at its end
    for k, each in reversed(list(enumerate(new.instances))):
        count = len(each.mesh.positions)
        free.setdefault(("node", node_name(new, each), count), []).append(k)
        free.setdefault(("mesh", each.mesh.name, count), []).append(k)
    used: set[int] = set()
    for i, each in enumerate(old.instances):
        count, name = len(each.mesh.positions), node_name(old, each)
        by_node = _first_free([free.get(("node", one, count), []) for one in (name, f"{name}{BAKED_SUFFIX}")], used)
        by_mesh = _first_free([free.get(("mesh", each.mesh.name, count), [])], used) if each.mesh.name else None
        found = by_mesh if by_node is None else by_node
        if found is not None:
            used.add(found)
            yield i, found


def _first_free(lists: Sequence[list[int]], used: Container[int]) -> int | None:
    """The smallest index that is not used, from lists with their smallest at the end; used ones are removed."""
    for each in lists:
        while each and each[-1] in used:
            each.pop()
    return min((each[-1] for each in lists if each), default=None)


def node_name(scene: Scene, instance: MeshInstance) -> str:
    """Return the name of the node of an instance."""
    return scene.skeleton.display_name(instance.node)

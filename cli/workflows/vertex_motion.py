"""Vertices of glTF files and caches at common times, paired mesh by mesh."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.source_document.bake_source import BAKED_SUFFIX, baked_meshes
from anim.caches.transforms import statistics
from anim.caches.transforms.resample import resample_frames
from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import RangeError
from anim.gltf.document import Document, json_array
from anim.model import Clip, Mesh, MeshInstance, Scene, VertexCache
from anim.sampling.times import frame_times

TARGET_TOLERANCE = 1e-3  # of the largest offset, of targets that are stored as integers


@dataclass(frozen=True, slots=True)
class VertexMotion:
    """A clip of a document, or a cache: its vertices in the order of `columns`.

    keys: (K,) s. labels: name and vertex count of each mesh, of a document.
    """

    source: VertexCache | tuple[Scene, Clip, Sequence[int]]
    columns: Ints
    keys: Floats
    labels: tuple[tuple[str, int], ...] = ()

    def frames(self, times: Floats) -> Iterator[AnyArray]:
        """Yield the vertices (V, 3) at each time."""
        if isinstance(self.source, VertexCache):
            cache = resample_frames(self.source, times)
        else:
            from anim.skinning.bake import bake  # `diff` of two clips imports no skinning

            scene, clip, nodes = self.source
            cache = bake(scene, clip, times=times, rigid=True, nodes=nodes)
        for chunk in cache.chunks():
            yield from chunk.positions[:, self.columns]

    def diagonal(self) -> float:
        """Return the size of the model in metres, at rest."""
        if isinstance(self.source, VertexCache):
            return statistics.diagonal(self.source)
        from anim.skinning.bake import bake

        scene, clip, nodes = self.source
        return statistics.diagonal(bake(scene, clip, times=self.keys[:1], rigid=True, nodes=nodes))


def pair_with_cache(
    document: Document, scene: Scene, clip: Clip, cache: VertexCache
) -> tuple[VertexMotion, VertexMotion]:
    """Return a clip of a document and a cache of it. Raises RangeError for vertices that do not fit."""
    meshes = baked_meshes(cache, document)
    by_node = {each.node: each for each in scene.instances}
    instances = [by_node[each.node] for each in meshes]
    return _of_scene(scene, clip, instances), cache_motion(cache)


def pair_documents(
    old: tuple[Scene, Clip], new: tuple[Scene, Clip]
) -> tuple[VertexMotion, VertexMotion, tuple[str, ...]]:
    """Return two clips with the meshes that both scenes have, and the names of those that only the first one has.

    Meshes are paired by the names of their nodes and meshes and by their vertex counts.
    """
    pairs = dict(_pairs(old[0], new[0]))
    missing = tuple(_name(old[0], each) for i, each in enumerate(old[0].instances) if i not in pairs)
    if not pairs:
        raise RangeError("no mesh has the same name and number of vertices in both files")
    first = [old[0].instances[i] for i in pairs]
    second = [new[0].instances[k] for k in pairs.values()]
    return _of_scene(*old, first), _of_scene(*new, second), missing


def cache_motion(cache: VertexCache) -> VertexMotion:
    """Return the motion of a cache, Y up."""
    cache = to_up_axis(cache, "y")
    labels = tuple((part.name, part.vertices[1] - part.vertices[0]) for part in cache.parts)
    return VertexMotion(cache, np.arange(cache.vertex_count), cache.times, labels)


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
    pairs = ((old.instances[i], new.instances[k]) for i, k in _pairs(old, new))
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
    for i, k in _pairs(old, new):
        yield old.instances[i].node, new.instances[k].node


def common_times(old: VertexMotion, new: VertexMotion, fps: float) -> Floats:
    """Return all keys of both, the middles between them and a grid, in the range of both."""
    start, end = max(old.keys[0], new.keys[0]), min(old.keys[-1], new.keys[-1])
    if start > end:
        spans = (f"{each.keys[0]:g} s to {each.keys[-1]:g} s" for each in (old, new))
        raise RangeError(f"no time is in both ({' and '.join(spans)})")
    keys = np.unique(np.concatenate((old.keys, new.keys)))
    keys = np.concatenate((keys, (keys[1:] + keys[:-1]) / 2, frame_times(float(start), float(end), fps=fps)))
    return np.unique(keys[(keys >= start) & (keys <= end)])


def locate(motion: VertexMotion, vertex: int) -> tuple[str, int]:
    """Return the mesh of a vertex, and the vertex in it."""
    for name, count in motion.labels:
        if vertex < count:
            return name, vertex
        vertex -= count
    return "", vertex


def _pairs(old: Scene, new: Scene) -> Iterator[tuple[int, int]]:
    """Indices of instances that correspond by node name, else by mesh name, each used once."""
    free: dict[tuple[str, str, int], list[int]] = {}  # the first of a list at its end
    for k, each in reversed(list(enumerate(new.instances))):
        count = len(each.mesh.positions)
        free.setdefault(("node", _name(new, each), count), []).append(k)
        free.setdefault(("mesh", each.mesh.name, count), []).append(k)
    used: set[int] = set()
    for i, each in enumerate(old.instances):
        count, name = len(each.mesh.positions), _name(old, each)
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


def _name(scene: Scene, instance: MeshInstance) -> str:
    return scene.skeleton.display_name(instance.node)


def _of_scene(scene: Scene, clip: Clip, instances: Sequence[MeshInstance]) -> VertexMotion:
    """Vertices of instances in their order; the bake has them depth-first."""
    nodes = {each.node for each in instances}
    baked = [each for each in scene.instances if each.node in nodes and len(each.mesh.positions)]
    starts = np.cumsum([0, *(len(each.mesh.positions) for each in baked)])
    first = {each.node: int(start) for each, start in zip(baked, starts, strict=False)}
    spans = [np.arange(len(each.mesh.positions)) + first.get(each.node, 0) for each in instances]
    labels = tuple((_name(scene, each), len(each.mesh.positions)) for each in instances)
    return VertexMotion((scene, clip, sorted(nodes)), np.concatenate(spans), clip.key_times, labels)

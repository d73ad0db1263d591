"""Vertices of glTF files and caches at common times, paired mesh by mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.source_document.bake_source import baked_meshes
from anim.caches.transforms import statistics
from anim.caches.transforms.resample import resample_frames
from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import RangeError
from anim.gltf.document import Document
from anim.model import Clip, MeshInstance, Scene, VertexCache
from anim.sampling.times import frame_times
from cli.workflows.mesh_pairs import instance_pairs, node_name


class VertexMotion(NamedTuple):
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
    pairs = dict(instance_pairs(old[0], new[0]))
    missing = tuple(node_name(old[0], each) for i, each in enumerate(old[0].instances) if i not in pairs)
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


def _of_scene(scene: Scene, clip: Clip, instances: Sequence[MeshInstance]) -> VertexMotion:
    """Vertices of instances in their order; the bake has them depth-first."""
    nodes = {each.node for each in instances}
    baked = [each for each in scene.instances if each.node in nodes and len(each.mesh.positions)]
    starts = np.cumsum([0, *(len(each.mesh.positions) for each in baked)])
    first = {each.node: int(start) for each, start in zip(baked, starts, strict=False)}
    spans = [np.arange(len(each.mesh.positions)) + first.get(each.node, 0) for each in instances]
    labels = tuple((node_name(scene, each), len(each.mesh.positions)) for each in instances)
    return VertexMotion((scene, clip, sorted(nodes)), np.concatenate(spans), clip.key_times, labels)

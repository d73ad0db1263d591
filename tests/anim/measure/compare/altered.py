"""A scene in other versions: quantized, reordered, renamed, with other nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error.metric import NOISE, ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.model import Clip, Mesh, MeshInstance, Scene, Skeleton, TimeAxis

SHIFT, FACTOR = np.array([3.0, -2.0, 1.0]), 7.0  # of the quantized mesh space: q = 7 p + shift

NOTHING = np.empty(0)


def same_as_plain(scene: Scene, other: Scene, before: Clip, after: Clip) -> ErrorMetric:
    """Nothing against itself, and the same between two clips as on one scene alone."""
    ruler, times = ErrorMetric(scene, other), dense_times(before, after)
    assert ruler.error_at(before, before, times).max_error <= 3 * NOISE * ruler.diagonal
    plain = ErrorMetric(scene).error_at(before, after, times)
    found = ruler.error_at(before, after, times)
    assert found.max_error == pytest.approx(plain.max_error, rel=2e-3)
    assert plain.max_error > 1e-4 * ruler.diagonal
    return ruler


def slower(before: Clip) -> Clip:
    return Clip(before.name, tuple(replace(each, time_axis=TimeAxis(1.05 * each.times)) for each in before.tracks))


def quantized(instance: MeshInstance) -> MeshInstance:
    assert instance.skin is not None
    back = np.column_stack((np.eye(3) / FACTOR, -SHIFT / FACTOR))
    bind = matrix.multiply(instance.skin.inverse_bind, back)
    return replace(instance, mesh=in_space(instance.mesh), skin=replace(instance.skin, inverse_bind=bind))


def in_space(mesh: Mesh) -> Mesh:
    return replace(mesh, positions=FACTOR * mesh.positions + SHIFT, targets=FACTOR * mesh.targets)


def reduced(instance: MeshInstance) -> MeshInstance:
    """Every vertex but the first, backward; without faces."""
    return chosen(instance, np.arange(len(instance.mesh.positions), dtype=np.int64)[:0:-1])


def backward(instance: MeshInstance) -> MeshInstance:
    return chosen(instance, np.arange(len(instance.mesh.positions), dtype=np.int64)[::-1])


def chosen(instance: MeshInstance, kept: Ints) -> MeshInstance:
    mesh = instance.mesh
    chosen = replace(
        mesh,
        positions=mesh.positions[kept],
        faces=np.empty((0, 3), np.int64),
        joints=mesh.joints[kept],
        weights=mesh.weights[kept],
        targets=mesh.targets[:, kept],
    )
    return replace(instance, mesh=chosen)


def renumbered(scene: Scene, moved: Clip) -> tuple[Scene, Clip]:
    """The same scene and clip with the nodes backward."""
    last = len(scene.skeleton) - 1
    parents = np.array([last - p if p >= 0 else -1 for p in scene.skeleton.parents.tolist()])[::-1]
    parts = [getattr(scene.skeleton, name)[::-1] for name in ("translation", "rotation", "scale")]
    nodes = Skeleton(scene.skeleton.names[::-1], parents, *parts)
    instances = tuple(
        replace(each, node=last - each.node, skin=each.skin and replace(each.skin, joints=last - each.skin.joints))
        for each in scene.instances
    )
    tracks = tuple(replace(each, node=last - each.node) for each in moved.tracks if each.node is not None)
    return Scene(nodes, instances), Clip(moved.name, tracks)


def with_root(nodes: Skeleton, name: str) -> Skeleton:
    """The nodes and one more, without a parent."""
    return Skeleton(
        (*nodes.names, name),
        np.append(nodes.parents, -1),
        np.vstack((nodes.translation, [[0, 0, 0]])),
        np.vstack((nodes.rotation, [[0, 0, 0, 1]])),
        np.vstack((nodes.scale, [[1, 1, 1]])),
    )


def renamed(nodes: Skeleton, number: int) -> tuple[str, ...]:
    return tuple("another" if i == number else name for i, name in enumerate(nodes.names))


def box(nodes: Skeleton, node: int) -> Scene:
    sides = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 2) for z in (0.0, 1)])
    return Scene(nodes, (MeshInstance(node, mesh(sides), None, NOTHING),))


def mesh(points: Floats) -> Mesh:
    none = np.empty((len(points), 0))
    faces, targets = np.empty((0, 3), np.int64), np.empty((0, len(points), 3))
    return Mesh("box", points, faces, none.astype(np.int64), none, targets, NOTHING)

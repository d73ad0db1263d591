"""Few vertices of each mesh that stand for all: the extreme ones of each joint, and of each morph target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Ints
from anim.model import Mesh, Scene

MIN_VERTICES = 64  # of a mesh; smaller ones stay whole


def reduce_scene(scene: Scene, nodes: frozenset[int]) -> Scene:
    """Return a scene of the meshes on these nodes, with extreme vertices only, and without faces and normals."""
    reduced = [
        replace(each, mesh=each.mesh.keep_vertices(extreme_vertices(each.mesh)))
        for each in scene.instances
        if each.node in nodes
    ]
    return Scene(scene.skeleton, tuple(reduced))


def extreme_vertices(mesh: Mesh) -> Ints:
    """Return the indices of the vertices that reach farthest along ±x, ±y, ±z among those of each joint.

    A vertex belongs to the joint of its largest weight. Of each morph target the vertex with the largest displacement
    is added. A mesh of few vertices has all of them.
    """
    count = len(mesh.positions)
    if count <= MIN_VERTICES:
        return np.arange(count)
    joint = np.zeros(count, np.int64)
    if mesh.joints.shape[1]:
        joint = np.take_along_axis(mesh.joints, mesh.weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    chosen = []
    for axis in range(3):
        order = np.lexsort((mesh.positions[:, axis], joint))
        is_first = np.diff(joint[order], prepend=-1) != 0
        starts = np.flatnonzero(is_first)
        ends = np.append(starts[1:], count) - 1
        chosen += [order[starts], order[ends]]
    if len(mesh.targets):
        chosen.append(np.einsum("mvi,mvi->mv", mesh.targets, mesh.targets).argmax(axis=1))
    return np.unique(np.concatenate(chosen))

"""Two clips apart by brute force: every vertex at every time, skinned one matrix at a time; and scenes to try it on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from anim.arrays import Floats
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.model import Clip, Mesh, MeshInstance, Pose, Scene, Track
from anim.sampling import sample_pose, world_matrices
from tests.clips import skeleton

Find = Callable[[str], Path]


def with_track(whole: Clip, index: int, new: Track) -> Clip:
    """Return the clip with another track at a place."""
    return Clip(whole.name, tuple(new if i == index else each for i, each in enumerate(whole.tracks)))


def clip_of(document: Document, name: str | None) -> Clip:
    """Return the clip of a name, or the first."""
    clips = reader.clips(document)
    return next(each for each in clips if name in (None, each.name))


def points_on_a_node(points: list[list[float]], *, targets: list[list[list[float]]] | None = None) -> Scene:
    """Return points on one node, without a skin."""
    count = len(points)
    moved = np.array(targets, float) if targets else np.empty((0, count, 3))
    faces, joints = np.empty((0, 3), np.int64), np.empty((count, 0), np.int64)
    mesh = Mesh("points", np.array(points, float), faces, joints, np.empty((count, 0)), moved, np.zeros(len(moved)))
    return Scene(skeleton([-1]), (MeshInstance(0, mesh, None, np.zeros(len(moved))),))


def brute(scene: Scene, before: Clip, after: Clip, times: Floats, *, other: Scene | None = None) -> float:
    """Return the largest distance of any vertex, or node where there are none, between two clips at these times.

    other: the scene of the second clip, with the same vertices.
    """
    scenes = scene, other or scene
    old, new = (sample_pose(one.skeleton, clip, times) for one, clip in zip(scenes, (before, after), strict=True))
    worlds = [_fourth_row(world_matrices(one.skeleton, pose)) for one, pose in zip(scenes, (old, new), strict=True)]
    worst = 0.0
    for first, second in zip(*(one.instances for one in scenes), strict=True):
        for frame in range(len(times)):
            a = _vertices(first, worlds[0][frame], _weights(old, first, frame))
            b = _vertices(second, worlds[1][frame], _weights(new, second, frame))
            worst = max(worst, float(np.linalg.norm(a - b, axis=1).max(initial=0)))
    return worst


def _vertices(instance: MeshInstance, world: Floats, weights: Floats) -> Floats:
    """Vertices (V, 3) in the world: morphed, then by Σ w (world · inverse bind) of the joints, or by the node."""
    mesh = instance.mesh
    points = mesh.positions + sum(w * target for w, target in zip(weights, mesh.targets, strict=True))
    whole = np.column_stack((points, np.ones(len(points))))
    if instance.skin is None:
        return np.asarray((whole @ world[instance.node].T)[:, :3])
    matrices = np.array(
        [world[j] @ b for j, b in zip(instance.skin.joints, _fourth_row(instance.skin.inverse_bind), strict=True)]
    )
    blended = (mesh.weights[:, :, None, None] * matrices[mesh.joints]).sum(axis=1)
    return np.asarray((blended @ whole[:, :, None])[:, :3, 0])


def _fourth_row(matrices: Floats) -> Floats:
    row = np.broadcast_to([0.0, 0, 0, 1], (*matrices.shape[:-2], 1, 4))
    return np.concatenate((matrices, row), axis=-2)


def _weights(at: Pose, instance: MeshInstance, frame: int) -> Floats:
    found = at.weights.get(instance.node)
    return instance.weights if found is None else found[frame]

"""Scenes by hand, and plain loops that say where their vertices must be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.model import Clip, Mesh, MeshInstance, Scene, Skin
from anim.sampling import sample_pose, world_matrices
from tests.clips import skeleton

TRIANGLE = np.array([[0, 1, 2]])


def mesh(points: Any, joints: Any, weights: Any, **more: Any) -> Mesh:
    """Return a mesh of these points (V, 3) and influences (V, I). more: normals, targets, faces, rest_weights."""
    positions = np.array(points, float)
    targets = np.array(more.pop("targets", np.empty((0, len(positions), 3))), float)
    faces = np.array(more.pop("faces", np.empty((0, 3))), np.int64)
    rest = np.array(more.pop("rest_weights", np.zeros(len(targets))), float)
    held = (np.array(joints, np.int64), np.array(weights, float))
    return Mesh(more.pop("name", "mesh"), positions, faces, *held, targets, rest, **more)


def scene(of: Mesh, parents: Sequence[int], *, inverse_bind: Any = None, **rest: Any) -> Scene:
    """Return a scene of joints 0 … J − 1 and the mesh on a node after them. rest: their transforms at rest."""
    count = len(parents)
    for key, filler in (("translation", [0.0, 0, 0]), ("rotation", [0.0, 0, 0, 1]), ("scale", [1.0, 1, 1])):
        if key in rest and len(rest[key]) == count:
            rest[key] = [*rest[key], filler]
    nodes = skeleton([*parents, -1], **rest)
    if inverse_bind is None:
        inverse_bind = np.tile(np.eye(4)[:3], (count, 1, 1))
    skin = Skin(np.arange(count), np.asarray(inverse_bind, float))
    return Scene(nodes, (MeshInstance(count, of, skin, of.rest_weights),))


def random_scene(seed: int, *, joints: int = 9, vertices: int = 150, scale_shear: float = 0.0, **more: Any) -> Scene:
    """Return a tree of joints with turned binds and a mesh of 0 to 5 influences a vertex; weights add up to 1.

    scale_shear: deviation of scales at rest from 1; a joint's scale under a turned one shears what hangs on it.
    """
    random = np.random.default_rng(seed)
    parents = [-1, *(int(random.integers(0, j)) for j in range(1, joints))]
    turns = random.normal(size=(joints, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    scales = np.exp(scale_shear * random.normal(size=(joints, 3)))
    binds = matrix.from_trs(random.normal(size=(joints, 3)), np.roll(turns, 1, axis=0), np.ones((joints, 3)))
    held = np.stack([random.permutation(joints)[:5] for _ in range(vertices)])
    weights = random.random((vertices, 5))
    weights[np.arange(5) >= random.integers(1, 6, vertices)[:, None]] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    points = random.normal(size=(vertices, 3))
    faces = random.integers(0, vertices, (100, 3))
    of = mesh(points, held, weights, faces=faces, **more)
    places = random.normal(size=(joints, 3))
    return scene(of, parents, inverse_bind=binds, translation=places, rotation=turns, scale=scales)


def skinning_matrices(of: Scene, clip: Clip, times: Floats) -> Floats:
    """Return world_from_mesh (F, J, 3, 4) of the one mesh's joints."""
    world = world_matrices(of.skeleton, sample_pose(of.skeleton, clip, times))
    (instance,) = of.instances
    assert instance.skin is not None
    return matrix.multiply(world[:, instance.skin.joints], instance.skin.inverse_bind)


def looped(points: Floats, joints: Ints, weights: Floats, matrices: Floats) -> Floats:
    """Return Σ w (A p + t), (F, V, 3), by four loops."""
    result = np.zeros((len(matrices), len(points), 3))
    for f, frame in enumerate(matrices):
        for v, point in enumerate(points):
            for joint, weight in zip(joints[v], weights[v], strict=True):
                result[f, v] += weight * (frame[joint, :, :3] @ point + frame[joint, :, 3])
    return result

"""Skin binding of a mesh to joints, in the layout of kernels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints
from anim.errors import RangeError
from anim.model import MeshInstance
from anim.skinning.kernels.layout import FloatArray, Influences


@dataclass(frozen=True, slots=True)
class SkinBinding:
    """V vertices with their joint influences, strongest first, without influences of weight 0.

    nodes: (J,) node indices. bind: (J, 3, 4) joint_from_mesh at bind time. ancestors: (J,) the nearest joint above, or
    −1. points: (V, 3) m in mesh space. normals, tangents: (V, 3), or (0, 3) if not requested. start: (V + 1,);
    influences start[v] … start[v + 1] are vertex v's. joint: (E,) into nodes. weight: (E,). max_count: largest number
    of influences of a vertex. faces: (T, 3).
    """

    nodes: Ints
    bind: Floats
    ancestors: Ints
    points: Floats
    normals: Floats
    tangents: Floats
    start: Ints
    joint: NDArray[np.int32]
    weight: FloatArray
    max_count: int
    faces: Ints

    @property
    def influences(self) -> Influences:
        """The vertices' influences in the layout of kernels."""
        return Influences(self.weight, self.joint, self.start, self.max_count)


def bind_skin(instance: MeshInstance, parents: Ints, *, normals: bool = False, tangents: bool = False) -> SkinBinding:
    """Return the binding of a mesh instance; without a skin it is bound to its own node.

    parents: (N,) of the skeleton. normals, tangents: include the mesh's, if it has them.
    Raises RangeError for a joint that the skin does not have, or a weight that is not finite.
    """
    mesh, skin = instance.mesh, instance.skin
    if skin is None:
        nodes, bind = np.array([instance.node], np.int64), np.eye(4)[None, :3]
        joints, weights = np.zeros((len(mesh.positions), 1), np.int64), np.ones((len(mesh.positions), 1))
    else:
        nodes, bind, joints, weights = skin.joints, skin.inverse_bind, mesh.joints, mesh.weights
        check_influences(joints, weights, len(nodes))
    start, joint, weight = influences(joints, weights)
    none = np.empty((0, 3))
    turned = mesh.normals if normals and mesh.normals is not None else none
    along = mesh.tangents[:, :3] if tangents and mesh.tangents is not None else none
    above = ancestor_joints(nodes, parents)
    return SkinBinding(
        nodes,
        bind,
        above,
        mesh.positions,
        turned,
        along,
        start,
        joint,
        weight,
        int(np.diff(start).max(initial=0)),
        mesh.faces,
    )


def influences(joints: Ints, weights: Floats) -> tuple[Ints, NDArray[np.int32], FloatArray]:
    """Return start (V + 1,), joint (E,) and weight (E,) of joints and weights (V, I), strongest first.

    Zero weights are left out.
    influences([[4, 7]], [[0.25, 0.75]]) → [0, 2], [7, 4], [0.75, 0.25]
    """
    order = np.argsort(-weights, axis=1, kind="stable")
    joints, weights = np.take_along_axis(joints, order, 1), np.take_along_axis(weights, order, 1)
    used = weights > 0
    start = np.zeros(len(joints) + 1, np.int64)
    np.cumsum(used.sum(axis=1), out=start[1:])
    return start, joints[used].astype(np.int32), weights[used].astype(np.float32)


def ancestor_joints(nodes: Ints, parents: Ints) -> Ints:
    """Return for each joint (J,) the index of the nearest joint above it, −1 for none.

    Nodes between joints are passed once, however many joints are below them; so is a node that is several joints,
    of which the last counts.
    """
    if len(nodes) == 1:
        return np.array([-1])
    distinct, first_from_end, joints = np.unique(nodes[::-1], return_index=True, return_inverse=True)
    numbers = len(nodes) - 1 - first_from_end
    nearest = dict(zip(distinct.tolist(), numbers.tolist(), strict=True))  # of a joint itself, and of passed nodes
    found = []
    for node in distinct.tolist():
        at, passed = int(parents[node]), []
        while at >= 0 and at not in nearest:
            passed.append(at)
            at = int(parents[at])
        found.append(nearest.get(at, -1))
        nearest.update(dict.fromkeys(passed, found[-1]))
    return np.array(found, np.int64)[joints[::-1]]


def check_influences(joints: Ints, weights: Floats, count: int) -> None:
    """Raise RangeError for a weight that is no number, or a joint that is not among `count`."""
    if not np.isfinite(weights).all():
        raise RangeError(f"vertex {int(np.argwhere(~np.isfinite(weights))[0][0])} has a skin weight that is no number")
    outside = (joints < 0) | (joints >= count)
    if outside.any():
        v = int(np.argmax(outside.any(axis=1)))
        raise RangeError(f"vertex {v} uses joint {int(joints[outside][0])} (the skin has {count})")

"""Local translation, rotation and scale of an EulerNode at any time, and its rest pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.curve import Curve, evaluate
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode
from anim.maths import euler, quaternion
from anim.maths.euler import AxesConvention
from anim.model import Skeleton
from anim.sampling import rest_world

START = np.zeros(1)  # s


def evaluate_rotation(node: EulerNode, at: Floats, before: bool = False) -> Floats:
    """Return the local rotation (..., 4) of a node at times (...) in seconds: Rpre · R(angles) · Rpost⁻¹.

    before: the left limit at each time, different at steps.
    """
    angles = [
        np.full(at.shape, still) if curve is None else evaluate(curve, at, before=before)
        for curve, still in zip(node.rotation, node.angles.tolist(), strict=True)
    ]
    stacked: Floats = np.stack(angles, axis=-1) if angles else np.zeros((*at.shape, 0))
    turn = euler.to_quaternion(stacked, order=node.order, frame=node.frame)
    if node.pivots is NO_PIVOTS:
        return turn
    after = quaternion.conjugate(node.pivots.post_rotation)
    return quaternion.multiply(quaternion.multiply(node.pivots.pre_rotation, turn), after)


def evaluate_scale(node: EulerNode, at: Floats, before: bool = False) -> Floats:
    """Return the local scale (..., 3) of a node at times (...)."""
    return _by_axis(node.scale, node.scales, at, before)


def evaluate_translation(node: EulerNode, at: Floats, before: bool = False) -> Floats:
    """Return the local translation (..., 3) of a node at times (...), including the effect of pivots.

    T·Roff·Rp·Q·Rp⁻¹·Soff·Sp·S·Sp⁻¹ maps 0 to T + Roff + Rp + Q (Soff + Sp − Rp − S Sp).
    """
    moved = _by_axis(node.translation, node.moves, at, before)
    pivots = node.pivots
    if pivots is NO_PIVOTS:
        return moved
    arm = pivots.scaling_offset + pivots.scaling_pivot - pivots.rotation_pivot
    arm = arm - evaluate_scale(node, at, before) * pivots.scaling_pivot
    swung = quaternion.rotate(evaluate_rotation(node, at, before), arm)
    return np.asarray(moved + pivots.rotation_offset + pivots.rotation_pivot + swung)


def skeleton(motion: EulerMotion) -> Skeleton:
    """Return all nodes in the rest pose: axes at their rest angles, without curves."""
    nodes = motion.nodes
    return Skeleton(
        tuple(node.name for node in nodes),
        np.array([node.parent for node in nodes], np.int64),
        np.array([_rest_translation(node) for node in nodes]).reshape(-1, 3),
        _rest_rotations(nodes),
        np.array([node.scale for node in nodes]).reshape(-1, 3),
    )


def _rest_rotations(nodes: Sequence[EulerNode]) -> Floats:
    """Rest rotations (N, 4); nodes of one convention at a time, since files have thousands."""
    found = np.zeros((len(nodes), 4))
    conventions: dict[tuple[str, AxesConvention], list[int]] = {}
    for i, node in enumerate(nodes):
        if node.pivots is NO_PIVOTS:
            conventions.setdefault((node.order, node.frame), []).append(i)
        else:
            found[i] = evaluate_rotation(_at_rest(node), START)[0]
    for (order, frame), some in conventions.items():
        angles = np.array([nodes[i].angles for i in some]).reshape(len(some), len(order))
        found[some] = euler.to_quaternion(angles, order=order, frame=frame)
    return found


def _rest_translation(node: EulerNode) -> Floats:
    return node.translation if node.pivots is NO_PIVOTS else evaluate_translation(_at_rest(node), START)[0]


def _at_rest(node: EulerNode) -> EulerNode:
    """The node without curves."""
    return replace(node, rotation=(None,) * len(node.order), moves={}, scales={})


def rest_positions(skeleton: Skeleton) -> Floats:
    """Return the rest positions of all nodes in world space (N, 3) in metres."""
    return rest_world(skeleton)[:, :, 3]


def bounding_size(skeleton: Skeleton) -> float:
    """Return the longest side of the bounding box of all rest positions, in metres."""
    return float(np.ptp(rest_positions(skeleton), axis=0).max()) if len(skeleton) else 0.0


def _by_axis(still: Floats, curves: Mapping[int, Curve], at: Floats, before: bool) -> Floats:
    columns = [
        evaluate(curves[axis], at, before=before) if axis in curves else np.full(at.shape, still[axis])
        for axis in range(3)
    ]
    return np.stack(columns, axis=-1)

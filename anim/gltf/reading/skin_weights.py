"""JOINTS_n and WEIGHTS_n → influences with weights that sum to 1."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import FormatError
from anim.gltf.document import Json
from anim.gltf.reading.accessors import Accessors

WEIGHT_SUM_TOLERANCE = 1e-4  # of a sum of floats; above the rounding of careful exporters


class Influences(NamedTuple):
    """Joints and weights (V, I), I = 0 without a skin; each vertex's weights sum to 1.

    sums: (V,) sums as stored, 1 if they deviate only by rounding; None if all are 1.
    """

    joints: Ints
    weights: Floats
    sums: Floats | None


def read_influences(accessors: Accessors, attributes: Json, vertices: int, joint_count: int) -> Influences:
    """Return the influences of a primitive's vertices, all sets of four together.

    joint_count: of the skin, 0 for none.

    Weights are divided by their sum, as in players that normalize (three.js, Babylon.js, Blender); a vertex without
    weight follows the first joint of its first set, as in three.js and Babylon.js.
    weights 0.5, 0.25, 0, 0 → 2/3, 1/3, 0, 0 and a sum of 0.75
    Raises FormatError for influences outside the skin, or missing ones with a skin.
    """
    joints: list[Ints] = []
    weights: list[Floats] = []
    steps: list[float] = []
    while joint_count and f"JOINTS_{len(joints)}" in attributes and f"WEIGHTS_{len(joints)}" in attributes:
        k = len(joints)
        stored = attributes[f"WEIGHTS_{k}"]
        joints.append(accessors.indices(attributes[f"JOINTS_{k}"]))
        weights.append(accessors.floats(stored))
        steps.append(_step(accessors.raw(stored).dtype))
        if joints[k].shape != (vertices, 4) or weights[k].shape != (vertices, 4):
            raise FormatError(f"JOINTS_{k} or WEIGHTS_{k} don't have 4 numbers for each of {vertices} vertices")
    if joint_count and not joints:
        raise FormatError("is used with a skin but has no JOINTS_0 and WEIGHTS_0")
    if not joints:
        return Influences(np.empty((vertices, 0), np.int64), np.empty((vertices, 0)), None)
    all_joints, all_weights = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
    outside = (all_joints >= joint_count) & (all_weights != 0)
    if outside.any():
        raise FormatError(
            f"vertex {int(np.argmax(outside.any(axis=1)))} uses joint {int(all_joints[outside][0])} "
            f"(the skin has {joint_count})"
        )
    return _normalize(
        np.where(all_joints < joint_count, all_joints, 0), all_weights, WEIGHT_SUM_TOLERANCE + 4 * sum(steps)
    )


def _normalize(joints: Ints, weights: Floats, tolerance: float) -> Influences:
    """Weights divided by their sum. Rows with a negative weight are rejected by `Mesh`."""
    sums = weights.sum(axis=1)
    whole = weights.copy()
    none = ~weights.any(axis=1)
    whole[none, 0] = 1
    some = (sums > 0) & (weights >= 0).all(axis=1)
    whole[some] /= sums[some, None]
    off = np.abs(sums - 1) > tolerance
    return Influences(np.where(whole != 0, joints, 0), whole, np.where(off, sums, 1.0) if off.any() else None)


def _step(dtype: np.dtype[Any]) -> float:
    """The step between two stored weights, the maximum rounding error; 0 for floats."""
    return 0.0 if dtype.kind == "f" else 1 / float(np.iinfo(dtype).max)

"""Optimized centers of rotation: for each vertex the centroid of the surface with similar weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.skinning.binding import SkinBinding

SIMILARITY_WIDTH = 0.1  # σ of the paper: width of the similarity kernel
MIN_WEIGHT_PRODUCT = 1e-8  # pairs of weights with a smaller product are negligible


@dataclass(frozen=True, slots=True)
class WeightPairs:
    """Triangles by pairs of joints (a < b) with influence on both.

    key: (P,) a · J + b, increasing. start: (P + 1,) into the rows. weights: (R, 2) of a and b, means of corners.
    area: (R,) m². moment: (R, 3) area times centroid.
    """

    key: Ints
    start: Ints
    weights: Floats
    area: Floats
    moment: Floats


def find_centers(rig: SkinBinding) -> Floats:
    """Return the center of rotation of each vertex (V, 3) in mesh space; NaN for a single joint.

    The area-weighted mean of triangle centroids with the similarity Σ wa wb ta tb exp(−(wa tb − wb ta)² / σ²) over
    ordered pairs of joints, w of the vertex and t of the triangle. Only triangles that share two joints with a vertex
    count, so each is visited once per shared pair and the others never: exact, without the paper's clusters.
    Source: Le & Hodgins 2016, equations 1 and 4.
    """
    pairs = _pairs(rig)
    sums = np.zeros((len(rig.points), 4))
    from anim.skinning.kernels.center_sums import accumulate_centers

    accumulate_centers(
        rig.start, rig.joint, rig.weight, len(rig.nodes), pairs.key, pairs.start, pairs.weights, pairs.area,
        pairs.moment, 1 / SIMILARITY_WIDTH**2, sums,
    )  # fmt: skip
    found: Floats = np.full((len(rig.points), 3), np.nan)
    has = sums[:, 3] > 0
    found[has] = sums[has, :3] / sums[has, 3:]
    return found


def _pairs(rig: SkinBinding) -> WeightPairs:
    corners = rig.points[rig.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.sqrt((across * across).sum(axis=1)) / 2
    moment = area[:, None] * corners.mean(axis=1)
    joint, weight = _face_weights(rig)
    keys, rows, pair_weights = [], [], []
    for i in range(joint.shape[1]):
        for k in range(i + 1, joint.shape[1]):
            r = np.flatnonzero(weight[:, i] * weight[:, k] > MIN_WEIGHT_PRODUCT)
            keys.append(joint[r, i] * len(rig.nodes) + joint[r, k])
            rows.append(r)
            pair_weights.append(weight[r][:, [i, k]])
    if not keys:
        return WeightPairs(
            *(np.empty(0, np.int64), np.zeros(1, np.int64)), np.empty((0, 2)), np.empty(0), np.empty((0, 3))
        )
    key, row = np.concatenate(keys), np.concatenate(rows)
    order = np.lexsort((row, key))
    distinct, first = np.unique(key[order], return_index=True)
    row = row[order]
    return WeightPairs(
        distinct, np.append(first, len(row)), np.concatenate(pair_weights)[order], area[row], moment[row]
    )


def _face_weights(rig: SkinBinding) -> tuple[Ints, Floats]:
    """Joints and mean weights (T, I) of the faces, joints increasing, each once; padded with weight 0."""
    counts = np.diff(rig.start)
    most = int(counts.max(initial=0))
    places = np.minimum(rig.start[:-1, None] + np.arange(most), max(len(rig.joint) - 1, 0))
    there = np.arange(most) < counts[:, None]
    joint = np.where(there, rig.joint[places], 0).astype(np.int64)[rig.faces].reshape(len(rig.faces), 3 * most)
    weight = np.where(there, rig.weight[places], 0).astype(np.float64)[rig.faces].reshape(len(rig.faces), 3 * most) / 3
    order = np.argsort(joint, axis=1, kind="stable")
    joint, weight = np.take_along_axis(joint, order, 1), np.take_along_axis(weight, order, 1)
    for i in range(1, joint.shape[1]):  # the sum of equal joints moves to the last of them
        same = joint[:, i] == joint[:, i - 1]
        weight[same, i] += weight[same, i - 1]
        weight[same, i - 1] = 0
    return joint, weight

"""Constraints of cloth: distances of points, compliant or limited, and distances to distant and pinned points.

Sources: Macklin, Müller, Chentanez, XPBD, 2016; Provot, Deformation Constraints, 1995, for limits of elongation; Kim,
Chentanez, Müller-Fischer, Long Range Attachments, 2012, for tethers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints
from anim.skinning.kernels.jit import jit


@jit
def project_distances(p: Floats, w: Floats, pairs: Ints, rest: Floats, compliance: float, multipliers: Floats) -> None:
    """Move pairs (E, 2) of points towards their rest distances (E,), in order: Gauss-Seidel.

    p: (P, 3) m, changed. w: (P,) inverse masses 1/kg. compliance: of all, m/N, over the squared step. multipliers:
    (E,) Lagrange multipliers of this step, changed; 0 before its first sweep.
    """
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        dx, dy, dz = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        total = w[i] + w[j]
        if total == 0.0 or length == 0.0:
            continue
        change = -(length - rest[k] + compliance * multipliers[k]) / (total + compliance)
        multipliers[k] += change
        s = change / length
        p[i, 0] += s * w[i] * dx
        p[i, 1] += s * w[i] * dy
        p[i, 2] += s * w[i] * dz
        p[j, 0] -= s * w[j] * dx
        p[j, 1] -= s * w[j] * dy
        p[j, 2] -= s * w[j] * dz


@jit
def limit_elongation(
    p: Floats, w: Floats, pairs: Ints, most: Floats, order: Ints, compliance: float, multipliers: Floats
) -> bool:
    """Shorten pairs (E, 2) that are longer than their limit, one after another; return whether there was any.

    The limit is a length `most` (E,), and the elastic elongation that the multipliers of `project_distances` stand for,
    so that a soft fabric is stretched as its compliance says. order: (E,) of the pairs in the multipliers.
    """
    found = False
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        dx, dy, dz = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
        square = dx * dx + dy * dy + dz * dz
        if square <= most[k] * most[k]:
            continue
        limit = most[k] - min(compliance * multipliers[order[k]], 0.0)
        total = w[i] + w[j]
        if square <= limit * limit or total == 0.0:
            continue
        found = True
        length = np.sqrt(square)
        s = (limit - length) / (total * length)
        p[i, 0] += s * w[i] * dx
        p[i, 1] += s * w[i] * dy
        p[i, 2] += s * w[i] * dz
        p[j, 0] -= s * w[j] * dx
        p[j, 1] -= s * w[j] * dy
        p[j, 2] -= s * w[j] * dz
    return found


@jit
def shorten_pairs(p: Floats, w: Floats, pairs: NDArray[np.int32], most: Floats, first: int, end: int) -> None:
    """Move pairs first … end − 1 of (D, 2) together that are farther apart than their limits (D,) m, in order."""
    for k in range(first, end):
        i, j = pairs[k, 0], pairs[k, 1]
        dx, dy, dz = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
        square = dx * dx + dy * dy + dz * dz
        if square <= most[k] * most[k]:
            continue
        length = np.sqrt(square)
        s = (most[k] - length) / ((w[i] + w[j]) * length)
        p[i, 0] += s * w[i] * dx
        p[i, 1] += s * w[i] * dy
        p[i, 2] += s * w[i] * dz
        p[j, 0] -= s * w[j] * dx
        p[j, 1] -= s * w[j] * dy
        p[j, 2] -= s * w[j] * dz


@jit
def limit_tethers(p: Floats, w: Floats, anchors: Ints, limits: Floats) -> None:
    """Pull points back that are farther from one of their anchors (P, K) than its limit (P, K) m; −1 for none."""
    for i in range(len(p)):
        if w[i] == 0.0:
            continue
        for n in range(anchors.shape[1]):
            a = anchors[i, n]
            if a < 0:
                continue
            dx, dy, dz = p[i, 0] - p[a, 0], p[i, 1] - p[a, 1], p[i, 2] - p[a, 2]
            square = dx * dx + dy * dy + dz * dz
            if square > limits[i, n] * limits[i, n]:
                s = limits[i, n] / np.sqrt(square)
                p[i, 0] = p[a, 0] + s * dx
                p[i, 1] = p[a, 1] + s * dy
                p[i, 2] = p[a, 2] + s * dz


@jit
def find_longest(p: Floats, w: Floats, pairs: Ints, rest: Floats, longest: Ints, elongation: Floats) -> None:
    """Fill the index (2,) and the relative elongation (2,) of the free and the attached pair that is stretched most.

    Free pairs have two free ends, attached ones a pinned end. Pairs of pinned points (P, 3) are left out; −1 for none.
    """
    square = np.zeros(2)
    longest[:] = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        if w[i] + w[j] == 0.0:
            continue
        kind = 0 if w[i] > 0.0 and w[j] > 0.0 else 1
        dx, dy, dz = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
        found, length = dx * dx + dy * dy + dz * dz, rest[k] * rest[k]
        if found > square[kind] * length:
            square[kind], longest[kind] = found / length, k
    for kind in range(2):
        elongation[kind] = np.sqrt(square[kind]) - 1.0

"""Skin weights that don't add up: used as they are, and told."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from anim.model import Instance

TOLERANCE = 1e-4  # of a sum; rounding to float32 or to 8 bits by a careful exporter stays far below


@dataclass(frozen=True, slots=True)
class BadSums:
    """Vertices of one mesh whose weights don't add up to 1. mesh: its name, or the number of its node.

    count: how many. none: how many of them have no weight at all.
    least, most: the sums farthest below and above 1 among the others.
    """

    mesh: str
    count: int
    none: int
    least: float
    most: float


def bad_sums(instances: Iterable[Instance]) -> list[BadSums]:
    """Return the skinned meshes with vertices whose weights don't add up to 1, each mesh once."""
    found: dict[int, BadSums] = {}
    for instance in instances:
        mesh = instance.mesh
        if instance.skin is None or id(mesh) in found:
            continue
        sums = mesh.weights.sum(axis=1)
        wrong = np.abs(sums - 1) > TOLERANCE
        if wrong.any():
            some = sums[wrong & (sums > 0)]
            least, most = (float(some.min()), float(some.max())) if len(some) else (0.0, 0.0)
            name = mesh.name or f"node {instance.node}"
            found[id(mesh)] = BadSums(name, int(wrong.sum()), int((sums == 0).sum()), least, most)
    return list(found.values())

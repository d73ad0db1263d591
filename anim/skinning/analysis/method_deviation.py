"""Deviation of a method from linear blending, the result in every player."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.model import Clip
from anim.skinning.bake import Baker, prepare_bake


class Deviation(NamedTuple):
    """Largest distance (m) of a vertex from its position by linear blending, and its time (s).

    size: m, of the model.
    """

    distance: float
    time: float
    size: float


def linear_baker(made: Baker, *, space: str) -> Baker:
    """Return a baker of the same meshes by linear blending, positions only. space: that of `made`."""
    nodes = sorted({layer.instance.node for layer in made.layers})
    return prepare_bake(made.scene, space=space, rigid=True, nodes=nodes, threads=made.threads)


def deviation(made: Baker, linear: Baker, clip: Clip, times: Floats) -> Deviation:
    """Return the deviation of `made` from `linear`, bakers of the same meshes, at `times` (F,)."""
    size = model_size(made)
    most = Deviation(0.0, 0.0, size)
    both = (each.bake(clip, times=times).chunks() for each in (made, linear))
    for ours, theirs in zip(*both, strict=True):
        found = max_distance(ours.positions, theirs.positions)
        at = int(found.argmax())
        most = max(most, Deviation(float(found[at]), float(times[ours.first + at]), size))
    return most


def max_distance(positions: AnyArray, others: AnyArray) -> Floats:
    """Return the largest distance (F,) in each frame between positions and others (F, V, 3)."""
    apart = positions - others
    return np.asarray(np.sqrt(np.einsum("fvi,fvi->fv", apart, apart).max(axis=1, initial=0.0)), float)


def model_size(made: Baker) -> float:
    """Return the diagonal in metres of the vertices' bounding box at rest; infinity for an extent of 0."""
    return float(np.linalg.norm(np.ptp(made.rest, axis=0))) or np.inf

"""Tracks that move, of many at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.model import Interpolation, Track, ValueKind
from anim.sampling.batch import ConcatenatedTracks, concatenate

CONSTANT_TOLERANCE = 2e-5  # of the largest value; smaller changes are rounding of the exporter


def are_moving(tracks: Sequence[Track]) -> Bools:
    """Return the mask (T,) of the tracks whose values change by more than rounding.

    Signs of rotations don't count, except under CUBICSPLINE, where they affect the interpolation.
    """
    result = np.zeros(len(tracks), np.bool_)
    for group in concatenate(tracks):
        result[group.numbers] = _is_moving(group)
    return result


def _is_moving(group: ConcatenatedTracks) -> Bools:
    values = group.values
    if group.kind is ValueKind.ROTATION:
        tolerance = np.full(len(group.tracks), CONSTANT_TOLERANCE)
        values = values if group.interpolation is Interpolation.CUBICSPLINE else _align_signs(group)
    else:
        tolerance = CONSTANT_TOLERANCE * np.maximum(_largest(group, values), 1e-30)
    moving = _largest(group, values - np.repeat(values[group.starts], group.counts, axis=0)) > tolerance
    for each in group.tangents or ():
        moving |= (_largest(group, each) > tolerance) & (group.counts > 1)
    return np.asarray(moving)


def _align_signs(group: ConcatenatedTracks) -> Floats:
    """The rotations with signs aligned in each track, up to one sign of the whole track."""
    flips = quaternion.dot(group.values[1:], group.values[:-1]) < 0
    flips[group.starts[1:] - 1] = False
    signs = np.ones(len(group.values))
    signs[1:] = np.cumprod(np.where(flips, -1.0, 1.0))
    return np.asarray(group.values * signs[:, None])


def _largest(group: ConcatenatedTracks, values: Floats) -> Floats:
    """Largest absolute component (T,) of values (S, C) of each track."""
    return np.maximum.reduceat(np.abs(values).max(axis=1), group.starts)

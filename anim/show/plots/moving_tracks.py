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
    distinct: dict[object, int] = {}  # of tracks that share their keys, as those of copied clips, one counts for all
    rows = [distinct.setdefault(_shared_keys(track), len(distinct)) for track in tracks]
    chosen = dict(zip(rows, tracks, strict=True))
    result = np.zeros(len(chosen), np.bool_)
    for group in concatenate([chosen[row] for row in range(len(chosen))]):
        result[group.numbers] = _is_moving(group)
    return result[np.array(rows, np.int64)]


def _shared_keys(track: Track) -> object:
    """The same for tracks that differ in no more than their node: `are_moving` is then the same."""
    return track.kind, track.interpolation, *map(id, (track.values, track.in_tangents, track.out_tangents))


def _is_moving(group: ConcatenatedTracks) -> Bools:
    values = group.values
    if group.kind is ValueKind.ROTATION:
        tolerance = np.full(len(group.tracks), CONSTANT_TOLERANCE)
        if group.interpolation is not Interpolation.CUBICSPLINE:
            values = quaternion.align_signs(values, np.repeat(np.arange(len(group.tracks)), group.counts))
    else:
        tolerance = CONSTANT_TOLERANCE * np.maximum(_largest(group, values), 1e-30)
    moving = _largest(group, values - np.repeat(values[group.starts], group.counts, axis=0)) > tolerance
    for each in group.tangents or ():
        moving |= (_largest(group, each) > tolerance) & (group.counts > 1)
    return np.asarray(moving)


def _largest(group: ConcatenatedTracks, values: Floats) -> Floats:
    """Largest absolute component (T,) of values (S, C) of each track."""
    return np.maximum.reduceat(np.abs(values).max(axis=1), group.starts)

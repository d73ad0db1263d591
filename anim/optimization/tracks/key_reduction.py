"""Key reduction of single tracks: lossless, or within a tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats
from anim.curves.fitting.key_reduction import greedy_keys
from anim.model import FLOAT32, AccessorFormat, Interpolation, Track, ValueKind
from anim.sampling.track import sample

INT16 = AccessorFormat(5122, normalized=True)
UNIT_LENGTH_TOLERANCE = 1e-12  # deviation from 1 that is rounding in float64
POINTER_BOUND_FRACTION = 0.9  # of the bound; the rest covers rounding to float32


def reduce_lossless(track: Track) -> Track:
    """Return the track without redundant keys, in int16 if that represents every rotation exactly.

    A value that is constant over several keys keeps the first and the last of them, or one at the track's ends, where
    players extend it as a constant. STEP keeps each key that differs from the previous one.
    """
    if track.interpolation is not Interpolation.CUBICSPLINE:
        kept = _reduce(track)
    else:
        kept = _single_key_or_none(track) if _is_constant_spline(track) else track
    return replace(kept, storage=INT16) if _fits_int16(kept) else kept


def _reduce(track: Track) -> Track:
    same = (track.values[1:] == track.values[:-1]).all(axis=1)  # equal to the previous key
    if track.interpolation is Interpolation.STEP:
        return _select_keys(track, np.concatenate(([True], ~same)), track.interpolation)
    before, after = np.concatenate(([True], same)), np.concatenate((same, [True]))
    keep = ~(before & after)
    if not keep.any():
        keep[0] = True
    return _select_keys(track, keep, track.interpolation)


def _select_keys(track: Track, keep: Bools, interpolation: Interpolation) -> Track:
    if keep.all() and interpolation is track.interpolation:
        return track
    return track.with_keys(track.times[keep], track.values[keep], interpolation=interpolation)


def _single_key_or_none(track: Track) -> Track:
    """One key for a constant spline; two if its rotation is not unit.

    Players normalize splines, but not all of them normalize single keys.
    """
    if (
        track.path != "rotation"
        or len(track.times) == 1
        or abs(float(np.linalg.norm(track.values[0])) - 1) < UNIT_LENGTH_TOLERANCE
    ):
        return _select_keys(track, np.arange(len(track.times)) == 0, Interpolation.LINEAR)
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    ends = [0, -1]
    return track.with_keys(track.times[ends], track.values[ends], track.in_tangents[ends], track.out_tangents[ends])


def _is_constant_spline(track: Track) -> bool:
    """Return whether a spline never leaves its first value."""
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    tangents = not track.in_tangents.any() and not track.out_tangents.any()
    return tangents and bool((track.values == track.values[0]).all())


def _fits_int16(track: Track) -> bool:
    if track.path != "rotation" or track.storage != FLOAT32 or track.interpolation is Interpolation.CUBICSPLINE:
        return False
    return len(track.values) > 1 and bool(are_exact_in_int16(track.values[None])[0])


def are_exact_in_int16(values: Floats) -> Bools:
    """Return which of the tracks' values (G, K, C) normalized int16 represents exactly (G,)."""
    fits = _are_exact(values[:, :1])  # hardly any track passes its first key
    fits[fits] = _are_exact(values[fits])
    return fits


def _are_exact(values: Floats) -> Bools:
    scaled = np.rint(values * 32767)
    return np.asarray(((np.abs(scaled) <= 32767) & (scaled / 32767 == values)).all(axis=(1, 2)))


def reduce_pointer_keys(track: Track, bound: float) -> Track:
    """Return a pointer track in fewer keys, with an error up to `bound` as a fraction of its range.

    Only LINEAR tracks are reduced; STEP and CUBICSPLINE keep every key that changes something.
    """
    extent = float(np.ptp(track.values, axis=0).max(initial=0.0))
    if bound <= 0 or extent == 0 or track.interpolation is not Interpolation.LINEAR or track.kind is ValueKind.DISCRETE:
        return reduce_lossless(track)
    if track.kind is ValueKind.ROTATION:
        extent = 1.0
    scaled = sample(track, track.times) / (POINTER_BOUND_FRACTION * bound * extent)
    keep = greedy_keys(scaled[None], track.times)[0]
    return reduce_lossless(track.with_keys(track.times[keep], track.values[keep]))

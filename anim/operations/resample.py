"""Resampling of clips on a uniform grid of keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from anim.arguments import check_flags
from anim.arrays import Floats
from anim.errors import RangeError
from anim.maths import quaternion
from anim.memory import MemoryBudget
from anim.model import Clip, Interpolation, TimeAxis, Track, ValueKind
from anim.operations.selection import track_indices
from anim.sampling import derivatives
from anim.sampling.batch import Batch
from anim.sampling.lazy_batch import lazy_batches
from anim.sampling.times import frame_times, key_times

KEEP = "keep"
BYTES_PER_VALUE = 8 * 8  # float64, arrays of intermediate results, and the file
UNIT_TOLERANCE = 1e-6  # of a squared length: error by rounding to float32
INTERPOLATIONS = (KEEP, "step", "linear", "cubicspline")


def resample(
    clip: Clip, *, fps: float, interpolation: str = KEEP, snap: bool = False, tracks: frozenset[int] | None = None
) -> Clip:
    """Return the clip with its tracks keyed at `fps` frames per second.

    Keys are at start + k / fps of the clip; the last key is the clip's end even if the duration is no multiple of
    1 / fps. A constant track, or one with a single key, is unchanged: more keys would be redundant.
    Rotations stay unit and sign-continuous; a rotation spline between distant keys is approximated closely but not
    exactly, since players normalize it and its new keys are unit. Morph weights and pointers are sampled likewise.

    fps: frames per second, > 0. Raises RangeError otherwise.
    interpolation: "keep", or "step", "linear", "cubicspline" for all tracks; bools and integers stay STEP.
    snap: move jumps of STEP tracks to the grid too; otherwise their key times are unchanged.
    tracks: indices of the tracks to resample, None for all.
    (keys 0, 1 s; fps 4) → keys 0, 0.25, 0.5, 0.75, 1 s
    """
    chosen = track_indices(clip, tracks)
    check_flags(snap=snap)
    if interpolation not in INTERPOLATIONS:
        raise RangeError(f"`interpolation` is '{interpolation}' (expected one of {', '.join(INTERPOLATIONS)})")
    axis = TimeAxis(key_times(frame_times(clip.start, clip.end, fps=fps)))
    goals = {i: _goal(clip.tracks[i], interpolation) for i in sorted(chosen) if _is_sampled(clip.tracks[i])}
    goals = {i: goal for i, goal in goals.items() if snap or not _holds(clip.tracks[i], goal)}
    _check_size(clip, goals, len(axis))
    values = _sample_tracks([clip.tracks[i] for i in goals], axis.times)
    new = [_keep_keys(t, _goal(t, interpolation)) if i in chosen else t for i, t in enumerate(clip.tracks)]
    for (i, goal), sampled in zip(goals.items(), values, strict=True):
        new[i] = _build_track(clip.tracks[i], goal, axis, sampled)
    return Clip(clip.name, tuple(new))


def _check_size(clip: Clip, goals: Mapping[int, Interpolation], keys: int) -> None:
    """Raise UnsupportedError for more values than the limit of memory allows, before any is computed."""
    budget = MemoryBudget(clip.num_bytes)
    parts = {goal: 3 if goal is Interpolation.CUBICSPLINE else 1 for goal in Interpolation}  # with tangents
    budget.add(BYTES_PER_VALUE * keys * sum(parts[goal] * clip.tracks[i].values.shape[1] for i, goal in goals.items()))


def _goal(track: Track, interpolation: str) -> Interpolation:
    if track.kind is ValueKind.DISCRETE:
        return Interpolation.STEP
    return track.interpolation if interpolation == KEEP else Interpolation(interpolation.upper())


def _keep_keys(track: Track, goal: Interpolation) -> Track:
    """A track with its keys unchanged, in the requested interpolation if that needs no tangents."""
    if goal is track.interpolation or goal is Interpolation.CUBICSPLINE or _is_sampled(track):
        return track
    return replace(track, interpolation=goal, in_tangents=None, out_tangents=None)


def _is_sampled(track: Track) -> bool:
    return len(track.times) > 1 and not _is_constant(track)


def _holds(track: Track, goal: Interpolation) -> bool:
    return goal is Interpolation.STEP and track.interpolation is Interpolation.STEP


def _is_constant(track: Track) -> bool:
    same = bool(np.count_nonzero(track.values == track.values[0]) == track.values.size)
    if track.in_tangents is None or track.out_tangents is None:
        return same
    return same and not track.in_tangents[1:].any() and not track.out_tangents[:-1].any()


def _sample_tracks(tracks: list[Track], times: Floats) -> list[Floats]:
    """Values (F, C) of each track at `times`, rotations sign-continuous; those of a time axis together."""
    found = [np.zeros(0)] * len(tracks)
    for batch in (part.whole for each in lazy_batches(tracks) for part in each.divide(len(times))):
        values = batch.sample(times)
        if batch.kind is ValueKind.ROTATION:
            values = quaternion.align_signs(_restore_unit_keys(batch, times, values))
        for g, index in enumerate(batch.numbers.tolist()):
            found[index] = values[:, g]
    return found


def _restore_unit_keys(batch: Batch, times: Floats, values: Floats) -> Floats:
    """Sampled rotations with unit keys restored bit for bit, since normalization changes the last bits."""
    at = np.minimum(np.searchsorted(batch.times, times), len(batch.times) - 1)
    own = batch.values[at]
    unit = np.abs(quaternion.dot(own, own) - 1) < UNIT_TOLERANCE
    exact = (batch.times[at] == times)[:, None] & unit
    return np.where(exact[..., None], own, values)


def _build_track(track: Track, goal: Interpolation, axis: TimeAxis, values: Floats) -> Track:
    tangents: tuple[Floats | None, Floats | None] = (None, None)
    if goal is Interpolation.CUBICSPLINE and len(axis) > 1:
        tangents = _tangents(track, axis.times, values)
    elif goal is Interpolation.CUBICSPLINE:
        goal = Interpolation.LINEAR
    return track.with_keys(axis, values, *tangents, interpolation=goal)


def _tangents(track: Track, times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Tangents of the new keys; an unchanged segment keeps its own, bit for bit."""
    before, after = derivatives.tangents(track, times, values)
    if track.in_tangents is None or track.out_tangents is None:
        return before, after
    at = np.minimum(np.searchsorted(track.times, times), len(track.times) - 1)
    same = track.times[at] == times
    whole = np.flatnonzero(same[:-1] & same[1:] & (np.diff(at) == 1))
    signs = (
        np.where(quaternion.dot(values, track.values[at]) < 0, -1.0, 1.0) if track.kind is ValueKind.ROTATION else 1.0
    )
    own = np.broadcast_to(np.asarray(signs), (len(times),))[:, None]
    after[whole] = (track.out_tangents[at] * own)[whole]
    before[whole + 1] = (track.in_tangents[at] * own)[whole + 1]
    return before, after

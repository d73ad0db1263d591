"""Parts of long clips: where they are cut, their keys, and the order in which they are searched."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.model import Clip, Interpolation, TimeAxis, Track
from anim.optimization.search import playback
from anim.optimization.search.source_analysis import source_keys

MAX_SHIFT = 0.2  # of a part's length, by which a cut is moved to a time at which more tracks have keys


def find_cuts(tracks: Sequence[Track], grid: Floats, length: int) -> Ints:
    """Return the indices (B + 1,) on the grid (K,) of possible key times between which parts of about `length` lie.

    Of the times near even ones, those at which most tracks have keys.
    """
    even = np.linspace(0, len(grid) - 1, -(-len(grid) // length) + 1).round().astype(np.int64)
    counts = source_keys(tracks, grid, is_part=False).sum(axis=0)
    shift = max(round(MAX_SHIFT * length), 1)
    cuts = even.copy()
    for n in range(1, len(even) - 1):
        near = np.arange(even[n] - shift, even[n] + shift + 1)
        best = near[counts[near] == counts[near].max()]
        cuts[n] = best[np.abs(best - even[n]).argmin()]
    return cuts


def chord_error_at(track: Track, times: Floats) -> float:
    """Return the largest distance between slerp and nlerp, in quaternion units, around those times that are no keys."""
    if track.path != "rotation" or track.interpolation is not Interpolation.LINEAR:
        return 0.0
    after = np.searchsorted(track.times, times)
    inside = (after > 0) & (after < len(track.times))
    after, times = after[inside], times[inside]
    after = after[track.times[after] != times]
    angles = quaternion.angle_between(track.values[after - 1], track.values[after])
    return float(playback.arc_distance(angles).max(initial=0.0)) / 2


def order_by_motion(tracks: Sequence[Track], times: Floats) -> list[int]:
    """Return the parts between `times` (B + 1,): the one with the most motion, then the others in order.

    Units of values are added up as they are: any part with much motion will do.
    """
    total = np.zeros(len(times) - 1)
    for track in tracks:
        steps = np.linalg.norm(np.diff(track.values, axis=0), axis=1)
        way = np.interp(times, track.times, np.append(0.0, np.cumsum(steps)))
        total += np.diff(way)
    most = int(total.argmax())
    return [most, *(n for n in range(len(total)) if n != most)]


def cut_clip(clip: Clip, start: float, end: float) -> Clip:
    """Return the clip with those keys only that count between two times."""
    axes: dict[TimeAxis, tuple[slice, TimeAxis]] = {}
    for axis in clip.time_axes:
        last = min(int(np.searchsorted(axis.times, end)), len(axis) - 1)
        first = min(max(int(np.searchsorted(axis.times, start, side="right")) - 1, 0), last)
        axes[axis] = slice(first, last + 1), TimeAxis(axis.times[first : last + 1])
    return Clip(clip.name, tuple(_select(track, *axes[track.time_axis]) for track in clip.tracks))


def _select(track: Track, keys: slice, axis: TimeAxis) -> Track:
    arriving, leaving = (None if each is None else each[keys] for each in (track.in_tangents, track.out_tangents))
    return Track.unchecked(
        track.node,
        track.path,
        track.interpolation,
        axis,
        track.values[keys],
        arriving,
        leaving,
        track.pointer,
        track.storage,
    )

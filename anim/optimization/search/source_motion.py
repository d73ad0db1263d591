"""Source motion of a clip: tracks on a grid of times, node matrices, and the moment arm of each track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints, unique_sorted
from anim.model import Interpolation, Track
from anim.model.time_axis import merge_times
from anim.optimization.search.answering_points import AnsweringPoints
from anim.sampling import times

CUBIC_STEP = 1 / 60  # s; sample step of splines, with at least CUBIC_SEGMENTS samples per segment
CUBIC_SEGMENTS = 8
MAX_CUBIC_SEGMENTS = 256  # of one segment; at least a quarter where all would be more than MAX_CUBIC_GRID
MAX_CUBIC_GRID = 16_384
PROBE_FRAMES = 64  # maximum number of times at which moment arms are measured
PATHS = ("translation", "rotation", "scale")
ROTATION = PATHS.index("rotation")


@dataclass(frozen=True, slots=True)
class SourceTrack:
    """One track of the search, with its source values.

    index: in its clip. values: (W, C) at the measurement times; rotations unit, signs continuous. rest: (C,), of
    rotations with the sign of the first value. middle: (C,), the constant with the smallest error. meters: approximate
    displacement of a point per unit of the value. from_rest, from_middle: m, largest error of rest and middle.
    closure: s if the last value is s times the first, else 0 (see `closure_signs`).
    """

    index: int
    node: int
    path: str
    values: Floats
    rest: Floats
    middle: Floats
    meters: float
    from_rest: float
    from_middle: float
    closure: float


@dataclass(frozen=True, slots=True)
class SourceMotion:
    """A clip at its measurement times.

    grid: (K,) s, possible key times. at: (W,) s, the grid and times between. on_grid: (K,) indices of the grid in `at`.
    moving: (G) tracks of the search. own: (G, K) mask of source keys, all for splines. answering: the points that the
    node of each track moves. local: translation (N, W, 3), rotation (N, W, 4), scale (N, W, 3) of all nodes. world:
    (N, W, 3, 4), of nodes with points and those above. chords: rotation (N, W, 4) with nlerp; None where it hardly
    differs. is_part: whether it is a part of a clip, whose first and last keys have the source's values.
    """

    grid: Floats
    at: Floats
    on_grid: Ints
    moving: tuple[SourceTrack, ...]
    own: Bools
    answering: AnsweringPoints
    local: tuple[Floats, Floats, Floats]
    world: Floats
    chords: Floats | None
    is_part: bool = False


def key_grid(tracks: Sequence[Track]) -> Floats:
    """Return all possible times of new keys (K,): the keys of all tracks, and samples of their splines."""
    axes = [merge_times(track.time_axis for track in tracks)]
    axes += [_spline_times(track.times) for track in tracks if track.interpolation is Interpolation.CUBICSPLINE]
    return times.key_times(np.concatenate(axes)) if tracks else np.zeros(1)


def measurement_times(grid: Floats, tracks: Sequence[Track]) -> Floats:
    """Return the times (W,) to measure at: the grid, its interval middles, and both sides of every jump."""
    jumps = [track.times for track in tracks if track.interpolation is Interpolation.STEP]
    jumps = [axis[(axis > grid[0]) & (axis < grid[-1])] for axis in jumps]
    before = [np.nextafter(axis, -np.inf) for axis in jumps]
    return unique_sorted(np.concatenate([grid, (grid[1:] + grid[:-1]) / 2, *jumps, *before]))


def _spline_times(axis: Floats) -> Floats:
    most = np.clip(MAX_CUBIC_GRID // max(len(axis) - 1, 1), MAX_CUBIC_SEGMENTS // 4, MAX_CUBIC_SEGMENTS)
    pieces = np.clip(np.ceil(np.diff(axis) / CUBIC_STEP), CUBIC_SEGMENTS, most).astype(np.int64)
    inner = [np.linspace(a, b, n + 1) for a, b, n in zip(axis[:-1], axis[1:], pieces.tolist(), strict=True)]
    return np.concatenate(inner) if inner else axis

"""Source motion of a clip: tracks on a grid of times, node matrices, and the moment arm of each track."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints, unique_sorted
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix, stack_points
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.model.time_axis import merge_times
from anim.optimization.options import Reference
from anim.optimization.search import playback
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.tracks.clip_ends import closure_sign
from anim.sampling import sample_pose, times
from anim.sampling.track import find_interval

CUBIC_STEP = 1 / 60  # s; sample step of splines, with at least CUBIC_SEGMENTS samples per segment
CUBIC_SEGMENTS = 8
MAX_CUBIC_SEGMENTS = 256
PROBE_FRAMES = 64  # maximum number of times at which moment arms are measured
PATHS = ("translation", "rotation", "scale")
ROTATION = PATHS.index("rotation")


@dataclass(frozen=True, slots=True)
class SourceTrack:
    """One track of the search, with its source values.

    index: in its clip. values: (W, C) at the measurement times; rotations unit, signs continuous. rest: (C,), of
    rotations with the sign of the first value. middle: (C,), the constant with the smallest error. meters: approximate
    displacement of a point per unit of the value. from_rest, from_middle: m, largest error of rest and middle.
    closure: s if the last value is s times the first, else 0 (see `closure_sign`).
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
    moving: (G) tracks of the search. own: (G, K) mask of source keys, all for splines. answering: (G, P) mask of the
    points that each track moves. local: translation (N, W, 3), rotation (N, W, 4), scale (N, W, 3) of all nodes.
    levels: of the nodes with points. columns: (4 J, 3 W) world matrices of the points' nodes; by_chord: the same with
    nlerp.
    """

    grid: Floats
    at: Floats
    on_grid: Ints
    moving: tuple[SourceTrack, ...]
    own: Bools
    answering: Bools
    local: tuple[Floats, Floats, Floats]
    levels: tuple[Ints, ...]
    columns: Floats
    by_chord: Floats


def analyze_source(
    skeleton: Skeleton,
    clip: Clip,
    free: Sequence[int],
    points: PointMatrix,
    below: Mapping[int, Bools],
    *,
    reference: Reference,
    chord_tolerance: float,
) -> SourceMotion:
    """Return the source motion of `clip` on `points`; only the tracks with indices in `free` may change.

    below: by index of a free track's node, mask (P,) of the points bound to it or its descendants. chord_tolerance: m;
    slerp and nlerp, or both ends of a track, count as equal if closer.
    """
    tracks = [clip.tracks[i] for i in free]
    grid = key_grid(tracks)
    at = grid if reference is Reference.KEYS else measurement_times(grid, clip.tracks)
    local = _local(skeleton, clip, at)
    levels = required_levels(skeleton, points.nodes)
    world = level_world_matrices(skeleton, local, levels)
    nodes = {track.node for track in tracks if track.node is not None}
    reach = _influence_radius(world, points, {node: below[node] for node in nodes})
    widening = _widening(skeleton, world, levels)
    moving = tuple(
        _source_track(number, track, skeleton, local, reach, widening, chord_tolerance)
        for number, track in zip(free, tracks, strict=True)
    )
    answering = np.array([below[each.node] for each in moving]).reshape(len(moving), len(points))
    columns = stack_points(world, points.nodes)
    by_chord = columns
    if any(
        each.path == "rotation" and each.meters * _max_chord_error(clip.tracks[each.index]) > chord_tolerance
        for each in moving
    ):
        by_chord = stack_points(level_world_matrices(skeleton, _nlerp_local(clip, at, local), levels), points.nodes)
    return SourceMotion(
        grid,
        at,
        np.searchsorted(at, grid),
        moving,
        np.array([_source_keys(track, grid) for track in tracks]).reshape(len(tracks), len(grid)),
        answering,
        local,
        levels,
        columns,
        by_chord,
    )


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
    pieces = np.clip(np.ceil(np.diff(axis) / CUBIC_STEP), CUBIC_SEGMENTS, MAX_CUBIC_SEGMENTS).astype(np.int64)
    inner = [np.linspace(a, b, n + 1) for a, b, n in zip(axis[:-1], axis[1:], pieces.tolist(), strict=True)]
    return np.concatenate(inner) if inner else axis


def _local(skeleton: Skeleton, clip: Clip, at: Floats) -> tuple[Floats, Floats, Floats]:
    shown = sample_pose(skeleton, clip, at)
    rotation = quaternion.align_signs(shown.rotation)
    parts = (np.ascontiguousarray(np.swapaxes(part, 0, 1)) for part in (shown.translation, rotation, shown.scale))
    translation, rotation, scale = parts
    return translation, rotation, scale


def _nlerp_local(clip: Clip, at: Floats, local: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """The same in players with component-wise interpolation."""
    rotation = local[1].copy()
    for track in clip.tracks:
        if track.path == "rotation" and track.interpolation is Interpolation.LINEAR and track.node is not None:
            keys = quaternion.normalize(track.values)[:, None]
            rotation[track.node] = playback.nlerp(keys, find_interval(track.times, at))[:, 0]
    return local[0], rotation, local[2]


def _max_chord_error(track: Track) -> float:
    """Largest distance between slerp and nlerp, in quaternion units."""
    if track.interpolation is not Interpolation.LINEAR or len(track.times) < 2:
        return 0.0
    return float(playback.arc_distance(playback.steps(track.values).max())) / 2


def _source_keys(track: Track, grid: Floats) -> Bools:
    """Mask of the grid (K,) at the track's keys; all for splines."""
    if track.interpolation is Interpolation.CUBICSPLINE:
        return np.ones(len(grid), np.bool_)
    keys = times.key_times(track.times)
    keys = keys[(keys >= grid[0]) & (keys <= grid[-1])]
    found = np.zeros(len(grid), np.bool_)
    at = np.searchsorted(grid, keys)
    found[at[grid[at] == keys]] = True
    return found


def _source_track(
    number: int,
    track: Track,
    skeleton: Skeleton,
    local: tuple[Floats, Floats, Floats],
    reach: dict[int, float],
    widening: Floats,
    chord_tolerance: float,
) -> SourceTrack:
    node = track.node
    assert node is not None
    values = local[PATHS.index(track.path)][node]
    rest = getattr(skeleton, track.path)[node]
    middle = (values.min(axis=0) + values.max(axis=0)) / 2
    if track.path == "rotation":
        rest = np.where(values[0] @ rest < 0, -rest, rest)
        middle = quaternion.normalize(middle) if np.abs(middle).max() > 1e-6 else values[0]
        meters = 2 * reach[node]
    elif track.path == "translation":
        meters = widening[node]
    else:
        meters = reach[node] / max(float(np.abs(values).min()), 1e-6)
    from_rest, from_middle = (float(np.linalg.norm(values - each, axis=1).max() * meters) for each in (rest, middle))
    closure = closure_sign(values, chord_tolerance / meters if meters else 0.0)
    return SourceTrack(number, node, track.path, values, rest, middle, float(meters), from_rest, from_middle, closure)


def _influence_radius(world: Floats, points: PointMatrix, answering: dict[int, Bools]) -> dict[int, float]:
    """For each node, the largest distance of the points it moves, in metres."""
    frames = world[:, :: max(1, -(-world.shape[1] // PROBE_FRAMES))]
    places = points.places(frames)
    found = {}
    for node, mine in answering.items():
        away = places[mine] - frames[node][None, :, :, 3]
        found[node] = float(np.sqrt((away * away).sum(axis=-1)).max(initial=0.0))
    return found


def _widening(skeleton: Skeleton, world: Floats, levels: Sequence[Ints]) -> Floats:
    """For each node (N,), the largest world length, in metres, of one unit of its parent's space.

    0 without points.
    """
    needed = np.concatenate(levels)
    lengths = np.zeros(len(skeleton))
    lengths[needed] = np.sqrt((world[needed, ..., :3] ** 2).sum(axis=-2)).max(axis=(1, 2), initial=0.0)
    widening = np.where(skeleton.parents < 0, 1.0, lengths[skeleton.parents])
    counted = np.zeros(len(skeleton))
    counted[needed] = widening[needed]
    return counted

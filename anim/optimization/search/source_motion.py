"""What one clip really does: its tracks on a grid of times, where that puts every node, and how far a change of each
track can carry a measured point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints, unique_sorted
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix, stack_points
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.optimization.options import Reference
from anim.optimization.search import playback
from anim.optimization.search.world_matrices import level_world_matrices, required_levels
from anim.optimization.tracks.loop_closure import closure_sign
from anim.sampling import sample_pose, times
from anim.sampling.track import find_interval

CUBIC_STEP = 1 / 60  # s; a spline is looked at this often, and CUBIC_PIECES times a piece at least
CUBIC_SEGMENTS = 8
MAX_CUBIC_SEGMENTS = 256
PROBE_FRAMES = 64  # at most so many moments at which levers are measured
PATHS = ("translation", "rotation", "scale")
ROTATION = PATHS.index("rotation")


@dataclass(frozen=True, slots=True)
class SourceTrack:
    """One track that a search may change, as it truly runs.

    number: in its clip. values: (W, C) at the times to measure at; rotations unit, without jumps of sign. rest: (C,),
    for rotations on the side of the first value. middle: (C,), the single value that fits best. meters: how far a
    point moves per unit of the value, about. from_rest, from_middle: m, how far rest and middle are off, at most.
    closure: s where the last value is s times the first, 0 where it is another (see `closure`).
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
    """A clip on the times where it is measured.

    grid: (K,) s, where keys may lie. at: (W,) s, the grid and what lies between. on_grid: (K,) the grid within `at`.
    moving: (G) tracks that may change. own: (G, K) which keys the source has for each, or has on its spline.
    answering: (G, P) which points answer for each.
    local: translation (N, W, 3), rotation (N, W, 4), scale (N, W, 3) of all nodes. levels: of the nodes that count.
    columns: (4 J, 3 W) world matrices of the points' nodes; by_chord: the same where rotations run along chords.
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
    noticed: float,
) -> SourceMotion:
    """Return what `clip` does to `points`; the tracks numbered in `free` may change, all others stay as they are.

    below: by node of a free track, which points (P,) hang on it. noticed: m; where chords and arcs, or both ends of a
    track, are closer than this they count as one.
    """
    tracks = [clip.tracks[i] for i in free]
    grid = key_grid(tracks)
    at = grid if reference is Reference.KEYS else moments(grid, clip.tracks)
    local = _local(skeleton, clip, at)
    levels = required_levels(skeleton, points.nodes)
    world = level_world_matrices(skeleton, local, levels)
    nodes = {track.node for track in tracks if track.node is not None}
    reach = _influence_radius(world, points, {node: below[node] for node in nodes})
    widening = _widening(skeleton, world, levels)
    moving = tuple(
        _moving(number, track, skeleton, local, reach, widening, noticed)
        for number, track in zip(free, tracks, strict=True)
    )
    answering = np.array([below[each.node] for each in moving]).reshape(len(moving), len(points))
    columns = stack_points(world, points.nodes)
    by_chord = columns
    if any(
        each.path == "rotation" and each.meters * _mean_interval(clip.tracks[each.index]) > noticed for each in moving
    ):
        by_chord = stack_points(level_world_matrices(skeleton, _by_chords(clip, at, local), levels), points.nodes)
    return SourceMotion(
        grid,
        at,
        np.searchsorted(at, grid),
        moving,
        np.array([_own(track, grid) for track in tracks]).reshape(len(tracks), len(grid)),
        answering,
        local,
        levels,
        columns,
        by_chord,
    )


def key_grid(tracks: Sequence[Track]) -> Floats:
    """Return every time (K,) at which a new key may lie: the keys of all tracks, and points on their splines."""
    axes = [track.times for track in {id(track.times): track for track in tracks}.values()]
    axes += [_on_splines(track.times) for track in tracks if track.interpolation is Interpolation.CUBICSPLINE]
    return times.key_times(np.concatenate(axes)) if axes else np.zeros(1)


def moments(grid: Floats, tracks: Sequence[Track]) -> Floats:
    """Return the times (W,) to measure at: the grid, the middle of its gaps, and both sides of every jump."""
    jumps = [track.times for track in tracks if track.interpolation is Interpolation.STEP]
    jumps = [axis[(axis > grid[0]) & (axis < grid[-1])] for axis in jumps]
    before = [np.nextafter(axis, -np.inf) for axis in jumps]
    return unique_sorted(np.concatenate([grid, (grid[1:] + grid[:-1]) / 2, *jumps, *before]))


def _on_splines(axis: Floats) -> Floats:
    pieces = np.clip(np.ceil(np.diff(axis) / CUBIC_STEP), CUBIC_SEGMENTS, MAX_CUBIC_SEGMENTS).astype(np.int64)
    inner = [np.linspace(a, b, n + 1) for a, b, n in zip(axis[:-1], axis[1:], pieces.tolist(), strict=True)]
    return np.concatenate(inner) if inner else axis


def _local(skeleton: Skeleton, clip: Clip, at: Floats) -> tuple[Floats, Floats, Floats]:
    shown = sample_pose(skeleton, clip, at)
    rotation = quaternion.align_signs(shown.rotation)
    parts = (np.ascontiguousarray(np.swapaxes(part, 0, 1)) for part in (shown.translation, rotation, shown.scale))
    translation, rotation, scale = parts
    return translation, rotation, scale


def _by_chords(clip: Clip, at: Floats, local: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """The same, as players show it that mix quaternions by components."""
    rotation = local[1].copy()
    for track in clip.tracks:
        if track.path == "rotation" and track.interpolation is Interpolation.LINEAR and track.node is not None:
            keys = quaternion.normalize(track.values)[:, None]
            rotation[track.node] = playback.nlerp(keys, find_interval(track.times, at))[:, 0]
    return local[0], rotation, local[2]


def _mean_interval(track: Track) -> float:
    """How far chord and arc are apart, as quaternions."""
    if track.interpolation is not Interpolation.LINEAR or len(track.times) < 2:
        return 0.0
    return float(playback.arc_distance(playback.steps(track.values).max())) / 2


def _own(track: Track, grid: Floats) -> Bools:
    """Which times of the grid (K,) are keys of the track; all of them for splines."""
    if track.interpolation is Interpolation.CUBICSPLINE:
        return np.ones(len(grid), np.bool_)
    return np.asarray(np.isin(grid, times.key_times(track.times)))


def _moving(
    number: int,
    track: Track,
    skeleton: Skeleton,
    local: tuple[Floats, Floats, Floats],
    reach: dict[int, float],
    widening: Floats,
    noticed: float,
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
    closure = closure_sign(values, noticed / meters if meters else 0.0)
    return SourceTrack(number, node, track.path, values, rest, middle, float(meters), from_rest, from_middle, closure)


def _influence_radius(world: Floats, points: PointMatrix, answering: dict[int, Bools]) -> dict[int, float]:
    """For each node, how far the points that answer for it are from it at most, times what it carries of them."""
    frames = world[:, :: max(1, -(-world.shape[1] // PROBE_FRAMES))]
    places = points.places(frames)
    found = {}
    for node, mine in answering.items():
        away = places[mine] - frames[node][None, :, :, 3]
        found[node] = float(np.sqrt((away * away).sum(axis=-1)).max(initial=0.0))
    return found


def _widening(skeleton: Skeleton, world: Floats, levels: Sequence[Ints]) -> Floats:
    """For each node (N,), how many metres of the world one unit of its parent's space is at most; 0 where no point
    hangs on it."""
    needed = np.concatenate(levels)
    lengths = np.zeros(len(skeleton))
    lengths[needed] = np.sqrt((world[needed, ..., :3] ** 2).sum(axis=-2)).max(axis=(1, 2), initial=0.0)
    widening = np.where(skeleton.parents < 0, 1.0, lengths[skeleton.parents])
    counted = np.zeros(len(skeleton))
    counted[needed] = widening[needed]
    return counted

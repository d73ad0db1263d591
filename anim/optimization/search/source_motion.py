"""Source motion of a clip: tracks on a grid of times, node matrices, and the moment arm of each track."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints, unique_sorted
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.model.time_axis import merge_times
from anim.optimization.options import Reference
from anim.optimization.search import playback
from anim.optimization.search.answering_points import AnsweringPoints
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.tracks.clip_ends import closure_signs
from anim.sampling import PoseSampler, times
from anim.sampling.players import sampler

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
    differs.
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


def analyze_source(
    skeleton: Skeleton,
    clip: Clip,
    free: Sequence[int],
    points: PointMatrix,
    answering: AnsweringPoints,
    *,
    reference: Reference,
    chord_tolerance: float,
) -> SourceMotion:
    """Return the source motion of `clip` on `points`; only the tracks with indices in `free` may change.

    answering: the points bound to a node or its descendants. chord_tolerance: m; slerp and nlerp, or both ends of a
    track, count as equal if closer.
    """
    tracks = [clip.tracks[i] for i in free]
    grid = key_grid(tracks)
    at = grid if reference is Reference.KEYS else measurement_times(grid, clip.tracks)
    poses = PoseSampler(skeleton, clip)
    local = _local(poses, at)
    levels = required_levels(skeleton, points.nodes)
    world = level_world_matrices(skeleton, local, levels)
    nodes = {track.node for track in tracks if track.node is not None}
    reach = _influence_radius(world, points, answering, nodes)
    moving = _source_tracks(clip, free, skeleton, local, reach, _widening(skeleton, world, levels), chord_tolerance)
    is_bent = any(
        each.path == "rotation" and each.meters * _max_chord_error(clip.tracks[each.index]) > chord_tolerance
        for each in moving
    )
    return SourceMotion(
        grid,
        at,
        np.searchsorted(at, grid),
        moving,
        _source_keys(tracks, grid),
        answering,
        local,
        world,
        _chords(poses, at) if is_bent else None,
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
    most = np.clip(MAX_CUBIC_GRID // max(len(axis) - 1, 1), MAX_CUBIC_SEGMENTS // 4, MAX_CUBIC_SEGMENTS)
    pieces = np.clip(np.ceil(np.diff(axis) / CUBIC_STEP), CUBIC_SEGMENTS, most).astype(np.int64)
    inner = [np.linspace(a, b, n + 1) for a, b, n in zip(axis[:-1], axis[1:], pieces.tolist(), strict=True)]
    return np.concatenate(inner) if inner else axis


def _local(poses: PoseSampler, at: Floats) -> tuple[Floats, Floats, Floats]:
    shown = poses.at(at)
    rotation = _by_node(quaternion.align_signs(shown.rotation))
    return _by_node(shown.translation), rotation, _by_node(shown.scale)


def _by_node(values: Floats) -> Floats:
    """Values (N, W, C) from (W, N, C), a view of (C, N, W): each component is contiguous over the times."""
    return np.moveaxis(np.ascontiguousarray(np.transpose(values, (2, 1, 0))), 0, 2)


def _chords(poses: PoseSampler, at: Floats) -> Floats:
    """Rotations (N, W, 4) in players with component-wise interpolation."""
    return _by_node(poses.sampled(sampler("nlerp")).at(at).rotation)


def _max_chord_error(track: Track) -> float:
    """Largest distance between slerp and nlerp, in quaternion units."""
    if track.interpolation is not Interpolation.LINEAR or len(track.times) < 2:
        return 0.0
    return float(playback.arc_distance(playback.steps(track.values).max())) / 2


def _source_keys(tracks: Sequence[Track], grid: Floats) -> Bools:
    """Mask (G, K) of the grid (K,) at the keys of G tracks; all for splines."""
    found = np.zeros((len(tracks), len(grid)), np.bool_)
    for i, track in enumerate(tracks):
        found[i] = track.interpolation is Interpolation.CUBICSPLINE
    counts = [len(track.times) for track in tracks]
    if counts:
        keys = np.concatenate([track.times for track in tracks]).astype(np.float32).astype(np.float64)
        at = np.minimum(np.searchsorted(grid, keys), len(grid) - 1)
        on_grid = grid[at] == keys
        found[np.repeat(np.arange(len(tracks)), counts)[on_grid], at[on_grid]] = True
    return found


def _source_tracks(
    clip: Clip,
    free: Sequence[int],
    skeleton: Skeleton,
    local: tuple[Floats, Floats, Floats],
    reach: dict[int, float],
    widening: Floats,
    chord_tolerance: float,
) -> tuple[SourceTrack, ...]:
    """The tracks with indices in `free`, in that order; those of one path are computed together."""
    found: dict[int, SourceTrack] = {}
    for path, every in zip(PATHS, local, strict=True):
        numbers = [i for i in free if clip.tracks[i].path == path]
        nodes = [node for i in numbers if (node := clip.tracks[i].node) is not None]
        values, rest = every[nodes], getattr(skeleton, path)[nodes]  # (G, W, C), (G, C)
        middle = (values.min(axis=1) + values.max(axis=1)) / 2
        meters = np.array([reach[node] for node in nodes])
        if path == "rotation":
            rest = np.where(quaternion.dot(values[:, 0], rest)[:, None] < 0, -rest, rest)
            known = np.abs(middle).max(axis=1) > 1e-6
            middle = np.where(known[:, None], middle, values[:, 0])
            middle[known] = quaternion.normalize(middle[known])
            meters = 2 * meters
        elif path == "translation":
            meters = widening[nodes]
        else:
            meters = meters / np.maximum(np.abs(values).min(axis=(1, 2)), 1e-6)
        from_rest, from_middle = (np.sqrt(farthest(values, each)) * meters for each in (rest, middle))
        signs = closure_signs(values, np.where(meters > 0, chord_tolerance / np.where(meters > 0, meters, 1.0), 0.0))
        numbers_of = zip(meters.tolist(), from_rest.tolist(), from_middle.tolist(), signs.tolist(), strict=True)
        for k, (number, node, given) in enumerate(zip(numbers, nodes, numbers_of, strict=True)):
            found[number] = SourceTrack(number, node, path, every[node], rest[k], middle[k], *given)
    return tuple(found[i] for i in free)


def farthest(values: Floats, points: Floats) -> Floats:
    """Return the largest squared distance (G,) of values (G, W, C) from one point each (G, C)."""
    apart = values - points[:, None]
    return np.asarray(np.einsum("gwc,gwc->gw", apart, apart).max(axis=1, initial=0.0))


def _influence_radius(
    world: Floats, points: PointMatrix, answering: AnsweringPoints, nodes: Set[int]
) -> dict[int, float]:
    """For each node, the largest distance of the points it moves, in metres."""
    frames = world[:, :: max(1, -(-world.shape[1] // PROBE_FRAMES))]
    places = np.swapaxes(points.places(frames), 1, 2)  # (P, 3, F)
    chosen = sorted(nodes)
    centers = np.swapaxes(frames[chosen, :, :, 3], 1, 2)
    return dict(zip(chosen, answering.radii(places, chosen, centers).tolist(), strict=True))


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

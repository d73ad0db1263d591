"""Analysis of several clips for the search: their source motions, computed in the same arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.error.point_rows import stack_points
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.optimization.options import Reference
from anim.optimization.search import playback
from anim.optimization.search.answering_points import AnsweringPoints
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.search.source_motion import (
    PATHS,
    PROBE_FRAMES,
    ROTATION,
    SourceMotion,
    SourceTrack,
    key_grid,
    measurement_times,
)
from anim.optimization.tracks.clip_ends import closure_signs
from anim.sampling.clips import sample_transforms
from anim.sampling.players import sampler

BLOCK_KEYS = 1 << 19  # whose places on a grid are looked up at a time, in 20 MB


class FreeTracks(NamedTuple):
    """A clip to analyze: only the tracks with indices in `free` may change.

    chord_tolerance: m; slerp and nlerp, or both ends of a track, count as equal if closer. grid: (K,) s, possible key
    times of a part of the clip; None for those of all of it.
    """

    clip: Clip
    free: Sequence[int]
    chord_tolerance: float
    grid: Floats | None = None


class _Transforms(NamedTuple):
    """Local transforms of all nodes in B clips, (C, N, B, W); a shorter clip repeats its last time.

    lengths: times of each clip.
    """

    parts: tuple[Floats, Floats, Floats]
    lengths: list[int]

    def of_clip(self, clip: int) -> tuple[Floats, Floats, Floats]:
        """Return those of a clip at its times (N, W', C)."""
        translation, rotation, scale = (_by_time(part, clip, self.lengths[clip]) for part in self.parts)
        return translation, rotation, scale


def analyze_sources(
    skeleton: Skeleton,
    asked: Sequence[FreeTracks],
    points: PointMatrix,
    answering: AnsweringPoints,
    *,
    reference: Reference,
) -> list[SourceMotion]:
    """Return the source motion of each clip on `points`.

    answering: the points bound to a node or its descendants.
    """
    clips = [each.clip for each in asked]
    grids = [key_grid(_tracks_of(each)) if each.grid is None else each.grid for each in asked]
    is_keys = reference is Reference.KEYS
    ats = [grid if is_keys else measurement_times(grid, clip.tracks) for grid, clip in zip(grids, clips, strict=True)]
    times = _padded(ats)
    local = _Transforms(_sample(skeleton, clips, times), [len(at) for at in ats])
    levels = required_levels(skeleton, points.nodes)
    world = _world(skeleton, local, levels)  # (N, B, W, 3, 4)
    arms = _moment_arms(skeleton, asked, local, world, levels, points, answering)
    moving = _source_tracks(skeleton, asked, local, arms)
    bent = [n for n, each in enumerate(asked) if _is_bent(each, moving[n])]
    chords = _sample_chords(skeleton, [clips[n] for n in bent], times[bent])
    rotations = {n: _chords(asked[n], _by_time(chords, k, len(ats[n])), local.of_clip(n)) for k, n in enumerate(bent)}
    return [
        SourceMotion(
            grids[n],
            ats[n],
            np.searchsorted(ats[n], grids[n]),
            moving[n],
            source_keys(_tracks_of(each), grids[n], is_part=each.grid is not None),
            answering,
            local.of_clip(n),
            world[:, n, : len(ats[n])],
            rotations.get(n),
            is_part=each.grid is not None,
        )
        for n, each in enumerate(asked)
    ]


def _tracks_of(asked: FreeTracks) -> list[Track]:
    return [asked.clip.tracks[i] for i in asked.free]


def _padded(ats: Sequence[Floats]) -> Floats:
    """Times (B, W) of all clips, the last one of each repeated."""
    count = max(map(len, ats))
    return np.stack([at[np.minimum(np.arange(count), len(at) - 1)] for at in ats])


def _by_time(part: Floats, clip: int, length: int) -> Floats:
    """Values (N, W', C) of a clip, from those of all clips (C, N, B, W)."""
    return np.moveaxis(part[:, :, clip, :length], 0, 2)


def _sample(skeleton: Skeleton, clips: Sequence[Clip], times: Floats) -> tuple[Floats, Floats, Floats]:
    translation, rotation, scale = (sample_transforms(skeleton, clips, times, path) for path in PATHS)
    return translation, _with_continuous_signs(rotation), scale


def _sample_chords(skeleton: Skeleton, clips: Sequence[Clip], times: Floats) -> Floats:
    """Rotations (4, N, B, W) in players with component-wise interpolation."""
    if not clips:
        return np.empty((4, len(skeleton), 0, 0))
    return sample_transforms(skeleton, clips, times, PATHS[ROTATION], sampler("nlerp"))


def _chords(asked: FreeTracks, chords: Floats, local: tuple[Floats, Floats, Floats]) -> Floats:
    """Rotations (N, W, 4) with nlerp of the nodes with free tracks only: trials play the others as in `local`."""
    nodes = [track.node for track in _tracks_of(asked) if track.path == "rotation" and track.node is not None]
    found = local[ROTATION].copy()
    found[nodes] = chords[nodes]
    return found


def _with_continuous_signs(rotation: Floats) -> Floats:
    """Rotations (4, N, B, W), written over, with neighbors in time in one hemisphere."""
    turns = np.where(playback.dot(rotation[..., 1:], rotation[..., :-1]) < 0, -1.0, 1.0)
    if (turns < 0).any():
        rotation[..., 1:] *= np.cumprod(turns, axis=-1)
    return rotation


def _world(skeleton: Skeleton, local: _Transforms, levels: Sequence[Ints]) -> Floats:
    """World matrices (N, B, W, 3, 4)."""
    shape = local.parts[0].shape[1:]
    flat = [np.moveaxis(part.reshape(len(part), shape[0], -1), 0, 2) for part in local.parts]
    found: Floats = level_world_matrices(skeleton, flat, levels)
    columns = np.swapaxes(found, 1, 3)  # contiguous over times, as computed
    return np.moveaxis(columns.reshape(*columns.shape[:3], *shape[1:]), (3, 4, 2, 1), (1, 2, 3, 4))


def _is_bent(asked: FreeTracks, moving: Sequence[SourceTrack]) -> bool:
    """Return whether players with component-wise interpolation show another motion."""
    return any(
        each.path == "rotation"
        and each.meters * _max_chord_error(asked.clip.tracks[each.index]) > asked.chord_tolerance
        for each in moving
    )


def _max_chord_error(track: Track) -> float:
    """Largest distance between slerp and nlerp, in quaternion units."""
    if track.interpolation is not Interpolation.LINEAR or len(track.times) < 2:
        return 0.0
    return float(playback.arc_distance(playback.steps(track.values).max())) / 2


def source_keys(tracks: Sequence[Track], grid: Floats, *, is_part: bool) -> Bools:
    """Return the mask (G, K) of the grid (K,) at the keys of G tracks; all for splines, and both ends of a part."""
    found = np.zeros((len(tracks), len(grid)), np.bool_)
    for i, track in enumerate(tracks):
        found[i] = track.interpolation is Interpolation.CUBICSPLINE
    counts = np.array([len(track.times) for track in tracks], np.int64)
    blocks = np.cumsum(counts) // BLOCK_KEYS
    for some in np.split(np.arange(len(tracks)), np.flatnonzero(np.diff(blocks)) + 1) if len(tracks) else ():
        keys = np.concatenate([tracks[i].times for i in some.tolist()]).astype(np.float32).astype(np.float64)
        at = np.minimum(np.searchsorted(grid, keys), len(grid) - 1)
        on_grid = grid[at] == keys
        found[np.repeat(some, counts[some])[on_grid], at[on_grid]] = True
    if is_part:
        found[:, [0, -1]] = True
    return found


class _Arms(NamedTuple):
    """Moment arms in each clip: radius (B, N), the largest distance of the points a node moves, in m.

    widening: (B, N), the largest world length, in m, of one unit of a node's parent's space; 0 without points.
    """

    radius: Floats
    widening: Floats


def _moment_arms(
    skeleton: Skeleton,
    asked: Sequence[FreeTracks],
    local: _Transforms,
    world: Floats,
    levels: Sequence[Ints],
    points: PointMatrix,
    answering: AnsweringPoints,
) -> _Arms:
    radius, rows = np.zeros((len(asked), len(skeleton))), points.rows()
    for n, each in enumerate(asked):
        length = local.lengths[n]
        frames = world[:, n, : length : max(1, -(-length // PROBE_FRAMES))]
        nodes = sorted({track.node for track in _tracks_of(each) if track.node is not None})
        places = rows.moves(stack_points(frames, points.nodes))  # (P, 3, F), in float32: moment arms only weigh budgets
        centers = np.swapaxes(frames[nodes, :, :, 3], 1, 2).astype(np.float32)
        radius[n, nodes] = answering.radii(places, nodes, centers)
    return _Arms(radius, _widening(skeleton, world, np.concatenate(levels)))


def _widening(skeleton: Skeleton, world: Floats, needed: Ints) -> Floats:
    """For each clip and node (B, N), the largest world length of one unit of its parent's space.

    needed: nodes with points below.
    """
    lengths = np.zeros((world.shape[1], len(skeleton)))
    lengths[:, needed] = np.sqrt((world[needed, ..., :3] ** 2).sum(axis=-2)).max(axis=(2, 3), initial=0.0).T
    widening = np.where(skeleton.parents < 0, 1.0, lengths[:, skeleton.parents])
    counted = np.zeros_like(widening)
    counted[:, needed] = widening[:, needed]
    return counted


def _source_tracks(
    skeleton: Skeleton, asked: Sequence[FreeTracks], local: _Transforms, arms: _Arms
) -> list[tuple[SourceTrack, ...]]:
    """The free tracks of each clip, in their order; those of one path are computed together."""
    found: list[dict[int, SourceTrack]] = [{} for _ in asked]
    tolerances = np.array([each.chord_tolerance for each in asked])
    for path, every in zip(PATHS, local.parts, strict=True):
        free = [(n, i, each.clip.tracks[i]) for n, each in enumerate(asked) for i in each.free]
        some = [(n, i, track.node) for n, i, track in free if track.path == path and track.node is not None]
        clip, nodes = (np.array([each[k] for each in some], np.int64) for k in (0, 2))
        values, rest = np.moveaxis(every[:, nodes, clip], 0, 2), getattr(skeleton, path)[nodes]  # (T, W, C), (T, C)
        middle = (values.min(axis=1) + values.max(axis=1)) / 2
        meters = arms.radius[clip, nodes]
        if path == "rotation":
            rest = np.where(quaternion.dot(values[:, 0], rest)[:, None] < 0, -rest, rest)
            known = np.abs(middle).max(axis=1) > 1e-6
            middle = np.where(known[:, None], middle, values[:, 0])
            middle[known] = quaternion.normalize(middle[known])
            meters = 2 * meters
        elif path == "translation":
            meters = arms.widening[clip, nodes]
        else:
            meters = meters / np.maximum(np.abs(values).min(axis=(1, 2)), 1e-6)
        from_rest, from_middle = (np.sqrt(farthest(values, each)) * meters for each in (rest, middle))
        is_carrying = meters > 0
        signs = closure_signs(values, np.where(is_carrying, tolerances[clip] / np.where(is_carrying, meters, 1.0), 0.0))
        signs[[asked[n].grid is not None for n in clip.tolist()]] = 0.0  # ends of parts keep their values
        numbers = zip(meters.tolist(), from_rest.tolist(), from_middle.tolist(), signs.tolist(), strict=True)
        for k, ((n, i, node), given) in enumerate(zip(some, numbers, strict=True)):
            shown = every[:, node, n, : local.lengths[n]].T
            found[n][i] = SourceTrack(i, node, path, shown, rest[k], middle[k], *given)
    return [tuple(tracks[i] for i in each.free) for tracks, each in zip(found, asked, strict=True)]


def farthest(values: Floats, points: Floats) -> Floats:
    """Return the largest squared distance (G,) of values (G, W, C) from one point each (G, C)."""
    apart = values - points[:, None]
    return np.asarray(np.einsum("gwc,gwc->gw", apart, apart).max(axis=1, initial=0.0))

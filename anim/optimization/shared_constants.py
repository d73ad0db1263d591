"""Constants common to all clips, found before any search: properties at rest, and shared values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track
from anim.optimization.search.context import Context
from anim.optimization.search.source_motion import PATHS
from anim.optimization.tracks import morph_weights

CONSTANT_TOLERANCE = 0.5  # of the bound: a track this close to a value may become that constant
REST_TOLERANCE = 1e-4  # of the bound: a track this close to rest needs no search
MAX_STACKED_KEYS = 200_000  # of tracks whose distances from rest are computed in one call

Target = tuple[int, str]


@dataclass(frozen=True, slots=True)
class Constants:
    """Constants of all clips.

    unused: properties at rest in all clips. values: by property, constants of its tracks, the most frequent first.
    from_rest: for each clip, distance (T,) m of its tracks from rest; inf for weights and pointers.
    """

    unused: frozenset[Target]
    values: dict[Target, tuple[Floats, ...]]
    from_rest: tuple[Floats, ...]

    def at_rest(self, clip: int, max_error: float) -> tuple[bool, ...]:
        """Return whether each track of a clip stays at rest, with an error that is small next to `max_error` m."""
        return tuple((self.from_rest[clip] <= REST_TOLERANCE * max_error).tolist())


def find_constants(context: Context, clips: Sequence[Clip]) -> Constants:
    """Return the constants of all clips; distances use the rest pose's moment arms."""
    animated = {track.node for clip in clips for track in clip.tracks if track.node is not None}
    meters = _meters_per_unit(context, animated)
    moved: set[Target] = set()
    seen: set[Target] = set()
    values: dict[Target, list[_Value]] = {}
    bound = CONSTANT_TOLERANCE * context.bounds.max_error
    tracks = [track for clip in clips for track in clip.tracks]
    from_rest, spread = _distances(context, tracks, meters, bound)
    for track, distance, spread_m in zip(tracks, from_rest.tolist(), spread.tolist(), strict=True):
        if track.node is None or track.path == "pointer":
            continue
        target = (track.node, track.path)
        seen.add(target)
        if track.path == "weights":
            if not _weights_rest(context, track, bound):
                moved.add(target)
        elif distance > bound:
            moved.add(target)
            if spread_m <= 2 * bound:  # else too far apart for any constant
                unit = meters[PATHS.index(track.path)][track.node]
                _count_constant(values.setdefault(target, []), track, unit, bound)
    chosen = {
        target: tuple(each.value for each in sorted(found, key=lambda each: -each.clips))
        for target, found in values.items()
    }
    ends = np.cumsum([len(clip.tracks) for clip in clips]).tolist()
    per_clip = tuple(from_rest[end - len(clip.tracks) : end] for clip, end in zip(clips, ends, strict=True))
    return Constants(frozenset(seen - moved), chosen, per_clip)


def _distances(
    context: Context, tracks: Sequence[Track], meters: tuple[Floats, Floats, Floats], bound: float
) -> tuple[Floats, Floats]:
    """Largest distances (T,) m of each track's keys: from rest, and from its first key where that is above `bound`.

    inf for splines that move, and for other tracks than of nodes.
    """
    from_rest, spread, units = np.full(len(tracks), np.inf), np.full(len(tracks), np.inf), np.zeros(len(tracks))
    for number, path in enumerate(PATHS):
        mine = [i for i, track in enumerate(tracks) if track.path == path and not _has_tangents(track)]
        rest = getattr(context.skeleton, path)
        for some in _by_keys(mine, tracks):
            nodes = np.array([tracks[i].node for i in some])
            units[some] = meters[number][nodes]
            from_rest[some] = units[some] * _farthest([tracks[i] for i in some], rest[nodes])
        for some in _by_keys([i for i in mine if from_rest[i] > bound], tracks):
            moving = [tracks[i] for i in some]
            spread[some] = units[some] * _farthest(moving, np.array([track.values[0] for track in moving]))
    return from_rest, spread


def _farthest(tracks: Sequence[Track], origins: Floats) -> Floats:
    """Largest distance (T,) of the keys of each track from a value of its own (T, C), in its units; of one path."""
    counts = [len(track.values) for track in tracks]
    values, origin = np.concatenate([track.values for track in tracks]), np.repeat(origins, counts, axis=0)
    apart = np.linalg.norm(values - origin, axis=1)
    if tracks[0].path == "rotation":
        apart = np.minimum(apart, np.linalg.norm(values + origin, axis=1))
    farthest: Floats = np.maximum.reduceat(apart, np.cumsum([0, *counts[:-1]]))
    return farthest


def _by_keys(numbers: Sequence[int], tracks: Sequence[Track]) -> Iterator[list[int]]:
    """Yield the indices in groups of tracks with up to MAX_STACKED_KEYS keys, or one track."""
    some: list[int] = []
    keys = 0
    for i in numbers:
        keys += len(tracks[i].values)
        if some and keys > MAX_STACKED_KEYS:
            yield some
            some, keys = [], len(tracks[i].values)
        some.append(i)
    if some:
        yield some


def _weights_rest(context: Context, track: Track, bound: float) -> bool:
    """Return whether morph weights keep every vertex within `bound` of rest; false for splines that move."""
    assert track.node is not None
    reach = context.morph_reach(track.node)
    if not reach.size or track.interpolation is Interpolation.CUBICSPLINE:
        return False
    return morph_weights.weight_error(track, context.weights_at_rest(track.node), reach) <= bound


class _Value:
    """A constant of a property, with the number of clips that use it."""

    def __init__(self, value: Floats) -> None:
        self.value = value
        self.clips = 1


def _count_constant(found: list[_Value], track: Track, unit: float, bound: float) -> None:
    """Count the track for a constant near all of its keys; without one, add its own middle if near."""
    for each in found:
        if unit * _difference(track, each.value) <= bound:
            each.clips += 1
            return
    rows = quaternion.align_signs(track.values) if track.path == "rotation" else track.values
    middle = (rows.min(axis=0) + rows.max(axis=0)) / 2
    if track.path == "rotation" and np.abs(middle).max() > 1e-6:
        middle = quaternion.normalize(middle)
    if unit * _difference(track, middle) <= bound:
        found.append(_Value(middle))


def _difference(track: Track, value: Floats) -> float:
    """Largest distance of the track's keys from a value, in its units."""
    squares = _squared_distances(track.values, value)
    if track.path == "rotation":
        squares = np.minimum(squares, _squared_distances(track.values, -value))
    return math.sqrt(squares.max())


def _squared_distances(values: Floats, value: Floats) -> Floats:
    """Squared distances (K,) of keys (K, C) from a value (C,)."""
    apart = values - value
    apart *= apart
    return np.asarray(apart.sum(axis=1))


def _has_tangents(track: Track) -> bool:
    """Return whether the track is a spline that moves between its keys."""
    if track.in_tangents is None or track.out_tangents is None:
        return False
    return bool(track.in_tangents.any() or track.out_tangents.any())


def _meters_per_unit(context: Context, animated: Iterable[int]) -> tuple[Floats, Floats, Floats]:
    """Displacement of a point per unit of translation, rotation and scale (N,) of animated nodes, at rest."""
    world, skeleton = context.rest_world, context.skeleton
    places = np.swapaxes(context.points.places(world[:, None]), 1, 2)
    reach, chosen = np.zeros(len(skeleton)), sorted(animated)
    reach[chosen] = context.answering.radii(places, chosen, world[chosen][..., 3:])
    lengths = np.sqrt((world[..., :3] ** 2).sum(axis=-2)).max(axis=1)
    widening = np.where(skeleton.parents < 0, 1.0, lengths[skeleton.parents])
    return widening, 2 * reach, reach / np.maximum(np.abs(skeleton.scale).min(axis=1), 1e-6)

"""Constants common to all clips, found before any search: properties at rest, and shared values."""

from __future__ import annotations

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
    from_rest = _distances_from_rest(context, clips, meters)
    for clip, apart in zip(clips, from_rest, strict=True):
        for track, distance in zip(clip.tracks, apart.tolist(), strict=True):
            if track.node is None or track.path == "pointer":
                continue
            target = (track.node, track.path)
            if track.path == "weights":
                seen.add(target)
                if not _weights_rest(context, track, bound):
                    moved.add(target)
                continue
            seen.add(target)
            if distance > bound:
                moved.add(target)
                unit = meters[PATHS.index(track.path)][track.node]
                if unit * _difference(track, track.values[0]) > 2 * bound:  # too far apart for any constant
                    continue
                _count_constant(values.setdefault(target, []), track, unit, bound)
    chosen = {
        target: tuple(each.value for each in sorted(found, key=lambda each: -each.clips))
        for target, found in values.items()
    }
    return Constants(frozenset(seen - moved), chosen, from_rest)


def _distances_from_rest(
    context: Context, clips: Sequence[Clip], meters: tuple[Floats, Floats, Floats]
) -> tuple[Floats, ...]:
    """For each clip the largest distance (T,) m of each track's keys from rest; inf for other tracks than of nodes."""
    tracks = [track for clip in clips for track in clip.tracks]
    found = np.full(len(tracks), np.inf)
    for number, path in enumerate(PATHS):
        mine = [i for i, track in enumerate(tracks) if track.path == path and not _has_tangents(track)]
        rest = getattr(context.skeleton, path)
        for some in _by_keys(mine, tracks):
            counts = [len(tracks[i].values) for i in some]
            nodes = np.array([tracks[i].node for i in some])
            values, at_rest = np.concatenate([tracks[i].values for i in some]), np.repeat(rest[nodes], counts, axis=0)
            apart = np.linalg.norm(values - at_rest, axis=1)
            if path == "rotation":
                apart = np.minimum(apart, np.linalg.norm(values + at_rest, axis=1))
            starts = np.cumsum([0, *counts[:-1]])
            found[some] = meters[number][nodes] * np.maximum.reduceat(apart, starts)
    ends = np.cumsum([len(clip.tracks) for clip in clips]).tolist()
    return tuple(found[end - len(clip.tracks) : end] for clip, end in zip(clips, ends, strict=True))


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
    """Largest distance of the track's keys from a value, in its units; infinite for a spline that moves."""
    if _has_tangents(track):
        return float("inf")
    apart = np.linalg.norm(track.values - value, axis=1)
    if track.path == "rotation":
        apart = np.minimum(apart, np.linalg.norm(track.values + value, axis=1))
    return float(apart.max())


def _has_tangents(track: Track) -> bool:
    """Return whether the track is a spline that moves between its keys."""
    if track.in_tangents is None or track.out_tangents is None:
        return False
    return bool(track.in_tangents.any() or track.out_tangents.any())


def _meters_per_unit(context: Context, animated: Iterable[int]) -> tuple[Floats, Floats, Floats]:
    """Displacement of a point per unit of translation, rotation and scale (N,) of animated nodes, at rest."""
    world, skeleton = context.rest_world, context.skeleton
    places = context.points.places(world[:, None])[:, 0]
    count = len(skeleton)
    reach = np.zeros(count)
    for node in animated:
        mine = places[context.answering.of(node)]
        reach[node] = np.linalg.norm(mine - world[node, :, 3], axis=1).max(initial=0.0)
    lengths = np.sqrt((world[..., :3] ** 2).sum(axis=-2)).max(axis=1)
    widening = np.where(skeleton.parents < 0, 1.0, lengths[skeleton.parents])
    return widening, 2 * reach, reach / np.maximum(np.abs(skeleton.scale).min(axis=1), 1e-6)

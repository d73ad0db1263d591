"""Bound of the displacement between times, above that at the times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.continuous_bound.influence_radius import InfluenceRadius
from anim.measure.continuous_bound.intervals import MAX_UNSPLIT_S, Intervals, merge_intervals
from anim.measure.continuous_bound.node_bounds import world_bounds
from anim.measure.continuous_bound.node_tracks import ClipSpan, columns_of
from anim.measure.continuous_bound.second_derivative import second_derivative_bound
from anim.measure.continuous_bound.track_partition import ClipVersion, partition_tracks
from anim.model import Clip, Scene
from anim.sampling.weight_pointers import resolve_weight_pointers


class ClipVersions(NamedTuple):
    """Both versions of a clip: with weights of pointers as tracks, and sorted by what moves."""

    clips: tuple[Clip, Clip]
    sides: tuple[ClipVersion, ClipVersion]


class ClipTimes(NamedTuple):
    """Times (F,) of a clip in s, two or more.

    Increasing, with all keys of both versions that are between them, and the last moment before each STEP key.
    """

    versions: ClipVersions
    times: Floats


class IntervalRise(NamedTuple):
    """Bounds for C groups between each time of a clip and the next (C, F − 1), in m; inf if unknown.

    Those of one clip follow those of another.

    rise: excess of displacements over the larger one of both ends. jump: excess of the displacement just before the
    later time over the one at it.
    """

    rise: Floats
    jump: Floats


def prepare_versions(scenes: tuple[Scene, Scene], clips: tuple[Clip, Clip]) -> ClipVersions:
    """Return both versions of a clip, each on its scene, for any number of calls of `interval_rise`."""
    one, other = (resolve_weight_pointers(s.skeleton, clip) for s, clip in zip(scenes, clips, strict=True))
    return ClipVersions((one, other), partition_tracks(scenes, (one, other)))


def interval_rise(
    clips: Sequence[ClipTimes],
    reaches: Sequence[InfluenceRadius],
    players: Sequence[str],
    *,
    longest: float = MAX_UNSPLIT_S,
) -> IntervalRise:
    """Return upper bounds of the rise of displacements between times of clips.

    clips: on the same two scenes; their intervals are stacked, so that those of short clips cost little. reaches: of
    all surfaces, their groups in order. players: names in PLAYERS; the bounds hold for each. longest: s, intervals
    between keys up to this duration are bounded as one; shorter ones cost more and bound better.
    Source: |f(t)| ≤ max(|f(0)|, |f(h)|) + h²/8 · sup|f″|, since f minus its chord is bounded by the second term.
    """
    spans = [
        ClipSpan(each.versions.sides, merge_intervals(each.times, *each.versions.clips, longest=longest))
        for each in clips
    ]
    with np.errstate(all="ignore"):  # without a bound: inf or nan
        nodes = world_bounds(spans, players=players)
        found = [second_derivative_bound(reach, nodes, spans) for reach in reaches]
        bend, jump = (np.concatenate(parts) for parts in zip(*found, strict=True))
        places = [_place(each.times, span.where) for each, span in zip(clips, spans, strict=True)]
        firsts = [columns.start for columns in columns_of(spans)]
        number = np.concatenate([place.number + first for place, first in zip(places, firsts, strict=True)])
        length, is_end = (np.concatenate([place[k] for place in places]) for k in (1, 2))
        parts = bend[:, number] * (length * length / 8), jump[:, number] * is_end
    return IntervalRise(*(np.where(np.isfinite(one), one, np.inf) for one in parts))


class _Place(NamedTuple):
    """Times of a clip (F − 1,): the interval from each on, the length in s up to the next one, if that is its end."""

    number: Ints
    length: Floats
    is_end: Bools


def _place(times: Floats, where: Intervals) -> _Place:
    number = where.number(times[:-1])
    return _Place(number, np.diff(times), where.ends[number] == times[1:])

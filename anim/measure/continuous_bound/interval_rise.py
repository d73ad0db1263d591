"""Bound of the displacement between times, above that at the times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.measure.continuous_bound.influence_radius import InfluenceRadius
from anim.measure.continuous_bound.intervals import MAX_UNSPLIT_S, merge_intervals
from anim.measure.continuous_bound.node_bounds import world_bounds
from anim.measure.continuous_bound.second_derivative import second_derivative_bound
from anim.measure.continuous_bound.track_partition import ClipVersion, partition_tracks
from anim.model import Clip, Scene
from anim.sampling.weight_pointers import resolve_weight_pointers


class ClipVersions(NamedTuple):
    """Both versions of a clip: with weights of pointers as tracks, and sorted by what moves."""

    clips: tuple[Clip, Clip]
    sides: tuple[ClipVersion, ClipVersion]


class IntervalRise(NamedTuple):
    """Bounds for C groups between each of F times and the next (C, F − 1), in m; inf if unknown.

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
    versions: ClipVersions,
    times: Floats,
    reaches: Sequence[InfluenceRadius],
    players: Sequence[str],
    *,
    longest: float = MAX_UNSPLIT_S,
) -> IntervalRise:
    """Return upper bounds of the rise of displacements between `times` (F,) in s, two or more.

    times: increasing, with all keys of both clips that are between them, and the last moment before each STEP key.
    reaches: of all surfaces, their groups in order. players: names in PLAYERS; the bounds hold for each.
    longest: s, intervals between keys up to this duration are bounded as one; shorter ones cost more and bound better.
    Source: |f(t)| ≤ max(|f(0)|, |f(h)|) + h²/8 · sup|f″|, since f minus its chord is bounded by the second term.
    """
    first, second = versions.sides
    where = merge_intervals(times, *versions.clips, longest=longest)
    with np.errstate(all="ignore"):  # without a bound: inf or nan
        nodes = world_bounds(first, second, where, players=players)
        each = [second_derivative_bound(reach, nodes, first, second, where) for reach in reaches]
        number, length = where.number(times[:-1]), np.diff(times)
        rise = np.concatenate([one.bend for one in each])[:, number] * (length * length / 8)
    jump = np.concatenate([one.jump for one in each])[:, number] * (where.ends[number] == times[1:])
    return IntervalRise(*(np.where(np.isfinite(one), one, np.inf) for one in (rise, jump)))

"""Verification of a written clip: errors against its source in every kind of player, and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, unique_sorted
from anim.measure.compare.equal_scenes import are_equal_motions, no_error
from anim.measure.continuous_bound.prover import BOUND_SLACK, Proof, Prover
from anim.measure.error.metric import NOISE, ErrorMetric, MotionError
from anim.measure.error.sample_times import SAME_MOMENT, cut_times, dense_times, key_and_mid_times
from anim.measure.error.statistics import Statistics, statistics
from anim.model import Clip, Interpolation
from anim.optimization.options import PLAYERS, Bounds, Reference
from anim.optimization.tracks.clip_ends import opened_tracks

FLOAT_NOISE = 1e-9  # of the diagonal: rounding in float64 of equal motion
MAX_SPARSE_STEP_S = 1 / 20  # s; a proof of longer intervals needs more samples than it saves
SPARSE_SLACK = 0.004  # of the largest distance: so much less than at dense times can be reported
CUBIC_PARTS = 4  # samples per segment of splines, which can be equal at keys and half-way, and different elsewhere


@dataclass(frozen=True, slots=True)
class Verification:
    """Errors of one clip against its source.

    error: the largest distance, with its location. player: the one with that error. statistics: further errors in the
    first player; None unless requested. usage: the largest fraction of any bound; all bounds hold up to 1.
    certified: m, upper bound of the error at all times; None unless requested and proven.
    """

    error: MotionError
    player: str
    statistics: Statistics | None
    usage: float
    certified: float | None = None

    @property
    def holds(self) -> bool:
        """Return whether all bounds hold."""
        return self.usage <= 1


def verify(
    ruler: ErrorMetric,
    before: Clip,
    after: Clip,
    *,
    bounds: Bounds,
    reference: Reference,
    players: Sequence[str] = PLAYERS,
    detailed: bool = True,
    prover: Prover | None = None,
) -> Verification:
    """Return the errors of `after` against `before`.

    `after` is as read from the written file. With a proof, samples are at all keys of both, and elsewhere where the
    error could be larger; without one at all keys, the middles between them, and 120 frames per second; with
    Reference.KEYS at the source's keys only. players: names in `anim.sampling.players.PLAYERS`; each plays both
    versions. detailed: statistics too, even if no bound requires them. prover: of the same metric, for all times.
    """
    found = _largest_error(ruler, before, after, bounds, reference, players, prover)
    error = found.error
    wanted = detailed or bounds.max_angle is not None or bounds.max_speed_error is not None
    times = _source_keys if reference is Reference.KEYS else dense_times
    more = statistics(ruler, before, after, times=times(before, after), player=players[0]) if wanted else None
    least = FLOAT_NOISE * (ruler.diagonal or 1.0)
    fractions = [
        _fraction(error.max_error, bounds.max_error, least),
        _fraction(error.max_pointer_error, bounds.max_pointer_error, FLOAT_NOISE),
    ]
    if bounds.max_angle is not None and more is not None:
        fractions.append(_fraction(more.angle.size, bounds.max_angle, FLOAT_NOISE))
    if bounds.max_speed_error is not None and more is not None:
        fractions.append(_fraction(more.speed.size, bounds.max_speed_error, least))
    if (before.start, before.end) != (after.start, after.end) or opened_tracks(before, after):
        fractions.append(float("inf"))
    return Verification(error, found.player, more, max(fractions), found.bound)


def _largest_error(
    ruler: ErrorMetric,
    before: Clip,
    after: Clip,
    bounds: Bounds,
    reference: Reference,
    players: Sequence[str],
    prover: Prover | None,
) -> Proof:
    """The largest error in any of the players, and an upper bound of it if the samples are within the bound."""
    if reference is Reference.KEYS:
        look = ruler.sample_errors(before, after, _source_keys(before, after), players=players)
        return Proof(None, look.error, look.player)
    if prover is not None and all(track.node is not None for track in (*before.tracks, *after.tracks)):
        found = _proven(ruler, before, after, sparse_times(before, after), bounds, players, prover, SPARSE_SLACK)
        near = found.error.max_error + max(BOUND_SLACK * found.error.max_error, 2 * NOISE * ruler.diagonal)
        if found.bound is not None and found.bound <= min(bounds.max_error, near):
            return found  # at all times, and hardly above the samples: no dense ones are needed
    return _proven(ruler, before, after, dense_times(before, after), bounds, players, prover)


def _proven(
    ruler: ErrorMetric,
    before: Clip,
    after: Clip,
    times: Floats,
    bounds: Bounds,
    players: Sequence[str],
    prover: Prover | None,
    slack: float = BOUND_SLACK,
) -> Proof:
    """The largest error at `times` and at those of a proof, which is tried only if the samples are within the bound."""
    if are_equal_motions(ruler, before, after):
        return Proof(None if prover is None else 0.0, no_error(times), players[0])
    look = ruler.sample_errors(before, after, times, players=players)
    if prover is None or look.error.max_error > max(bounds.max_error, FLOAT_NOISE * (ruler.diagonal or 1.0)):
        return Proof(None, look.error, look.player)
    return prover.certified(before, after, times, look, enough=bounds.max_error, slack=slack)


def sparse_times(*clips: Clip) -> Floats:
    """Return the key times of clips, few times between, and one before the first key: enough for most proofs.

    In seconds, increasing.
    """
    is_cubic = any(track.interpolation is Interpolation.CUBICSPLINE for clip in clips for track in clip.tracks)
    times = cut_times(*clips, parts=CUBIC_PARTS if is_cubic else 1, step=MAX_SPARSE_STEP_S)
    return unique_sorted(np.append(times, max(times[0] - SAME_MOMENT, 0.0)))


def _source_keys(before: Clip, _after: Clip) -> Floats:
    return key_and_mid_times(before)[::2]


def _fraction(size: float, bound: float, least: float) -> float:
    return size / max(bound, least)

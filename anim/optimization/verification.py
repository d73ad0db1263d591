"""Verification of written clips: errors against their sources in every kind of player, and bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from anim.arrays import Floats, unique_sorted
from anim.measure.compare.equal_scenes import are_equal_motions, no_error
from anim.measure.continuous_bound.prover import BOUND_SLACK, Proof, Prover
from anim.measure.continuous_bound.sampled_clips import SampledClip
from anim.measure.error.metric import NOISE, ErrorMetric
from anim.measure.error.motion_error import MotionError
from anim.measure.error.sample_times import SAME_MOMENT, cut_times, dense_times, key_and_mid_times
from anim.measure.error.statistics import Statistics, statistics
from anim.model import Clip, Interpolation
from anim.optimization.options import PLAYERS, Bounds, Reference
from anim.optimization.tracks.clip_ends import opened_tracks

FLOAT_NOISE = 1e-9  # of the diagonal: rounding in float64 of equal motion
MAX_SPARSE_STEP_S = 1 / 20  # s; a proof of longer intervals needs more samples than it saves
SPARSE_SLACK = 0.004  # of the largest distance: so much less than at dense times can be reported
CUBIC_PARTS = 4  # samples per segment of splines, which can be equal at keys and half-way, and different elsewhere

Pair: TypeAlias = tuple[Clip, Clip]  # before and after


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


def verify_clips(
    ruler: ErrorMetric,
    pairs: Sequence[Pair],
    *,
    bounds: Bounds,
    reference: Reference,
    players: Sequence[str] = PLAYERS,
    detailed: bool = True,
    prover: Prover | None = None,
) -> list[Verification]:
    """Return the errors of clips, each before and after.

    Those after are as read from the written file. With a proof, samples are at all keys of both, and elsewhere where
    the error could be larger; without one at all keys, the middles between them, and 120 frames per second; with
    Reference.KEYS at the source's keys only. players: names in `anim.sampling.players.PLAYERS`; each plays both
    versions. detailed: statistics too, even if no bound requires them. prover: of the same metric, for all times.
    """
    measure = _Measure(ruler, bounds, players, prover)
    found = _errors_at_keys(measure, pairs) if reference is Reference.KEYS else _largest_errors(measure, pairs)
    times = _source_keys if reference is Reference.KEYS else dense_times
    wanted = detailed or bounds.max_angle is not None or bounds.max_speed_error is not None
    verified = []
    for pair, each in zip(pairs, found, strict=True):
        more = statistics(ruler, *pair, times=times(*pair), player=players[0]) if wanted else None
        usage = _usage(ruler, pair, each.error, more, bounds)
        more = more and more.capped(each.error.max_error)
        verified.append(Verification(each.error, each.player, more, usage, each.bound))
    return verified


def _usage(ruler: ErrorMetric, pair: Pair, error: MotionError, more: Statistics | None, bounds: Bounds) -> float:
    """The largest fraction of any bound, inf if the clips' ends differ."""
    least = FLOAT_NOISE * (ruler.diagonal or 1.0)
    fractions = [
        _fraction(error.max_error, bounds.max_error, least),
        _fraction(error.max_pointer_error, bounds.max_pointer_error, FLOAT_NOISE),
    ]
    if bounds.max_angle is not None and more is not None:
        fractions.append(_fraction(more.angle.size, bounds.max_angle, FLOAT_NOISE))
    if bounds.max_speed_error is not None and more is not None:
        fractions.append(_fraction(more.speed.size, bounds.max_speed_error, least))
    before, after = pair
    if (before.start, before.end) != (after.start, after.end) or opened_tracks(before, after):
        fractions.append(float("inf"))
    return max(fractions)


class _Measure(NamedTuple):
    """Metric, bounds, players and prover, for all clips."""

    ruler: ErrorMetric
    bounds: Bounds
    players: Sequence[str]
    prover: Prover | None


def _errors_at_keys(of: _Measure, pairs: Sequence[Pair]) -> list[Proof]:
    """The largest errors at the source's keys in any of the players, without proof."""
    looks = (of.ruler.sample_errors(*pair, _source_keys(*pair), players=of.players) for pair in pairs)
    return [Proof(None, look.error, look.player) for look in looks]


def _largest_errors(of: _Measure, pairs: Sequence[Pair]) -> list[Proof]:
    """The largest errors in any of the players, and upper bounds of those that are within the bound at samples."""
    sparse = [n for n, pair in enumerate(pairs) if of.prover is not None and _moves_nodes_only(pair)]
    found = dict(zip(sparse, _proven(of, [pairs[n] for n in sparse], sparse_times, SPARSE_SLACK), strict=True))
    others = [n for n in range(len(pairs)) if n not in found or not _is_near(of, found[n])]
    found.update(zip(others, _proven(of, [pairs[n] for n in others], dense_times), strict=True))
    return [found[n] for n in range(len(pairs))]


def _moves_nodes_only(pair: Pair) -> bool:
    return all(track.node is not None for clip in pair for track in clip.tracks)


def _is_near(of: _Measure, found: Proof) -> bool:
    """True if the bound is hardly above the samples, at all times: no dense ones are needed."""
    near = found.error.max_error + max(BOUND_SLACK * found.error.max_error, 2 * NOISE * of.ruler.diagonal)
    return found.bound is not None and found.bound <= min(of.bounds.max_error, near)


def _proven(
    of: _Measure, pairs: Sequence[Pair], times: Callable[..., Floats], slack: float = BOUND_SLACK
) -> list[Proof]:
    """The largest errors at times of each clip and at those of a proof.

    That is tried only if the samples are within the bound. times: gives those (F,) of a clip in s, from both versions.
    """
    most = max(of.bounds.max_error, FLOAT_NOISE * (of.ruler.diagonal or 1.0))
    found: dict[int, Proof] = {}
    sampled: dict[int, SampledClip] = {}
    for n, pair in enumerate(pairs):
        at = times(*pair)
        if are_equal_motions(of.ruler, *pair):
            found[n] = Proof(None if of.prover is None else 0.0, no_error(at), of.players[0])
            continue
        look = of.ruler.sample_errors(*pair, at, players=of.players)
        if of.prover is None or look.error.max_error > most:
            found[n] = Proof(None, look.error, look.player)
        else:
            sampled[n] = SampledClip(*pair, at, look)
    if of.prover is not None:
        proofs = of.prover.certify(list(sampled.values()), enough=of.bounds.max_error, slack=slack)
        found.update(zip(sampled, proofs, strict=True))
    return [found[n] for n in range(len(pairs))]


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

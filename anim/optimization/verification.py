"""Verification of a written clip: errors against its source in every kind of player, and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric, MotionError, dense_times, key_and_mid_times
from anim.measure.error.statistics import Statistics, statistics
from anim.model import Clip
from anim.optimization.options import PLAYERS, Bounds, Reference
from anim.optimization.tracks.clip_ends import opened_tracks

FLOAT_NOISE = 1e-9  # of the diagonal: rounding in float64 of equal motion


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
    """Return the errors of `after`, as read from the written file, against `before`.

    Measured at all keys of both, the middles between them, and 120 frames per second; with Reference.KEYS at the
    source's keys only. players: names in `anim.sampling.players.PLAYERS`; each plays both versions. detailed:
    statistics too, even if no bound requires them. prover: of the same metric; samples further times to prove a bound
    for all times, unless the bound is exceeded anyway.
    """
    if reference is Reference.KEYS:
        times, prover = key_and_mid_times(before)[::2], None
    else:
        times = dense_times(before, after)
    look = ruler.sample_errors(before, after, times, players=players)
    error, player, certified = look.error, look.player, None
    if prover is not None and error.max_error <= max(bounds.max_error, FLOAT_NOISE * (ruler.diagonal or 1.0)):
        proof = prover.certified(before, after, times, look, enough=bounds.max_error)
        error, player, certified = proof.error, proof.player, proof.bound
    wanted = detailed or bounds.max_angle is not None or bounds.max_speed_error is not None
    found = statistics(ruler, before, after, times=times, player=players[0]) if wanted else None
    least = FLOAT_NOISE * (ruler.diagonal or 1.0)
    fractions = [
        _fraction(error.max_error, bounds.max_error, least),
        _fraction(error.max_pointer_error, bounds.max_pointer_error, FLOAT_NOISE),
    ]
    if bounds.max_angle is not None and found is not None:
        fractions.append(_fraction(found.angle.size, bounds.max_angle, FLOAT_NOISE))
    if bounds.max_speed_error is not None and found is not None:
        fractions.append(_fraction(found.speed.size, bounds.max_speed_error, least))
    if (before.start, before.end) != (after.start, after.end) or opened_tracks(before, after):
        fractions.append(float("inf"))
    return Verification(error, player, found, max(fractions), certified)


def _fraction(size: float, bound: float, least: float) -> float:
    return size / max(bound, least)

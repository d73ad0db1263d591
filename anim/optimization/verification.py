"""What a written clip is worth: how far it is from its source, played by every kind of player, against its bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric, MotionError, dense_times, key_and_mid_times
from anim.measure.error.statistics import Statistics, statistics
from anim.model import Clip
from anim.optimization.options import Bounds, Reference
from anim.optimization.tracks.loop_closure import opened_tracks

FLOAT_NOISE = 1e-9  # of the diagonal: what rounding in float64 may show of motion that is the same
PLAYERS = ("spec", "three", "raw", "nlerp")  # "three" mixes joints of two kinds: 3 % beyond both others on Fox


@dataclass(frozen=True, slots=True)
class Verification:
    """One clip against its source.

    error: the largest distance, and where. player: who showed it. statistics: the rest, as the first player shows it;
    None where nobody asked.
    strain: the largest share of any bound; up to 1 all hold.
    certified: m, no vertex is farther off at any time, looked at or not; None where nobody asked, or nothing is proven.
    """

    error: MotionError
    player: str
    statistics: Statistics | None
    usage: float
    certified: float | None = None

    @property
    def holds(self) -> bool:
        """Whether all bounds hold."""
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
    """Return how far `after`, as read from the written file, is from `before`.

    Looked at: all keys of both, the middles between them, and 120 frames per second; with Reference.KEYS the source's
    keys only. players: names in `anim.sampling.players.PLAYERS`; each plays both versions. detailed: statistics too,
    even where no bound asks for them. prover: of the same ruler; looks wherever else it must to prove a bound for all
    times, unless the bound is exceeded anyway.
    """
    if reference is Reference.KEYS:
        times, prover = key_and_mid_times(before)[::2], None
    else:
        times = dense_times(before, after)
    looks = {player: ruler.sample_errors(before, after, times, player=player) for player in players}
    player = max(looks, key=lambda each: looks[each].error.max_error)
    error, certified = looks[player].error, None
    if prover is not None and error.max_error <= max(bounds.max_error, FLOAT_NOISE * (ruler.diagonal or 1.0)):
        proof = prover.certified(before, after, times, looks, enough=bounds.max_error)
        error, player, certified = proof.error, proof.player, proof.bound
    wanted = detailed or bounds.max_angle is not None or bounds.max_speed_error is not None
    about = statistics(ruler, before, after, times=times, player=players[0]) if wanted else None
    least = FLOAT_NOISE * (ruler.diagonal or 1.0)
    shares = [
        _fraction(error.max_error, bounds.max_error, least),
        _fraction(error.max_pointer_error, bounds.max_pointer_error, FLOAT_NOISE),
    ]
    if bounds.max_angle is not None and about is not None:
        shares.append(_fraction(about.angle.size, bounds.max_angle, FLOAT_NOISE))
    if bounds.max_speed_error is not None and about is not None:
        shares.append(_fraction(about.speed.size, bounds.max_speed_error, least))
    if (before.start, before.end) != (after.start, after.end) or opened_tracks(before, after):
        shares.append(float("inf"))
    return Verification(error, player, about, max(shares), certified)


def _fraction(size: float, bound: float, least: float) -> float:
    return size / max(bound, least)

"""Proof of an upper bound of the distance between two versions of a clip at all times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats
from anim.measure.continuous_bound.influence_radius import influence_radius
from anim.measure.continuous_bound.interval_rise import IntervalRise, interval_rise, prepare_versions
from anim.measure.continuous_bound.intervals import MAX_UNSPLIT_S
from anim.measure.continuous_bound.refinement import OpenIntervals, RefinedMaximum, refine
from anim.measure.error.metric import NOISE, ErrorMetric, ErrorSamples, MotionError
from anim.model import Clip, Scene
from anim.sampling.players import PLAYERS

BOUND_SLACK = 0.01  # of the largest distance: a bound this close to it is not refined
MAX_REFINED_DEPTH = 256  # levels of the metric's skeletons; bounds of deeper ones are too loose for any samples
PLAYER_ORDER = ("spec", "raw", "three", "nlerp")  # players with normalized arcs are adjacent
LARGE_SKELETON = 1000  # moving nodes; from here on a step is LARGE_STEP_FRACTION as long, for memory
LARGE_STEP_FRACTION = 0.5
BLOCK = 250_000  # players × intervals × groups and nodes per step, each up to 800 bytes


class Proof(NamedTuple):
    """Upper bound over all times of a clip.

    bound: m, of the displacement of any vertex at any time, except for rounding; None if unproven.
    error, player: the largest sampled distance, including samples of the proof.
    """

    bound: float | None
    error: MotionError
    player: str


class ProofTarget(NamedTuple):
    """Target of a proof. found: m, largest distance so far. slack: m, largest excess of the bound over it."""

    found: float
    slack: float

    @property
    def max_bound(self) -> float:
        """The largest bound in m that needs no refinement."""
        return self.found + self.slack


class Prover:
    """Prover of bounds for clips on the scenes of a metric: prepares what all clips share.

    is_refined: whether samples between times can prove more; not of skeletons with hundreds of levels.
    """

    def __init__(self, ruler: ErrorMetric) -> None:
        self.ruler = ruler
        found = [(i, influence_radius(part)) for i, part in enumerate(ruler.combined) if len(part.groups)]
        self._reaches = [each for _, each in found if each is not None]
        self._order = [i for i, each in found if each is not None]
        self._parts = [ruler.combined[i] for i in self._order]
        a, b = ruler.skeletons
        same = np.array_equal(a.parents, b.parents) and np.array_equal(a.sheared, b.sheared)
        self._knows_all = same and len(self._parts) == len(found)
        self.is_refined = len(a.levels()) <= MAX_REFINED_DEPTH

    def certified(
        self,
        before: Clip,
        after: Clip,
        times: Floats,
        look: ErrorSamples,
        *,
        enough: float | None = None,
        floor: float = 0.0,
        longest: float = MAX_UNSPLIT_S,
        slack: float = BOUND_SLACK,
    ) -> Proof:
        """Return an upper bound of the displacement of any vertex at any time, in all of the players.

        It is above the largest sample by at most `slack`, as a fraction of it, unless intervals between times would
        need too many subdivisions, or the metric's skeletons have hundreds of levels.
        times: (F,) s, increasing, with all keys of both clips and the last moment before each STEP key, such as those
        of `dense_times`. look: samples at these times. enough: m, target of the bound if it is nearer to the
        largest sample. floor: m, bounds below it are not refined. longest: s, as for `interval_rise`.
        Nothing is proven for scenes with different hierarchies, for players other than those of PLAYERS, or if
        quaternions pass through zero or rotate too far between two times.
        """
        player, worst = look.player, look.error
        if not self._knows_all or not set(look.limits) <= set(PLAYERS):
            return Proof(None, worst, player)
        bound = max(worst.max_error, floor)
        room = max(bound * slack, NOISE * self.ruler.diagonal)
        aim = ProofTarget(bound, min(room, enough - bound) if enough is not None and enough > bound else room)
        seen, length = RefinedMaximum(), self._length(len(look.limits))
        scenes = Scene(self.ruler.skeletons[0], ()), Scene(self.ruler.skeletons[1], ())
        versions = prepare_versions(scenes, self.ruler.clips(before, after))
        for start in range(0, len(times) - 1 if self._parts else 0, length):
            stretch = slice(start, start + length + 1)
            limits = _limits(look.limits, self._order, stretch)
            risen = interval_rise(versions, times[stretch], self._reaches, list(limits), longest=longest)
            closed, other = self._proven((before, after), times[stretch], limits, risen, aim)
            bound = max(bound, closed)
            seen = max(seen, other, key=lambda each: each.largest)
        if seen.largest > worst.max_error:
            found = self.ruler.error_at(before, after, np.array([seen.time]), player=seen.player)
            pointers, pointer = worst.max_pointer_error, worst.pointer
            player = seen.player
            worst = found._replace(times=worst.times + 1, max_pointer_error=pointers, pointer=pointer)
        bound = max(bound, worst.max_error)
        return Proof(bound if np.isfinite(bound) else None, worst, player)

    def _length(self, players: int) -> int:
        """Maximum number of intervals per step."""
        groups = sum(len(part.groups) for part in self._parts)
        nodes = len(self.ruler.skeletons[0])
        block = int(BLOCK * LARGE_STEP_FRACTION) if nodes >= LARGE_SKELETON else BLOCK
        return max(block // (players * (groups + nodes) + 1), 8)

    def _proven(
        self,
        clips: tuple[Clip, Clip],
        times: Floats,
        limits: Mapping[str, Floats],
        risen: IntervalRise,
        aim: ProofTarget,
    ) -> tuple[float, RefinedMaximum]:
        """The bound of all intervals without refinement, and the result of refining the others."""
        closed, opened = 0.0, []
        for player, each in limits.items():
            ends = each[:, :-1], each[:, 1:] + risen.jump
            tops = np.maximum(*ends) + risen.rise
            is_open = (tops > aim.max_bound) & self.is_refined
            closed = max(closed, float(np.where(is_open, 0.0, tops).max()))
            if is_open.any():
                opened.append(OpenIntervals(player, ends, risen.rise, is_open))
        refined, seen = self._refined(clips, times, opened, aim)
        return max(closed, refined), seen

    def _refined(
        self, clips: tuple[Clip, Clip], times: Floats, opened: Sequence[OpenIntervals], aim: ProofTarget
    ) -> tuple[float, RefinedMaximum]:
        """The bound of open intervals of all players, and the largest displacement sampled in them.

        They are divided into as many parts as it takes if displacements within are not larger than at both ends; then,
        where they are, into as many as it takes in any case. All players have the same parts, to share what they can.
        """
        bound, seen = 0.0, RefinedMaximum()
        for is_last in (False, True):
            opened = [each for each in opened if each.is_open.any()]
            if not opened:
                break
            finest = np.maximum.reduce([each.num_parts(aim.slack) for each in opened])
            margins = [aim.slack if is_last else each.margin(aim.max_bound, aim.slack) for each in opened]
            parts = np.maximum.reduce([each.num_parts(margin) for each, margin in zip(opened, margins, strict=True)])
            asked, edges = zip(*(each.subdivide(times, parts, aim.max_bound) for each in opened), strict=True)
            found = refine(self.ruler, clips, asked, self._parts, target=aim.max_bound)
            seen = max(seen, found, key=lambda each: each.largest)
            inner = [each.close(some, aim.max_bound, parts < finest) for each, some in zip(opened, asked, strict=True)]
            bound = max(bound, *edges, *inner)
        return bound, seen


def _limits(
    limits: Mapping[str, Sequence[NDArray[np.float32]]], order: Sequence[int], stretch: slice
) -> dict[str, Floats]:
    """Bounds of the displacement of groups at given times, by player in PLAYER_ORDER."""
    return {
        player: np.concatenate([limits[player][i][:, stretch] for i in order]).astype(np.float64)
        for player in PLAYER_ORDER
        if player in limits
    }

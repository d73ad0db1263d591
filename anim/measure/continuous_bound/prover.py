"""Proof of an upper bound of the distance between two versions of a clip at all times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.measure.continuous_bound.influence_radius import influence_radius
from anim.measure.continuous_bound.interval_rise import (
    ClipTimes,
    ClipVersions,
    IntervalRise,
    interval_rise,
    prepare_versions,
)
from anim.measure.continuous_bound.intervals import MAX_UNSPLIT_S
from anim.measure.continuous_bound.refinement import RefinedMaximum, refine
from anim.measure.continuous_bound.sampled_clips import ClipPart, SampledClip, divide, end_limits
from anim.measure.continuous_bound.subintervals import OpenIntervals, TimeIntervals, join_intervals
from anim.measure.error.metric import NOISE, ErrorMetric, ErrorSamples
from anim.measure.error.motion_error import MotionError
from anim.model import Clip, Scene
from anim.sampling.players import PLAYERS

BOUND_SLACK = 0.01  # of the largest distance: a bound this close to it is not refined
MAX_REFINED_DEPTH = 256  # levels of the metric's skeletons; bounds of deeper ones are too loose for any samples
PLAYER_ORDER = ("spec", "raw", "three", "nlerp")  # players with normalized arcs are adjacent
LARGE_SKELETON = 1000  # moving nodes; from here on a step is LARGE_STEP_FRACTION as long, for memory
LARGE_STEP_FRACTION = 0.5
BLOCK = 100_000  # players × intervals × groups and nodes per step, each about 1 kB


class Proof(NamedTuple):
    """Upper bound over all times of a clip.

    bound: m, of the displacement of any vertex at any time, except for rounding; None if unproven.
    error, player: the largest sampled distance, including samples of the proof.
    """

    bound: float | None
    error: MotionError
    player: str


class ProofTarget(NamedTuple):
    """Targets of proofs of clips. found: m, largest distance so far. slack: m, largest excess of the bound over it."""

    found: Floats
    slack: Floats

    @property
    def max_bound(self) -> Floats:
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
        """Return the result of `certify` for one clip."""
        clip = SampledClip(before, after, times, look)
        return self.certify([clip], enough=enough, floor=floor, longest=longest, slack=slack)[0]

    def certify(
        self,
        clips: Sequence[SampledClip],
        *,
        enough: float | None = None,
        floor: float = 0.0,
        longest: float = MAX_UNSPLIT_S,
        slack: float = BOUND_SLACK,
    ) -> list[Proof]:
        """Return for each clip an upper bound of the displacement of any vertex at any time, in all of the players.

        It is above the largest sample by at most `slack`, as a fraction of it, unless intervals between times would
        need too many subdivisions, or the metric's skeletons have hundreds of levels.
        clips: all sampled in the same players. Short ones are bounded together; each has the result that it has alone.
        enough: m, target of the bound if it is nearer to the largest sample. floor: m, bounds below it are not refined.
        longest: s, as for `interval_rise`.
        Nothing is proven for scenes with different hierarchies, for players other than those of PLAYERS, or if
        quaternions pass through zero or rotate too far between two times.
        """
        players = set(clips[0].look.limits) if clips else set()
        if not self._knows_all or not players <= set(PLAYERS):
            return [Proof(None, each.look.error, each.look.player) for each in clips]
        bounds = np.array([max(each.look.error.max_error, floor) for each in clips])
        room = np.maximum(bounds * slack, NOISE * self.ruler.diagonal)
        if enough is not None:
            room = np.where(enough > bounds, np.minimum(room, enough - bounds), room)
        seen, aim = [RefinedMaximum() for _ in clips], ProofTarget(bounds.copy(), room)
        versions: dict[int, ClipVersions] = {}
        for step in divide(clips, self._length(len(players))) if self._parts else ():
            numbers = [part.number for part in step]
            versions = {n: versions.get(n) or self._versions(clips[n]) for n in numbers}
            tops, found = self._bounds(clips, step, list(versions.values()), aim, longest)
            bounds[numbers] = np.maximum(bounds[numbers], tops)
            for n, other in zip(numbers, found, strict=True):
                seen[n] = max(seen[n], other, key=lambda each: each.largest)
        return [self._conclude(*each) for each in zip(clips, bounds.tolist(), seen, strict=True)]

    def _versions(self, clip: SampledClip) -> ClipVersions:
        scenes = Scene(self.ruler.skeletons[0], ()), Scene(self.ruler.skeletons[1], ())
        return prepare_versions(scenes, self.ruler.clips(clip.before, clip.after))

    def _bounds(
        self,
        clips: Sequence[SampledClip],
        step: Sequence[ClipPart],
        versions: Sequence[ClipVersions],
        aim: ProofTarget,
        longest: float,
    ) -> tuple[Floats, list[RefinedMaximum]]:
        """The bounds of parts of clips (S,), and the result of refining each. aim: for all clips."""
        times = [clips[part.number].times[part.frames] for part in step]
        players = [player for player in PLAYER_ORDER if player in clips[0].look.limits]
        limits = {player: end_limits(clips, step, self._order, player) for player in players}
        risen = interval_rise(list(map(ClipTimes, versions, times)), self._reaches, players, longest=longest)
        where, numbers = join_intervals(times), [part.number for part in step]
        own = ProofTarget(*(each[numbers][where.clip] for each in aim))
        pairs = [(clips[n].before, clips[n].after) for n in numbers]
        tops, seen = self._proven(pairs, where, limits, risen, own)
        return np.maximum.reduceat(tops, np.searchsorted(where.clip, np.arange(len(step)))), seen

    def _conclude(self, clip: SampledClip, bound: float, seen: RefinedMaximum) -> Proof:
        """The proof of a clip by its bound and the largest sample of the refinement."""
        worst, player = clip.look.error, clip.look.player
        if seen.largest > worst.max_error:
            found = self.ruler.error_at(clip.before, clip.after, np.array([seen.time]), player=seen.player)
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
        clips: Sequence[tuple[Clip, Clip]],
        where: TimeIntervals,
        limits: Mapping[str, tuple[Floats, Floats]],
        risen: IntervalRise,
        aim: ProofTarget,
    ) -> tuple[Floats, list[RefinedMaximum]]:
        """The bounds (F,) of all intervals, and the result of refining those of each clip."""
        closed, opened = np.zeros(len(where.clip)), []
        for player, (start, end) in limits.items():
            ends = start, end + risen.jump
            tops = np.maximum(*ends) + risen.rise
            is_open = (tops > aim.max_bound) & self.is_refined
            closed = np.maximum(closed, np.where(is_open, 0.0, tops).max(axis=0))
            if is_open.any():
                opened.append(OpenIntervals(player, ends, risen.rise, is_open))
        refined, seen = self._refined(clips, where, opened, aim)
        return np.maximum(closed, refined), seen

    def _refined(
        self,
        clips: Sequence[tuple[Clip, Clip]],
        where: TimeIntervals,
        opened: Sequence[OpenIntervals],
        aim: ProofTarget,
    ) -> tuple[Floats, list[RefinedMaximum]]:
        """The bounds (F,) of open intervals of all players, and the largest displacement sampled in those of each clip.

        They are divided into as many parts as it takes if displacements within are not larger than at both ends; then,
        where they are, into as many as it takes in any case. All players have the same parts, to share what they can.
        """
        bound, seen = np.zeros(len(where.clip)), [RefinedMaximum() for _ in clips]
        for is_last in (False, True):
            opened = [each for each in opened if each.is_open.any()]
            if not opened:
                break
            finest = np.maximum.reduce([each.num_parts(aim.slack) for each in opened])
            margins = [aim.slack if is_last else each.margin(aim.max_bound, aim.slack) for each in opened]
            parts = np.maximum.reduce([each.num_parts(margin) for each, margin in zip(opened, margins, strict=True)])
            asked, edges = zip(*(each.subdivide(where, parts, aim.max_bound) for each in opened), strict=True)
            found = refine(self.ruler, clips, asked, self._parts, target=aim.max_bound)
            seen = [max(pair, key=lambda each: each.largest) for pair in zip(seen, found, strict=True)]
            inner = [each.close(some, aim.max_bound, parts < finest) for each, some in zip(opened, asked, strict=True)]
            bound = np.maximum.reduce([bound, *edges, *inner])
        return bound, seen

"""One way to write a clip, tried: from a budget per track to keys, to what players would show, to error and bytes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.model import Skeleton
from anim.optimization.search import playback
from anim.optimization.search.axis_layouts import TimeAxisSearch
from anim.optimization.search.bound_usage import BoundUsage
from anim.optimization.search.candidates import Candidate, Candidates
from anim.optimization.search.parent_compensation import ParentCompensation, budget_gain
from anim.optimization.search.plan import Plan, RotationTarget, TrackAction, TrialResult
from anim.optimization.search.source_motion import PATHS, ROTATION, SourceMotion, SourceTrack
from anim.optimization.search.time_axes import SharedAxis
from anim.optimization.tracks import quantization
from anim.optimization.tracks.quantization import EncodedKeys, Encoding

PATIENCE = 1.5  # budgets that a track may be off and yet go to rest, or to a single key
OF_STORING = 0.5  # share of a budget that storing may use
CHORDS_NOTICED = 0.02  # of the bound; where chords and arcs are closer, only arcs are looked at


class TrialRunner:
    """Tries plans for one clip: what does not change from trial to trial is prepared once.

    droppable: (G,) which tracks may go. shared: per track, values that other clips hold it at, the best first.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        truth: SourceMotion,
        strains: BoundUsage,
        coding: Encoding,
        droppable: Bools,
        shared: Sequence[Sequence[Floats]],
    ) -> None:
        self.truth = truth
        self._skeleton = skeleton
        self._strains = strains
        self._coding = coding
        self._droppable = droppable
        self._bound = strains.bounds.max_error
        self._nodes = np.array([each.node for each in truth.moving], np.int64)
        self._paths = np.array([PATHS.index(each.path) for each in truth.moving], np.int64)
        self._meters = np.array([each.meters for each in truth.moving])
        self._from_rest = np.array([each.from_rest for each in truth.moving])
        self._from_middle = np.array([each.from_middle for each in truth.moving])
        self._rest = [_rest(truth, path) for path in PATHS]
        self._shared = [_near(each, values) for each, values in zip(truth.moving, shared, strict=True)]
        self._layouts = TimeAxisSearch(truth, coding, self._bound)
        self._candidates = Candidates(truth, coding.packing)
        self._aims = ParentCompensation(skeleton, truth, self._candidates)

    def run(self, plan: Plan, *, smaller_than: float = math.inf) -> TrialResult:
        """Return what comes of a plan.

        Players that mix rotations by components are asked only where the outcome is otherwise good, and has fewer
        bytes than `smaller_than`.
        """
        fates = self._fates(plan)
        shown = [part.copy() for part in self.truth.local]
        keys = self._single_key(fates, plan, shown)
        axes = self._layouts.axes(plan.axes, np.flatnonzero(fates == TrackAction.KEYED), plan.budgets)
        misses = (OF_STORING * plan.budgets * plan.coarser / np.maximum(self._meters, 1e-30)).tolist()
        for i, candidate in self._keyed(plan.rotation_target, axes, misses, shown[ROTATION]):
            keys[i] = candidate.stored
            shown[self._paths[i]][self._nodes[i]] = candidate.shown
        on = {i: axis.keys for axis in axes for i in axis.members}
        size = self._size(fates, keys, axes)
        strains = self._strains
        outcome = TrialResult(plan, fates, keys, on, strains.slerp_raw(shown), strains.own(shown), size)
        if outcome.worst > 1 or size >= smaller_than or not self._chords_matter(axes, keys):
            return outcome
        return replace(outcome, usage=np.maximum(outcome.usage, self._nlerp_usage(axes, keys, shown)))

    @cached_property
    def leeway(self) -> Floats:
        """By how much each track (G,) reaches farther than to where others can make up for it."""
        return budget_gain(self._skeleton, self.truth, self._strains.points)

    def _keyed(
        self, aim: RotationTarget, axes: Sequence[SharedAxis], misses: Sequence[float], rotation: Floats
    ) -> Iterator[tuple[int, Candidate]]:
        """Every keyed track with its candidate. rotation: (N, W, 4) what is shown of all others."""
        if aim is RotationTarget.WORLD:
            yield from self._aims.follow(axes, misses, rotation)
            axes = [
                SharedAxis(axis.keys, tuple(i for i in axis.members if self._paths[i] != ROTATION)) for axis in axes
            ]
        for axis in axes:
            yield from self._candidates.of(axis, misses)

    def _fates(self, plan: Plan) -> Ints:
        allowance = np.maximum(PATIENCE * plan.budgets, plan.threshold)
        fates = np.full(len(allowance), TrackAction.KEYED, np.int64)
        fates[self._from_middle <= allowance] = TrackAction.HELD
        fates[(self._from_rest <= allowance) & self._droppable] = TrackAction.DROPPED
        return fates

    def _single_key(self, fates: Ints, plan: Plan, shown: list[Floats]) -> dict[int, EncodedKeys]:
        """Single keys of held tracks; they, and the rest values of dropped ones, are put into `shown`."""
        for path, rest in enumerate(self._rest):
            gone = np.flatnonzero((fates == TrackAction.DROPPED) & (self._paths == path))
            shown[path][self._nodes[gone]] = rest[gone][:, None]
        keys = {}
        for i in np.flatnonzero(fates == TrackAction.HELD).tolist():
            keys[i] = quantization.constant_cost(self._value(i, max(PATIENCE * plan.budgets[i], plan.threshold)))
            shown[self._paths[i]][self._nodes[i]] = keys[i].values[0]
        return keys

    def _value(self, i: int, allowance: float) -> Floats:
        """Where to hold a track: as other clips do, else at rest, else in the middle."""
        each = self.truth.moving[i]
        for value, off in self._shared[i]:
            if off <= allowance:
                return value
        return each.rest if each.from_rest <= allowance else each.middle

    def _chords_matter(self, axes: list[SharedAxis], keys: dict[int, EncodedKeys]) -> bool:
        for axis in axes:
            for i in axis.members:
                if self._paths[i] == ROTATION:
                    gap = playback.arc_distance(playback.steps(keys[i].values).max(initial=0.0)) / 2
                    if gap * self._meters[i] > CHORDS_NOTICED * self._bound:
                        return True
        return False

    def _nlerp_usage(self, axes: list[SharedAxis], keys: dict[int, EncodedKeys], shown: list[Floats]) -> Floats:
        for axis in axes:
            members = [i for i in axis.members if self._paths[i] == ROTATION]
            if members:
                mixed = self._candidates.by_chords(axis, [keys[i] for i in members])
                shown[ROTATION][self._nodes[members]] = np.swapaxes(mixed, 0, 1)
        return self._strains.nlerp(shown)

    def _size(self, fates: Ints, keys: dict[int, EncodedKeys], axes: list[SharedAxis]) -> float:
        prices = self._coding.prices
        moving = {(n, keys[i].name): keys[i] for n, axis in enumerate(axes) for i in axis.members}
        repeated = (fates == TrackAction.KEYED).sum() - len(moving)
        text = prices.track * len(moving) + prices.repeated * repeated + prices.held * (fates == TrackAction.HELD).sum()
        times = sum(prices.axis + self._coding.time_bytes * axis.keys.sum() for axis in axes)
        return float(text + times + self._coding.size(list(moving.values())))


def _rest(truth: SourceMotion, path: str) -> Floats:
    """The rest values (G, C) of the tracks of a path; 0 for all others."""
    width = next((len(each.rest) for each in truth.moving if each.path == path), 1)
    return np.array([each.rest if each.path == path else np.zeros(width) for each in truth.moving]).reshape(-1, width)


def _near(track: SourceTrack, values: Sequence[Floats]) -> list[tuple[Floats, float]]:
    """Each value with how far, in metres, the track is off it at most."""
    found = []
    for value in values:
        if track.path == "rotation" and track.values[0] @ value < 0:
            value = -value
        found.append((value, float(np.linalg.norm(track.values - value, axis=1).max()) * track.meters))
    return found

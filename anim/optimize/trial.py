"""One way to write a clip, tried: from a budget per track to keys, to what players would show, to error and bytes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import quaternion
from anim.model import Skeleton
from anim.optimize import coding, play
from anim.optimize.axes import Axis
from anim.optimize.candidates import Candidates
from anim.optimize.coding import Coding, Stored
from anim.optimize.layouts import Layouts
from anim.optimize.limits import Bounds
from anim.optimize.points import Points, stacked
from anim.optimize.truth import PATHS, Moving, Truth, worlds

PATIENCE = 1.5  # budgets that a track may be off and yet go to rest, or to a single key
OF_STORING = 0.5  # share of a budget that storing may use
CHORDS_NOTICED = 0.02  # of the bound; where chords and arcs are closer, only arcs are looked at
LEAST_GAP = 1e-4  # s; speeds are not taken over less


class Fate(IntEnum):
    """What becomes of a track."""

    DROPPED = 0
    HELD = 1
    KEYED = 2


@dataclass(frozen=True, slots=True)
class Plan:
    """How a trial goes about it.

    budgets: (G,) m that each track may move a point. threshold: m, what a track may be off in any case to be dropped
    or held. axes: how time axes are chosen, a name of LAYOUTS. coarser: (G,) factors on what storing may miss.
    """

    budgets: Floats
    threshold: float
    axes: str
    coarser: Floats


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a plan led to.

    fates: (G,). keys: by track, as stored; none of dropped ones. on: by keyed track, which times of the grid (K,) it
    has. strain: (P,) the error of each point, as a share of what it may be. own: (G,) the same
    for bounds on each track by itself. size: bytes.
    """

    plan: Plan
    fates: Ints
    keys: Mapping[int, Stored]
    on: Mapping[int, Bools]
    strain: Floats
    own: Floats
    size: float

    @property
    def worst(self) -> float:
        """The largest share of any bound; up to 1 all hold."""
        return max(float(self.strain.max(initial=0.0)), float(self.own.max(initial=0.0)))


class Bench:
    """Tries plans for one clip: what does not change from trial to trial is prepared once.

    allowed: (P,) m that each point may be off. droppable: (G,) which tracks may go. shared: per track, values that
    other clips hold it at, the best first.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        truth: Truth,
        points: Points,
        allowed: Floats,
        coding: Coding,
        droppable: Bools,
        shared: Sequence[Sequence[Floats]],
        bounds: Bounds,
    ) -> None:
        self.truth = truth
        self._skeleton = skeleton
        self._points = points
        self._rows = points.rows()
        self._allowed = allowed
        self._coding = coding
        self._droppable = droppable
        self._bounds = bounds
        self._nodes = np.array([each.node for each in truth.moving], np.int64)
        self._paths = np.array([PATHS.index(each.path) for each in truth.moving], np.int64)
        self._meters = np.array([each.meters for each in truth.moving])
        self._from_rest = np.array([each.from_rest for each in truth.moving])
        self._from_middle = np.array([each.from_middle for each in truth.moving])
        self._rest = [_rest(truth, path) for path in PATHS]
        self._shared = [_near(each, values) for each, values in zip(truth.moving, shared, strict=True)]
        self._layouts = Layouts(truth, coding, bounds.max_error)
        self._candidates = Candidates(truth, coding.packing)

    def run(self, plan: Plan, *, smaller_than: float = math.inf) -> Outcome:
        """Return what comes of a plan.

        Players that mix rotations by components are asked only where the outcome is otherwise good, and has fewer
        bytes than `smaller_than`.
        """
        fates = self._fates(plan)
        shown = [part.copy() for part in self.truth.local]
        keys = self._held(fates, plan, shown)
        axes = self._layouts.axes(plan.axes, np.flatnonzero(fates == Fate.KEYED), plan.budgets)
        misses = (OF_STORING * plan.budgets * plan.coarser / np.maximum(self._meters, 1e-30)).tolist()
        for axis in axes:
            for i, candidate in self._candidates.of(axis, misses):
                keys[i] = candidate.stored
                shown[self._paths[i]][self._nodes[i]] = candidate.shown
        on = {i: axis.keys for axis in axes for i in axis.members}
        size = self._size(fates, keys, axes)
        outcome = Outcome(plan, fates, keys, on, self._strain(shown, self.truth.columns), self._own(shown), size)
        if outcome.worst > 1 or size >= smaller_than or not self._chords_matter(axes, keys):
            return outcome
        return replace(outcome, strain=np.maximum(outcome.strain, self._chord_strain(axes, keys, shown)))

    def _fates(self, plan: Plan) -> Ints:
        allowance = np.maximum(PATIENCE * plan.budgets, plan.threshold)
        fates = np.full(len(allowance), Fate.KEYED, np.int64)
        fates[self._from_middle <= allowance] = Fate.HELD
        fates[(self._from_rest <= allowance) & self._droppable] = Fate.DROPPED
        return fates

    def _held(self, fates: Ints, plan: Plan, shown: list[Floats]) -> dict[int, Stored]:
        """Single keys of held tracks; they, and the rest values of dropped ones, are put into `shown`."""
        for path, rest in enumerate(self._rest):
            gone = np.flatnonzero((fates == Fate.DROPPED) & (self._paths == path))
            shown[path][self._nodes[gone]] = rest[gone][:, None]
        keys = {}
        for i in np.flatnonzero(fates == Fate.HELD).tolist():
            keys[i] = coding.held(self._value(i, max(PATIENCE * plan.budgets[i], plan.threshold)))
            shown[self._paths[i]][self._nodes[i]] = keys[i].values[0]
        return keys

    def _value(self, i: int, allowance: float) -> Floats:
        """Where to hold a track: as other clips do, else at rest, else in the middle."""
        each = self.truth.moving[i]
        for value, off in self._shared[i]:
            if off <= allowance:
                return value
        return each.rest if each.from_rest <= allowance else each.middle

    def _strain(self, shown: list[Floats], columns: Floats) -> Floats:
        world = worlds(self._skeleton, (shown[0], shown[1], shown[2]), self.truth.levels)
        moved = self._rows.moves(stacked(world, self._points.nodes) - columns)
        strain = np.sqrt((moved * moved).sum(axis=-1).max(axis=1)) / self._allowed
        if self._bounds.max_speed_error is not None and len(self.truth.at) > 1:
            gaps = np.maximum(np.diff(self.truth.at), LEAST_GAP).astype(np.float32)
            speeds = np.diff(moved, axis=1) / gaps[:, None]
            fastest = np.sqrt((speeds * speeds).sum(axis=-1).max(axis=1))
            strain = np.maximum(strain, fastest / self._bounds.max_speed_error)
        return np.asarray(strain, np.float64)

    def _own(self, shown: list[Floats]) -> Floats:
        """What share of the bound on angles each track (G,) takes: turns of all nodes above add up."""
        own = np.zeros(len(self._nodes))
        if self._bounds.max_angle is None:
            return own
        turned = quaternion.angle_between(shown[1], self.truth.local[1]).max(axis=1)  # (N,)
        parents = self._skeleton.parents
        for level in self.truth.levels[1:]:
            turned[level] += turned[parents[level]]
        for level in reversed(self.truth.levels[1:]):
            np.maximum.at(turned, parents[level], turned[level])
        rotations = self._paths == 1
        own[rotations] = turned[self._nodes[rotations]] / self._bounds.max_angle
        return own

    def _chords_matter(self, axes: list[Axis], keys: dict[int, Stored]) -> bool:
        for axis in axes:
            for i in axis.members:
                if self._paths[i] == 1:
                    gap = play.apart(play.steps(keys[i].values).max(initial=0.0)) / 2
                    if gap * self._meters[i] > CHORDS_NOTICED * self._bounds.max_error:
                        return True
        return False

    def _chord_strain(self, axes: list[Axis], keys: dict[int, Stored], shown: list[Floats]) -> Floats:
        for axis in axes:
            members = [i for i in axis.members if self._paths[i] == 1]
            if members:
                mixed = self._candidates.by_chords(axis, [keys[i] for i in members])
                shown[1][self._nodes[members]] = np.swapaxes(mixed, 0, 1)
        return self._strain(shown, self.truth.by_chord)

    def _size(self, fates: Ints, keys: dict[int, Stored], axes: list[Axis]) -> float:
        prices = self._coding.prices
        text = prices.track * (fates == Fate.KEYED).sum() + prices.held * (fates == Fate.HELD).sum()
        times = sum(prices.axis + self._coding.time_bytes * axis.keys.sum() for axis in axes)
        moving = [keys[i] for axis in axes for i in axis.members]
        return float(text + times + self._coding.size(moving))


def _rest(truth: Truth, path: str) -> Floats:
    """The rest values (G, C) of the tracks of a path; 0 for all others."""
    width = next((len(each.rest) for each in truth.moving if each.path == path), 1)
    return np.array([each.rest if each.path == path else np.zeros(width) for each in truth.moving]).reshape(-1, width)


def _near(track: Moving, values: Sequence[Floats]) -> list[tuple[Floats, float]]:
    """Each value with how far, in metres, the track is off it at most."""
    found = []
    for value in values:
        if track.path == "rotation" and track.values[0] @ value < 0:
            value = -value
        found.append((value, float(np.linalg.norm(track.values - value, axis=1).max()) * track.meters))
    return found

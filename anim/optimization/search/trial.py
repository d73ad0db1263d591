"""Decisions of a trial in one clip: which tracks get keys, on which time axes, and within which tolerance."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import quaternion
from anim.optimization.search.axis_merging import SharedAxis
from anim.optimization.search.plan import Plan, RotationTarget, TrackAction, TrialResult
from anim.optimization.search.size_estimate import SizeEstimate
from anim.optimization.search.source_analysis import farthest
from anim.optimization.search.source_motion import PATHS, SourceMotion
from anim.optimization.search.time_axes import TimeAxisSearch
from anim.optimization.search.trial_cache import TrialCache
from anim.optimization.tracks.quantization import Encoding

CONSTANT_BUDGET_FACTOR = 1.5  # times a track's budget: tolerance for dropping it, or for a single key
QUANTIZATION_BUDGET_FRACTION = 0.5  # of a budget


class Trial(NamedTuple):
    """A plan to try. limit: bytes; a result that takes as many is not measured, and there is none.

    smaller_than: bytes; component-wise interpolation is measured only for results of fewer, within the bounds.
    """

    plan: Plan
    limit: float = math.inf
    smaller_than: float = math.inf


class Decisions(NamedTuple):
    """Decisions of a trial.

    actions: (G,). tolerances: (G,) for storage, in units of values. constants: the value of each constant track. name:
    equal for trials with equal results.
    """

    trial: Trial
    actions: Ints
    axes: list[SharedAxis]
    tolerances: Floats
    constants: dict[int, Floats]
    name: Hashable


class ClipTrials:
    """Data that all trials of one clip share.

    bound: m. droppable: (G,) mask of the tracks that may be dropped. shared: per track, constants of other clips, the
    most frequent first. num_clips: that are searched together, and share memory.
    """

    def __init__(
        self,
        source: SourceMotion,
        coding: Encoding,
        bound: float,
        droppable: Bools,
        shared: Sequence[Sequence[Floats]],
        *,
        num_clips: int = 1,
    ) -> None:
        self.bound = bound
        self.meters = np.array([each.meters for each in source.moving])
        self.sizes = SizeEstimate(source, coding)
        self.layouts = TimeAxisSearch(source, coding, bound)
        self.results = TrialCache(num_clips)
        self._droppable = droppable
        self._from_rest = np.array([each.from_rest for each in source.moving])
        self._from_middle = np.array([each.from_middle for each in source.moving])
        self._constants = _constant_errors(source, shared)

    def actions(self, plan: Plan) -> Ints:
        """Return the treatment (G,) of each track."""
        allowance = np.maximum(CONSTANT_BUDGET_FACTOR * plan.budgets, plan.threshold)
        actions = np.full(len(allowance), TrackAction.KEYED, np.int64)
        actions[self._from_middle <= allowance] = TrackAction.CONSTANT
        actions[(self._from_rest <= allowance) & self._droppable] = TrackAction.DROPPED
        return actions

    def decide(self, trial: Trial, actions: Ints, axes: list[SharedAxis]) -> Decisions | TrialResult | None:
        """Return the decisions of a trial; the result, or None, if it is known without playing the clip."""
        plan = trial.plan
        tolerances = storage_tolerances(plan, self.meters)
        listed = tolerances.tolist()
        if self.sizes.min_size(actions, axes, listed) >= trial.limit:
            return None
        chosen = self._choose_constants(actions, plan)
        name = self._name(plan.rotation_target, actions, chosen, axes, listed)
        known = self.results.get(name)
        if known is not None and (known.worst > 1 or known.size >= trial.smaller_than):
            return None if known.size >= trial.limit else replace(known, plan=plan)
        constants = {i: self._constants[i][number][0] for i, number in chosen.items()}
        return Decisions(trial, actions, axes, tolerances, constants, name)

    def _choose_constants(self, actions: Ints, plan: Plan) -> dict[int, int]:
        """The number of the value of each constant track: of other clips, else the rest value, else the middle."""
        constant = np.flatnonzero(actions == TrackAction.CONSTANT)
        allowances = np.maximum(CONSTANT_BUDGET_FACTOR * plan.budgets[constant], plan.threshold)
        return {
            i: next((n for n, (_, error) in enumerate(self._constants[i]) if error <= allowance), -1)
            for i, allowance in zip(constant.tolist(), allowances.tolist(), strict=True)
        }

    def _name(
        self,
        target: RotationTarget,
        actions: Ints,
        constants: dict[int, int],
        axes: Sequence[SharedAxis],
        tolerances: Sequence[float],
    ) -> Hashable:
        """A value that is equal for trials with equal results."""
        return (
            target,
            actions.tobytes(),
            tuple(constants.values()),
            tuple((axis.keys.tobytes(), axis.members) for axis in axes),
            tuple(self.sizes.storage_level(i, tolerances[i]) for axis in axes for i in axis.members),
        )


def storage_tolerances(plan: Plan, meters: Floats) -> Floats:
    """Return the tolerance (G,) of each track's storage, in units of its values. meters: (G,) per unit."""
    return np.asarray(QUANTIZATION_BUDGET_FRACTION * plan.budgets * plan.coarser / np.maximum(meters, 1e-30))


def _constant_errors(source: SourceMotion, shared: Sequence[Sequence[Floats]]) -> list[list[tuple[Floats, float]]]:
    """For each track the `shared` values with its largest distance from each, in metres; then rest and middle."""
    found: list[list[tuple[Floats, float]]] = [[] for _ in source.moving]
    for path in PATHS:
        pairs = [(i, value) for i, each in enumerate(source.moving) if each.path == path for value in shared[i]]
        if not pairs:
            continue
        tracks = [source.moving[i] for i, _ in pairs]
        moved, values = np.array([each.values for each in tracks]), np.array([value for _, value in pairs])
        if path == "rotation":
            values = np.where(quaternion.dot(moved[:, 0], values)[:, None] < 0, -values, values)
        errors = np.sqrt(farthest(moved, values)) * np.array([each.meters for each in tracks])
        for (i, _), value, error in zip(pairs, values, errors.tolist(), strict=True):
            found[i].append((value, error))
    for constants, each in zip(found, source.moving, strict=True):
        constants += [(each.rest, each.from_rest), (each.middle, each.from_middle)]
    return found

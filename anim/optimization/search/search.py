"""Search for the smallest version of a clip within its bounds: budgets per track, with error feedback."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.optimization.options import Effort
from anim.optimization.search.plan import Groups, Plan, RotationTarget, TrialResult
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.time_axes import GROUPING_LAYOUTS
from anim.optimization.search.trial import Trial
from anim.optimization.tracks import quantization

INITIAL_BUDGET_FRACTION = 1 / 3  # of the bound, for every track
TARGET_USAGE = 0.97  # of the bound; target of the feedback
FEEDBACK_EXPONENT = 0.6  # of target / usage, applied to budgets
BUDGET_FACTOR_RANGE = (0.5, 1.8)  # limits of a budget's change per round
SHRINK_FACTOR = 0.6
MAX_TRACK_TRIALS = 500_000  # tracks × trials of a pass that changes one track at a time, about 5 s
MAX_FORESEEN_USAGE = 1.05  # predicted bound usage up to which coarser storage is tried
MAX_BUDGET_PER_BOUND = 4.0  # larger budgets save nothing more
INT16_COARSENING = 1e3  # factor on the storage tolerance that selects integers
SEED = 2026
LOG_DEVIATIONS = (0.25, 0.05)  # of random changes, in natural logarithms: initial and minimum
CHANGED_TRACK_FRACTION = 0.3  # of tracks, per random change
REGROUPED_FRACTION = 0.2  # of random changes, for which new groups of tracks are found
MIN_SHRINK = 1e-6  # of the initial budget; below it the storage is the limit


Search: TypeAlias = Generator[Trial, TrialResult | None, TrialResult | None]
Step: TypeAlias = Generator[Trial, TrialResult | None, None]


def search(
    source: SourceMotion, bound: float, effort: Effort, leeway: Callable[[], Floats], groups: Groups = ()
) -> Search:
    """Yield trials of one clip, of which it takes the results; return the smallest within all bounds, None without one.

    bound: m, only for the size of budgets; acceptance depends on the result's bound usage. leeway: the ratio of each
    track's moment arm to the compensated one (G,). groups: of tracks that share a time axis, if any, unless only source
    keys hold the bounds.
    """
    return _Search(source, bound, effort, leeway, groups).run()


class _Search:
    def __init__(
        self, source: SourceMotion, bound: float, effort: Effort, leeway: Callable[[], Floats], groups: Groups
    ) -> None:
        self._source = source
        self._bound = bound
        self._groups = groups
        self._effort = replace(effort, axes=(), groups=()) if groups else effort
        self._find_leeway = leeway
        self._best: TrialResult | None = None

    def run(self) -> Search:
        yield from self._find_first()
        for _ in range(self._effort.cycles if self._best else 0):
            before = self._best
            yield from self._run_cycle()
            if self._best is before:
                break
        return self._best

    def _find_first(self) -> Step:
        tracks = len(self._source.moving)
        start = Plan(np.full(tracks, INITIAL_BUDGET_FRACTION * self._bound), 0.0, "merged", np.ones(tracks))
        if self._groups:
            start = replace(start, axes="groups", groups=self._groups)
        yield from self._adapt(start, self._effort.rounds)
        if self._best is None and not self._source.own.all():
            start = replace(start, axes="own", groups=())
            yield from self._adapt(start, self._effort.rounds)
        if self._best is None:
            for fraction in self._effort.thresholds:
                yield from self._adapt(replace(start, threshold=fraction * self._bound), self._effort.rounds)
        if self._best is None:
            yield from self._shrink(start)

    def _run_cycle(self) -> Step:
        """Try every kind of change in turn, each on the best result so far."""
        assert self._best is not None
        yield from self._share_axes()
        for fraction in self._effort.thresholds:
            plan = replace(self._best.plan, threshold=fraction * self._bound)
            yield from self._adapt(replace(plan, budgets=0.9 * plan.budgets), self._effort.rounds)
        yield from self._favor_long()
        for axes in self._effort.axes:
            yield from self._adapt(replace(self._best.plan, axes=axes), max(self._effort.rounds // 2, 2))
        yield from self._compensate_parents()
        yield from self._finish()
        yield from self._coarsen_each()

    def _share_axes(self) -> Step:
        """Try groups of tracks whose axes have the keys that all of them require together.

        Groups stay during the feedback, and the next ones are found under its budgets.
        """
        assert self._best is not None
        plan = self._best.plan
        for name in self._effort.groups:
            first = yield from self._measure(replace(plan, axes=name, groups=()))
            plan = replace(_with_groups(first).plan, budgets=self._next_budgets(plan.budgets, first))
            plan = yield from self._adapt(plan, self._effort.rounds - 1)

    def _favor_long(self) -> Step:
        """Try larger budgets for tracks with many bytes.

        The number of keys n falls about as budget^-½, so that the sum of bytes under a fixed sum of budgets is least
        for budgets proportional to n^⅔.
        """
        assert self._best is not None
        plan = self._best.plan
        lengths = np.zeros(len(plan.budgets))
        for i in self._best.on:
            lengths[i] = self._best.keys[i].values.size
        mean = lengths[lengths > 0].mean() if lengths.any() else 1.0
        fraction = np.where(lengths > 0, lengths / mean, 1.0)
        yield from self._adapt(
            replace(plan, budgets=plan.budgets * fraction ** (2 / 3)), self._effort.long_track_rounds
        )

    def _compensate_parents(self) -> Step:
        """Try world-space compensation, with increasing budgets for tracks with a long moment arm."""
        for fraction in self._effort.leeways:
            before = self._best
            assert before is not None
            plan = replace(
                before.plan,
                rotation_target=RotationTarget.WORLD,
                budgets=before.plan.budgets * self._find_leeway() ** fraction,
            )
            yield from self._adapt(plan, self._effort.rounds)
            if self._best is before:
                break

    def _attempt(self, plan: Plan) -> Step:
        """Try a plan; it is measured only if it takes fewer bytes than the best."""
        limit = math.inf if self._best is None else self._best.size
        outcome = yield Trial(plan, limit=limit)
        if outcome is not None:
            self._keep_smaller(outcome)

    def _measure(self, plan: Plan) -> Generator[Trial, TrialResult | None, TrialResult]:
        """Try a plan, and return its result."""
        outcome = yield Trial(plan, smaller_than=math.inf if self._best is None else self._best.size)
        assert outcome is not None
        self._keep_smaller(outcome)
        return outcome

    def _keep_smaller(self, outcome: TrialResult) -> None:
        if outcome.worst <= 1 and (self._best is None or outcome.size < self._best.size):
            self._best = outcome if self._groups else _with_groups(outcome)

    def _adapt(self, plan: Plan, rounds: int) -> Generator[Trial, TrialResult | None, Plan]:
        """Try a plan, adjust each budget by the usage of the points it moves, and repeat; return the last plan.

        Budgets only fall before the last trial: what grew would be over the bound as often as within it.
        """
        for left in range(rounds - 1, 0, -1):
            outcome = yield from self._measure(plan)
            largest = BUDGET_FACTOR_RANGE[1] if left > 1 else 1.0
            plan = replace(plan, budgets=self._next_budgets(plan.budgets, outcome, largest))
        if rounds:
            yield from self._attempt(plan)
        return plan

    def _next_budgets(
        self, budgets: Floats, outcome: TrialResult, largest_factor: float = BUDGET_FACTOR_RANGE[1]
    ) -> Floats:
        source = self._source
        usage = source.answering.largest(outcome.usage, [each.node for each in source.moving])
        usage = np.maximum(usage, outcome.own)
        factor = np.clip(
            (TARGET_USAGE / np.maximum(usage, 1e-9)) ** FEEDBACK_EXPONENT, BUDGET_FACTOR_RANGE[0], largest_factor
        )
        gain = self._find_leeway() if outcome.plan.rotation_target is RotationTarget.WORLD else 1.0
        return np.asarray(np.minimum(budgets * factor, MAX_BUDGET_PER_BOUND * self._bound * gain))

    def _shrink(self, plan: Plan) -> Step:
        """Reduce budgets until all bounds hold."""
        factor = SHRINK_FACTOR
        while self._best is None and factor > MIN_SHRINK:
            yield from self._attempt(replace(plan, budgets=plan.budgets * factor))
            factor *= SHRINK_FACTOR

    def _finish(self) -> Step:
        """Try slightly larger budgets, other storage formats, and random changes."""
        assert self._best is not None
        plan = self._best.plan
        for factor in self._effort.finishing:
            yield from self._attempt(replace(plan, budgets=plan.budgets * factor))
        yield from self._store_coarser()
        yield from self._random_trials(self._effort.random_trials)
        yield from self._regroup()

    def _regroup(self) -> Step:
        """Try new groups of tracks under the best result's budgets."""
        assert self._best is not None
        for name in self._effort.groups:
            yield from self._attempt(replace(self._best.plan, axes=name, groups=()))

    def _coarsen_each(self) -> Step:
        """Try coarser storage, track by track."""
        for _ in range(self._effort.coarsen_passes):
            before = self._best
            assert before is not None
            for i in sorted(before.on, key=lambda i: -_length(self._best, i))[: self._max_single_trials]:
                if self._may_be_coarser(i):
                    yield from self._attempt(self._coarser(i, 2.0))
            if self._best is before:
                break

    def _may_be_coarser(self, track: int) -> bool:
        """Return whether twice the storage error is predicted to fit; the stored error is half its tolerance."""
        assert self._best is not None
        source = self._source
        used = float(source.answering.largest(self._best.usage, [source.moving[track].node])[0])
        gain = self._find_leeway()[track] if self._best.plan.rotation_target is RotationTarget.WORLD else 1.0
        miss = self._best.keys[track].error
        return miss > 0 and used + miss * source.moving[track].meters / gain / 2 / self._bound < MAX_FORESEEN_USAGE

    def _store_coarser(self) -> Step:
        """Try integers for each rotation stored as float32."""
        assert self._best is not None
        for i, stored in sorted(self._best.keys.items())[: self._max_single_trials]:
            if (
                stored.form == "float32"
                and len(stored.values) > quantization.MAX_FLOAT32_KEYS
                and stored.values.shape[1] == 4
            ):
                yield from self._attempt(self._coarser(i, INT16_COARSENING))

    @property
    def _max_single_trials(self) -> int:
        """Maximum number of trials in a pass that change one track each: a trial takes time for all tracks."""
        return MAX_TRACK_TRIALS // max(len(self._source.moving), 1)

    def _coarser(self, track: int, factor: float) -> Plan:
        assert self._best is not None
        coarser = self._best.plan.coarser.copy()
        coarser[track] *= factor
        return replace(self._best.plan, coarser=coarser)

    def _random_trials(self, count: int) -> Step:
        """Try random changes of some budgets, smaller after failures; the seed is fixed."""
        if not count:
            return  # numpy's random numbers are not imported
        chance = np.random.default_rng(SEED)
        spread, names = LOG_DEVIATIONS[0], self._effort.groups
        for _ in range(count):
            best = self._best
            assert best is not None
            tracks = len(best.plan.budgets)
            changes = spread * chance.standard_normal(tracks) * (chance.random(tracks) < CHANGED_TRACK_FRACTION)
            plan = replace(best.plan, budgets=best.plan.budgets * np.exp(changes))
            if names and plan.groups and chance.random() < REGROUPED_FRACTION:
                plan = replace(plan, axes=names[int(chance.integers(len(names)))], groups=())
            yield from self._attempt(plan)
            spread = spread * 1.3 if self._best is not best else max(0.96 * spread, LOG_DEVIATIONS[1])


def _with_groups(outcome: TrialResult) -> TrialResult:
    """The result with a plan that keeps the groups that it found, if any."""
    if outcome.plan.axes not in GROUPING_LAYOUTS:
        return outcome
    return replace(outcome, plan=replace(outcome.plan, axes="groups", groups=outcome.groups))


def _length(outcome: TrialResult | None, track: int) -> int:
    return len(outcome.keys[track].values) if outcome and track in outcome.keys else 0

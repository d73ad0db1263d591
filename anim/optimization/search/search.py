"""The cheapest way found to write one clip within its bounds: budgets per track, fed back from the measured error."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.optimization.options import Effort
from anim.optimization.search.plan import Plan, RotationTarget, TrialResult
from anim.optimization.search.trial import TrialRunner
from anim.optimization.tracks import quantization

START = 1 / 3  # of the bound: the first budget of every track
TARGET_USAGE = 0.97  # of the bound, that budgets are steered to
GAIN = 0.6  # how strongly a budget follows the error it led to
STEPS = (0.5, 1.8)  # least and greatest change of a budget from round to round
SHRINK = 0.6
FORESEEN = 1.05  # strain up to which coarser storage is tried
MAX_SCALE = 4.0  # of the bound; larger budgets leave nothing more to gain
ENOUGH = 1e3  # times what storing may miss, so that integers are taken
SEED = 2026
SPREAD = (0.25, 0.05)  # standard deviation of the logarithm of random changes: the first, and the least
STRAYING = 0.3  # share of tracks changed at a time
MIN_STEP = 1e-6  # of the bound; smaller budgets mean that storage can't do better


def search(bench: TrialRunner, bound: float, effort: Effort) -> TrialResult | None:
    """Return the smallest outcome found that keeps all bounds; None where none does.

    bound: m, for the size of budgets only; what counts is the outcome's own strain.
    """
    return _Search(bench, bound, effort).run()


class _Search:
    def __init__(self, bench: TrialRunner, bound: float, effort: Effort) -> None:
        self._bench = bench
        self._bound = bound
        self._effort = effort
        self._best: TrialResult | None = None

    def run(self) -> TrialResult | None:
        self._begin()
        for _ in range(self._effort.cycles if self._best else 0):
            before = self._best
            self._go_round()
            if self._best is before:
                break
        return self._best

    def _begin(self) -> None:
        tracks = len(self._bench.truth.moving)
        start = Plan(np.full(tracks, START * self._bound), 0.0, "merged", np.ones(tracks))
        self._adapt(start, self._effort.rounds)
        if self._best is None and not self._bench.truth.own.all():
            start = replace(start, axes="own")
            self._adapt(start, self._effort.rounds)
        if self._best is None:
            for share in self._effort.thresholds:
                self._adapt(replace(start, threshold=share * self._bound), self._effort.rounds)
        if self._best is None:
            self._shrink(start)

    def _go_round(self) -> None:
        """Every kind of change, one after the other, each on top of the best so far."""
        assert self._best is not None
        for share in self._effort.thresholds:
            plan = replace(self._best.plan, threshold=share * self._bound)
            self._adapt(replace(plan, budgets=0.9 * plan.budgets), self._effort.rounds)
        self._favor_long()
        for axes in self._effort.axes:
            self._adapt(replace(self._best.plan, axes=axes), max(self._effort.rounds // 2, 2))
        self._compensate_parents()
        self._finish()
        self._descend()

    def _favor_long(self) -> None:
        """Larger budgets for tracks with many bytes: n keys fall about as budget^-½, so least bytes in all for what
        budgets in a row add up to asks for budgets that grow as n^⅔."""
        assert self._best is not None
        plan = self._best.plan
        lengths = np.zeros(len(plan.budgets))
        for i in self._best.on:
            lengths[i] = self._best.keys[i].values.size
        mean = lengths[lengths > 0].mean() if lengths.any() else 1.0
        share = np.where(lengths > 0, lengths / mean, 1.0)
        self._adapt(replace(plan, budgets=plan.budgets * share ** (2 / 3)), self._effort.long_track_rounds)

    def _compensate_parents(self) -> None:
        """Rotations that make up for each other, and more and more room for those that reach far."""
        for share in self._effort.leeways:
            before = self._best
            assert before is not None
            plan = replace(
                before.plan,
                rotation_target=RotationTarget.WORLD,
                budgets=before.plan.budgets * self._bench.leeway**share,
            )
            self._adapt(plan, self._effort.rounds)
            if self._best is before:
                break

    def _attempt(self, plan: Plan) -> TrialResult:
        limit = math.inf if self._best is None else self._best.size
        outcome = self._bench.run(plan, smaller_than=limit)
        if outcome.worst <= 1 and (self._best is None or outcome.size < self._best.size):
            self._best = outcome
        return outcome

    def _adapt(self, plan: Plan, rounds: int) -> None:
        """Try, let each budget follow what the points that answer for it showed, and try again."""
        for number in range(rounds):
            outcome = self._attempt(plan)
            if number + 1 < rounds:
                plan = replace(plan, budgets=self._followed(plan.budgets, outcome))

    def _followed(self, budgets: Floats, outcome: TrialResult) -> Floats:
        answering = self._bench.truth.answering
        strain = np.where(answering, outcome.usage, 0.0).max(axis=1, initial=0.0)
        strain = np.maximum(strain, outcome.own)
        factor = np.clip((TARGET_USAGE / np.maximum(strain, 1e-9)) ** GAIN, *STEPS)
        room = self._bench.leeway if outcome.plan.rotation_target is RotationTarget.WORLD else 1.0
        return np.asarray(np.minimum(budgets * factor, MAX_SCALE * self._bound * room))

    def _shrink(self, plan: Plan) -> None:
        """Smaller and smaller budgets until something holds."""
        factor = SHRINK
        while self._best is None and factor > MIN_STEP:
            self._attempt(replace(plan, budgets=plan.budgets * factor))
            factor *= SHRINK

    def _finish(self) -> None:
        """A little more for every track, another form for some, and then chance."""
        assert self._best is not None
        plan = self._best.plan
        for factor in self._effort.finishing:
            self._attempt(replace(plan, budgets=plan.budgets * factor))
        self._store_coarser()
        self._random_trials(self._effort.random_trials)

    def _descend(self) -> None:
        """Coarser storage for one track after the other."""
        for _ in range(self._effort.coarsen_passes):
            before = self._best
            assert before is not None
            for i in sorted(before.on, key=lambda i: -_length(self._best, i)):
                if self._may_be_coarser(i):
                    self._attempt(self._coarser(i, 2.0))
            if self._best is before:
                break

    def _may_be_coarser(self, track: int) -> bool:
        """Whether there seems to be room for missing the double: what is stored misses half of what it may."""
        assert self._best is not None
        truth = self._bench.truth
        used = float(self._best.usage[truth.answering[track]].max(initial=0.0))
        room = self._bench.leeway[track] if self._best.plan.rotation_target is RotationTarget.WORLD else 1.0
        miss = self._best.keys[track].error
        return miss > 0 and used + miss * truth.moving[track].meters / room / 2 / self._bound < FORESEEN

    def _store_coarser(self) -> None:
        """Rotations kept as float32 for the sake of their budget, one by one as integers."""
        assert self._best is not None
        for i, stored in sorted(self._best.keys.items()):
            if stored.form == "float32" and len(stored.values) > quantization.FEW and stored.values.shape[1] == 4:
                self._attempt(self._coarser(i, ENOUGH))

    def _coarser(self, track: int, factor: float) -> Plan:
        assert self._best is not None
        coarser = self._best.plan.coarser.copy()
        coarser[track] *= factor
        return replace(self._best.plan, coarser=coarser)

    def _random_trials(self, count: int) -> None:
        """Budgets of some tracks changed at random, by less where nothing is found; always the same random numbers."""
        chance = np.random.default_rng(SEED)
        spread = SPREAD[0]
        for _ in range(count):
            best = self._best
            assert best is not None
            tracks = len(best.plan.budgets)
            changes = spread * chance.standard_normal(tracks) * (chance.random(tracks) < STRAYING)
            self._attempt(replace(best.plan, budgets=best.plan.budgets * np.exp(changes)))
            spread = spread * 1.3 if self._best is not best else max(0.96 * spread, SPREAD[1])


def _length(outcome: TrialResult | None, track: int) -> int:
    return len(outcome.keys[track].values) if outcome and track in outcome.keys else 0

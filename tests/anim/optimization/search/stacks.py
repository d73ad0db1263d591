"""Clips of several lengths and of different tracks, stacked, and what trials of them are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.model import Clip, Scene
from anim.optimization.options import Bounds
from anim.optimization.search.bound_usage import BoundUsage
from anim.optimization.search.plan import Plan, TrialResult
from anim.optimization.search.segment_errors import SegmentErrors, Tabulated, tabulate
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.stacked_clips import StackedClips
from anim.optimization.search.trial import ClipTrials, Trial
from anim.optimization.search.trial_batch import TrialBatch
from anim.optimization.tracks.quantization import Encoding
from tests.anim.optimization.making import CORE, every_point, nodding, scene, stepping, truth_of, waving

OF = scene()
POINTS = every_point(OF)
BOUND = 0.02  # m
CLIPS = (nodding(), waving(), stepping())  # a shorter and a longer one beside it, of other tracks


def table_of(values: Floats, times: Floats, limit: float) -> SegmentErrors:
    """The segment errors of one clip's tracks (G, K, C)."""
    return tabulate([Tabulated(values, times, limit)])[0]


def stack(*clips: Clip, of: Scene = OF) -> StackedClips:
    """Clips of a scene, all of their tracks free."""
    points = every_point(of)
    return StackedClips(of.skeleton, [truth_of(of, each, points) for each in clips], points)


class Bench(NamedTuple):
    """Clips to try plans in."""

    clips: StackedClips
    trials: list[ClipTrials]
    batch: TrialBatch

    @property
    def sources(self) -> Sequence[SourceMotion]:
        return self.clips.sources

    def plan(self, clip: int = 0, budget: float = BOUND / 3, **more: Any) -> Plan:
        """A plan for one of the clips."""
        count = len(self.sources[clip].moving)
        return replace(Plan(np.full(count, budget), 0.0, "merged", np.ones(count)), **more)

    def attempt(self, plan: Plan, clip: int = 0, **limits: float) -> TrialResult | None:
        """The result of a plan in one clip; None where it is not smaller than `limit`."""
        (found,) = self.batch.run([(clip, Trial(plan, **limits))])
        return found

    def run(self, plan: Plan, clip: int = 0, *, smaller_than: float = math.inf) -> TrialResult:
        """The result of a plan in one clip."""
        found = self.attempt(plan, clip, smaller_than=smaller_than)
        assert found is not None
        return found


def bench(
    *clips: Clip,
    bound: float = BOUND,
    bounds: Bounds | None = None,
    droppable: bool = True,
    shared: Floats | None = None,
    coding: Encoding = CORE,
    of: Scene = OF,
) -> Bench:
    """Clips to try plans in. shared: the constant that other clips use, of every track."""
    stacked = stack(*clips, of=of)
    values: list[Sequence[Floats]] = [() if shared is None else (shared,)]
    trials = []
    for source in stacked.sources:
        count = len(source.moving)
        trials.append(ClipTrials(source, coding, bound, np.full(count, droppable), values * count))
    allowed = np.full((len(stacked.points), len(clips)), bound)
    usage = BoundUsage(of.skeleton, stacked, allowed, bounds or Bounds(bound, 0.0))
    return Bench(stacked, trials, TrialBatch(of.skeleton, stacked, trials, usage, coding))

"""Searches of several clips side by side: each step tries one plan in every clip that is not finished."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats
from anim.model import Clip
from anim.optimization.options import Effort
from anim.optimization.search.bound_usage import BoundUsage
from anim.optimization.search.context import Context
from anim.optimization.search.plan import FoundKeys, Groups, TrialResult
from anim.optimization.search.search import Search, search
from anim.optimization.search.source_analysis import FreeTracks, analyze_sources
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.stacked_clips import StackedClips
from anim.optimization.search.trial import ClipTrials, Trial
from anim.optimization.search.trial_batch import CHORD_BOUND_FRACTION, TrialBatch


class ClipPart(NamedTuple):
    """A part of a long clip: all tracks with keys have one at its first and last time, with the source's values.

    grid: (K,) s, its possible key times. groups: of free tracks that share a time axis; empty to find them.
    """

    grid: Floats
    groups: Groups


class SearchRequest(NamedTuple):
    """A clip to search.

    free: indices of the tracks that may change. bound: m, error bound. spent: m, the part of it that other tracks use.
    droppable: (free tracks) whether each may be dropped. shared: per free track, constants of other clips, the most
    frequent first. extra: further points to measure, (index of the surface, index of the vertex). part: the part of a
    long clip to search, None for all of it.
    """

    clip: Clip
    free: tuple[int, ...]
    bound: float
    spent: float
    droppable: Bools
    shared: tuple[Sequence[Floats], ...]
    extra: frozenset[tuple[int, int]]
    part: ClipPart | None = None


class SearchResult(NamedTuple):
    """The best trial of a clip's search, with the motion that it approximates, as of `StackedClips.sources`."""

    source: SourceMotion
    result: TrialResult

    @property
    def found(self) -> FoundKeys:
        """The keys, without what else is known of the motion."""
        tracks = tuple(each.index for each in self.source.moving)
        return FoundKeys(self.source.grid, tracks, self.result.actions, self.result.keys, self.result.on)


def search_clips(context: Context, requests: Sequence[SearchRequest], effort: Effort) -> list[SearchResult | None]:
    """Return the result of each clip's search; None without one within all bounds."""
    clips = StackedClips(context.skeleton, _analyze(context, requests), context.points)
    trials = [
        ClipTrials(source, context.coding, each.bound, each.droppable, each.shared, num_clips=len(requests))
        for source, each in zip(clips.sources, requests, strict=True)
    ]
    allowed = np.tile([each.bound - each.spent for each in requests], (len(context.points), 1))
    usage = BoundUsage(context.skeleton, clips, allowed, context.bounds)
    batch = TrialBatch(context.skeleton, clips, trials, usage, context.coding)
    searches = [
        search(source, each.bound, effort, partial(batch.leeway, n), each.part.groups if each.part else ())
        for n, (source, each) in enumerate(zip(clips.sources, requests, strict=True))
    ]
    best = run_searches(batch, searches)
    return [
        None if result is None else SearchResult(source, result)
        for source, result in zip(clips.sources, best, strict=True)
    ]


def _analyze(context: Context, requests: Sequence[SearchRequest]) -> list[SourceMotion]:
    return analyze_sources(
        context.skeleton,
        [
            FreeTracks(each.clip, each.free, CHORD_BOUND_FRACTION * each.bound, each.part and each.part.grid)
            for each in requests
        ],
        context.points,
        context.answering,
        reference=context.policy.reference,
    )


def run_searches(batch: TrialBatch, searches: Sequence[Search]) -> list[TrialResult | None]:
    """Return the result of each clip's search, all of whose trials are run by the batch."""
    best: list[TrialResult | None] = [None] * len(searches)
    answers: dict[int, TrialResult | None] = dict.fromkeys(range(len(searches)))
    while answers:
        asked: list[tuple[int, Trial]] = []
        for n, answer in answers.items():
            try:
                asked.append((n, searches[n].send(answer)))
            except StopIteration as end:
                best[n] = end.value
        answers = dict(zip((n for n, _ in asked), batch.run(asked), strict=True))
    return best

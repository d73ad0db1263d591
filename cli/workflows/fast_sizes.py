"""Sizes of a file at several error bounds, by fast searches."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

from anim.optimization.optimize import sizes
from anim.optimization.options import Request
from anim.optimization.rate_distortion import FIRST_FRACTION, RatePoint, local_exponent
from cli.workflows.optimize_job import OptimizeJob, with_bound

FAST = "fast"  # effort of these searches
SAMPLE_STEP = 6  # one clip of so many measures sizes at other bounds than the first
MIN_SAMPLED = 12  # clips of a file; of fewer all are measured


class FastSizes:
    """Sizes of a job's output at any bound, each found on first use. request: with any bound."""

    def __init__(self, job: OptimizeJob, request: Request) -> None:
        self._job = job
        self._request = replace(request, effort=FAST)
        self._tried: dict[float, RatePoint] = {}  # by bound

    def at(self, max_error: float) -> RatePoint:
        """The size at a bound, in m, by a fast search without verification.

        Of files with many clips all are searched at one bound, and some at the others: sizes are in proportion.
        """
        if max_error not in self._tried:
            self._tried[max_error] = self._estimated(max_error)
        return self._tried[max_error]

    def _estimated(self, max_error: float) -> RatePoint:
        if max_error == FIRST_FRACTION * self._job.scale:
            return self.first[0]
        if max_error == 0.0 or len(self.sample) == len(self._job.chosen):
            return self._job.point(max_error, self._job.run(with_bound(self._request, max_error), verified=False))
        point, first = self.first
        request = with_bound(self._request, max_error)
        total = sum(first[i] for i in self.sample)
        found = sum(sizes(self._job.search(request, self.sample, verified=False), request).values())
        animation = round(point.animation * found / max(total, 1.0))
        return RatePoint(max_error, point.size - point.animation + animation, point.error, animation)

    @cached_property
    def first(self) -> tuple[RatePoint, dict[int, float]]:
        """The size at the usual bound by a fast search of all clips, and the bytes of each."""
        usual = FIRST_FRACTION * self._job.scale
        request = with_bound(self._request, usual)
        results = self._job.search(request, self._job.chosen, verified=False)
        found = self._job.run(request, verified=False, earlier=results)
        return self._job.point(usual, found), sizes(results, request)

    @cached_property
    def sample(self) -> list[int]:
        """Large clips and small ones, that measure sizes for all; of few clips all."""
        chosen = self._job.chosen
        if len(chosen) < MIN_SAMPLED:
            return list(chosen)
        values = {i: sum(track.values.size for track in self._job.clips[i].tracks) for i in chosen}
        return sorted(sorted(values, key=lambda i: -values[i])[::SAMPLE_STEP])

    def exponent(self, bound: float) -> float:
        """Return the exponent n around a bound, m, where bytes of animation are as bound^(-1/n)."""
        return local_exponent(bound, list(self._tried.values()))

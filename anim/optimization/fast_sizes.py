"""Sizes of a file at several error bounds, by fast searches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

from anim.measure.equal_clips import first_equal
from anim.optimization.clip_optimizer import ClipResult
from anim.optimization.file_optimizer import FAST, FileOptimizer
from anim.optimization.optimize import estimate_sizes
from anim.optimization.options import Request
from anim.optimization.rate_curve import RateCurve
from anim.optimization.rate_distortion import FIRST_FRACTION, RatePoint

SAMPLE_STEP = 6  # one clip of so many measures sizes at other bounds than the first
MIN_SAMPLED = 12  # different clips of a file; of fewer all are measured


class FastSizes:
    """Sizes of an optimized file at any bound, each found on first use. request: with any bound.

    originals: for each of the chosen clips, the index of the first one with equal tracks: the others share its data.
    clips: indices of the clips that differ. sample: of these, large ones and small ones, that stand for all.
    """

    def __init__(self, file: FileOptimizer, request: Request) -> None:
        self._file = file
        self._request = replace(request, effort=FAST)
        self._tried: dict[float, RatePoint] = {}  # by bound
        first = first_equal([(file.clips[i],) for i in file.chosen])
        self.originals = {i: file.chosen[k] for i, k in zip(file.chosen, first, strict=True)}
        self.clips = sorted(set(self.originals.values()))
        self.sample = self.clips
        if len(self.clips) >= MIN_SAMPLED:
            values = {i: sum(track.values.size for track in file.clips[i].tracks) for i in self.clips}
            self.sample = sorted(sorted(values, key=lambda i: -values[i])[::SAMPLE_STEP])

    def measure(self, max_error: float) -> RatePoint:
        """Return the size at a bound, in m, by a fast search without verification.

        Of files with many clips all are searched at one bound, and some at the others: sizes are in proportion.
        """
        if max_error not in self._tried:
            self._tried[max_error] = self._measured(max_error)
        return self._tried[max_error]

    def fitting_bound(self, max_bytes: int, *, above: float) -> float:
        """Return the smallest bound, m, that was tried and fits, above one; that one itself if there is none."""
        fitting = (bound for bound, point in self._tried.items() if bound > above and point.size <= max_bytes)
        return min(fitting, default=above)

    def curve(self) -> RateCurve:
        """Return the curve of bytes against the bound through all points that were measured so far."""
        return RateCurve(list(self._tried.values()))

    def expand(self, results: Mapping[int, ClipResult]) -> dict[int, ClipResult]:
        """Return the results of all clips from those that differ."""
        return {i: results[original] for i, original in self.originals.items()}

    @cached_property
    def first(self) -> tuple[RatePoint, dict[int, float]]:
        """The size at the usual bound by a fast search of all clips, and the bytes of each that differs."""
        usual = FIRST_FRACTION * self._file.scale
        request = self._request.with_bound(usual)
        results = self._file.search(request, self.clips, verified=False)
        found = self._file.run(request, verified=False, earlier=self.expand(results))
        return self._file.measure_point(usual, found), estimate_sizes(results, request)

    def _measured(self, max_error: float) -> RatePoint:
        if max_error == FIRST_FRACTION * self._file.scale:
            return self.first[0]
        request = self._request.with_bound(max_error)
        if max_error == 0.0 or self.sample == self.clips:
            return self._file.measure_point(max_error, self._file.run(request, verified=False))
        point, first = self.first
        total = sum(first[i] for i in self.sample)
        found = sum(estimate_sizes(self._file.search(request, self.sample, verified=False), request).values())
        animation = round(point.animation * found / max(total, 1.0))
        return RatePoint(max_error, point.size - point.animation + animation, point.error, animation)

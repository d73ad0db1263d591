"""Search for the smallest error within a byte limit: sizes by fast searches, then few full ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from anim.optimization.optimize import Optimized
from anim.optimization.options import Request
from anim.optimization.rate_distortion import (
    FIRST_FRACTION,
    MAX_BOUND_PER_DIAGONAL,
    RatePoint,
    bound_below,
    bound_between,
    next_bound,
    smallest_bound,
)
from anim.units import format_number, plural
from cli.errors import CheckError
from cli.reports import optimize_report
from cli.text import format_length
from cli.workflows.optimize_job import OptimizeJob, with_bound

FAST = "fast"  # effort of sizes that are tried
USUAL_RATIO = 0.96  # bytes of animation after a longer search, as a fraction of those after a fast one
RATIO_CLIPS = 8  # one clip of so many measures that ratio
SIZE_CLIPS = 3  # one clip of so many measures sizes at other bounds than the first
MIN_SIZE_CLIPS = 12  # of a file; of fewer all are measured
MAX_FULL_SEARCHES = 4  # until a result fits; the last one at the largest bound
MAX_UNUSED_FRACTION = 0.015  # of the animation's bytes; more are worth another search
MAX_REFINEMENTS = 3


@dataclass(frozen=True, slots=True)
class _Result:
    """A result with its size and error."""

    optimized: Optimized
    point: RatePoint


class ByteLimit:
    """A byte limit for the output of a job."""

    def __init__(self, job: OptimizeJob, max_bytes: int) -> None:
        self._job = job
        self._max_bytes = max_bytes
        self._tried: dict[float, tuple[RatePoint, Mapping[int, float]]] = {}

    def run(self, request: Request, *, ceiling: float | None) -> tuple[Request, Optimized]:
        """Return the request and the result with the smallest error that fits.

        ceiling: m, the greatest allowed error; None for a tenth of the diagonal. Raises CheckError if nothing fits.
        """
        most = MAX_BOUND_PER_DIAGONAL * self._job.scale if ceiling is None else ceiling
        bound = smallest_bound(
            self._max_bytes,
            self._job.scale,
            lambda max_error: self._estimate(request, max_error),
            lambda max_error: self._ratio(request, max_error),
            usual_ratio=1.0 if request.effort == FAST else USUAL_RATIO,
        )
        found = self._full_searches(request, most if bound is None else min(bound, most), most)
        best = min(filter(self._fits, found), key=lambda each: each.point.error, default=None)
        if best is None:
            found.append(self._search(replace(request, effort=FAST), most))  # no longer search fits
            if not self._fits(found[-1]):
                raise self._refusal([*(each.point for each in found), self._estimate(request, 0.0)], most)
            best = found[-1]
        return with_bound(request, best.point.max_error), best.optimized

    def _full_searches(self, request: Request, bound: float, most: float) -> list[_Result]:
        """Results of verified searches: at larger bounds until one fits, then at smaller ones while bytes are unused.

        Sizes jump in files of few keys, so that the first bound that fits can be far from the smallest.
        """
        found = [self._search(request, bound)]
        while not self._fits(found[-1]) and found[-1].point.max_error < most:
            point = found[-1].point
            is_last = len(found) == MAX_FULL_SEARCHES - 1
            larger = most if is_last else next_bound(point.max_error, self._job.scale, point, self._max_bytes)
            found.append(self._search(request, min(larger, most)))
        if not self._fits(found[-1]):
            return found
        failed = max((each.point.max_error for each in found[:-1]), default=0.0)
        best = found[-1].point
        for _ in range(MAX_REFINEMENTS):
            low = max(bound_below(best, self._max_bytes), failed)
            between = bound_between(low, best.max_error, self._job.scale)
            if between is None or self._max_bytes - best.size <= MAX_UNUSED_FRACTION * best.animation:
                break
            found.append(self._search(request, between))
            if self._fits(found[-1]):
                best = found[-1].point
            else:
                failed = between
        return found

    def _search(self, request: Request, bound: float) -> _Result:
        """A search with verification."""
        found = self._job.run(with_bound(request, bound))
        return _Result(found, self._job.point(bound, found))

    def _fits(self, result: _Result) -> bool:
        return result.point.size <= self._max_bytes

    def _estimate(self, request: Request, max_error: float) -> RatePoint:
        """The size at a bound, in m, by a fast search without verification.

        Of files with many clips all are searched at one bound, and some at the others: sizes are in proportion.
        """
        usual = FIRST_FRACTION * self._job.scale
        if max_error in (0.0, usual) or len(self._job.chosen) < MIN_SIZE_CLIPS:
            return self._whole(request, max_error)[0]
        point, sizes = self._whole(request, usual)
        chosen = _sample(self._job, sizes, SIZE_CLIPS)
        total = sum(sizes[i] for i in chosen)
        if not total:
            return self._whole(request, max_error)[0]
        animation = round(point.animation * self._fast_bytes(request, max_error, chosen) / total)
        return RatePoint(max_error, point.size - point.animation + animation, point.error, animation)

    def _whole(self, request: Request, max_error: float) -> tuple[RatePoint, Mapping[int, float]]:
        """The size at a bound by a fast search of all clips, and the bytes of each."""
        if max_error not in self._tried:
            found = self._job.run(replace(with_bound(request, max_error), effort=FAST), verified=False)
            self._tried[max_error] = self._job.point(max_error, found), found.sizes(request)
        return self._tried[max_error]

    def _fast_bytes(self, request: Request, max_error: float, clips: Sequence[int]) -> float:
        """Bytes of some clips after a fast search."""
        if max_error in self._tried:
            sizes = self._tried[max_error][1]
        else:
            quick = replace(with_bound(request, max_error), effort=FAST)
            sizes = self._job.run(quick, chosen=clips, verified=False).sizes(request)
        return sum(sizes[i] for i in clips)

    def _ratio(self, request: Request, max_error: float) -> float:
        """Bytes of the search's effort as a fraction of a fast one's, by some of the clips."""
        if request.effort == FAST:
            return 1.0
        _, sizes = self._whole(request, FIRST_FRACTION * self._job.scale)
        chosen = _sample(self._job, sizes, RATIO_CLIPS)
        if not chosen:
            return 1.0
        full = self._job.run(with_bound(request, max_error), chosen=chosen, verified=False).sizes(request)
        return sum(full.values()) / max(self._fast_bytes(request, max_error, chosen), 1.0)

    def _refusal(self, points: Iterable[RatePoint], most: float) -> CheckError:
        """The error for a limit that none of the points meets. most: m, the largest bound."""
        job = self._job
        least = min(points, key=lambda point: point.size)
        percent = f" ({format_number(100 * most / job.scale, 2)} %)" if job.scale else ""
        kept = optimize_report.retained_keys(job.source.document, job.chosen)
        return CheckError(
            f"doesn't fit {plural(self._max_bytes, 'byte')}: with an error of up to {format_length(most)}{percent} "
            f"it still takes {plural(least.size, 'byte')}, {least.animation} of them animation; "
            f"{kept}{'; ' if kept else ''}nothing was written",
            help=f"what fits, with your other options: gltf-anim optimize IN OUT --max-bytes {least.size}",
        )


def _sample(job: OptimizeJob, clips: Iterable[int], count: int) -> list[int]:
    """One clip of `count`: large ones and small ones."""
    sizes = {i: sum(track.values.size for track in job.clips[i].tracks) for i in clips}
    return sorted(sorted(sizes, key=lambda i: -sizes[i])[::count])

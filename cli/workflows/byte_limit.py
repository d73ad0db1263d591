"""Search for the smallest error within a byte limit: sizes by fast searches, then one full search."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from anim.optimization.optimize import Optimized
from anim.optimization.options import Request
from anim.optimization.rate_distortion import (
    MAX_BOUND_PER_DIAGONAL,
    TABLE_FACTOR,
    RatePoint,
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
USUAL_RATIO = 0.985  # bytes of animation after a longer search, as a fraction of those after a fast one
SAMPLED_CLIPS = 4  # one clip of so many measures that ratio
MAX_FULL_SEARCHES = 4  # until a result fits
MAX_UNUSED_FRACTION = 0.015  # of the animation's bytes; more are worth another search
MAX_REFINEMENTS = 3


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
        job = self._job
        most = MAX_BOUND_PER_DIAGONAL * job.scale if ceiling is None else ceiling
        if ceiling is not None and self._estimate(request, most).size > self._max_bytes:
            self._check_fit(job.sized(request, most))
        bound = smallest_bound(
            self._max_bytes,
            job.scale,
            lambda max_error: self._estimate(request, max_error),
            lambda max_error: self._ratio(request, max_error),
            usual_ratio=1.0 if request.effort == FAST else USUAL_RATIO,
        )
        if bound is None:
            self._check_fit(job.sized(request, most))
        bound = most if bound is None else min(bound, most)
        for _ in range(MAX_FULL_SEARCHES):
            found = job.run(with_bound(request, bound))
            point = job.point(bound, found)
            if point.size <= self._max_bytes:
                return self._with_less_error(request, found, point)
            if bound >= most:
                break
            bound = min(next_bound(bound, job.scale, point, self._max_bytes), most)
        found = job.run(replace(with_bound(request, most), effort=FAST))  # no longer search fits
        self._check_fit(job.point(most, found))
        return with_bound(request, most), found

    def _with_less_error(self, request: Request, found: Optimized, point: RatePoint) -> tuple[Request, Optimized]:
        """The request and the result with a smaller bound, if many bytes are unused, as with jumps in a file's sizes.

        found, point: a result that fits.
        """
        low, diagonal = point.max_error / TABLE_FACTOR, self._job.scale
        for _ in range(MAX_REFINEMENTS):
            if self._max_bytes - point.size <= MAX_UNUSED_FRACTION * point.animation:
                break
            bound = bound_between(low, point.max_error, diagonal)
            if bound is None:
                break
            other = self._job.run(with_bound(request, bound))
            sized = self._job.point(bound, other)
            if sized.size <= self._max_bytes:
                found, point = other, sized
            else:
                low = bound
        return with_bound(request, point.max_error), found

    def _estimate(self, request: Request, max_error: float) -> RatePoint:
        """The size at a bound, in m, by a fast search without verification."""
        if max_error not in self._tried:
            found = self._job.run(replace(with_bound(request, max_error), effort=FAST), verified=False)
            self._tried[max_error] = self._job.point(max_error, found), found.sizes(request)
        return self._tried[max_error][0]

    def _ratio(self, request: Request, max_error: float) -> float:
        """Bytes of the search's effort as a fraction of a fast one's, by some of the clips."""
        if request.effort == FAST:
            return 1.0
        self._estimate(request, max_error)
        _, fast = self._tried[max_error]
        if not fast:
            return 1.0
        chosen = self._sample(fast)
        full = self._job.run(with_bound(request, max_error), chosen=chosen, verified=False).sizes(request)
        return sum(full.values()) / max(sum(fast[i] for i in chosen), 1.0)

    def _sample(self, clips: Iterable[int]) -> list[int]:
        """Some of the clips, large ones and small ones."""
        sizes = {i: sum(track.values.size for track in self._job.clips[i].tracks) for i in clips}
        return sorted(sorted(sizes, key=lambda i: -sizes[i])[::SAMPLED_CLIPS])

    def _check_fit(self, point: RatePoint) -> None:
        if point.size <= self._max_bytes:
            return
        job = self._job
        percent = f" ({format_number(100 * point.max_error / job.scale, 2)} %)" if job.scale else ""
        kept = optimize_report.retained_keys(job.source.document, job.chosen)
        raise CheckError(
            f"doesn't fit {plural(self._max_bytes, 'byte')}: "
            f"with an error of up to {format_length(point.max_error)}{percent} it still takes "
            f"{plural(point.size, 'byte')}, {point.animation} of them animation; "
            f"{kept}{'; ' if kept else ''}nothing was written",
            help=f"what fits, with your other options: gltf-anim optimize IN OUT --max-bytes {point.size}",
        )

"""Search for the smallest error within a byte limit: sizes by fast searches, then one full search, clip by clip."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from anim.optimization.clip_optimizer import ClipResult
from anim.optimization.optimize import Optimized, sizes
from anim.optimization.options import Request
from anim.optimization.rate_distortion import (
    MAX_BOUND_PER_DIAGONAL,
    RatePoint,
    bound_below,
    bound_between,
    bound_for,
    next_bound,
    size_at,
    smallest_bound,
)
from anim.units import format_number, plural
from cli.errors import CheckError
from cli.reports import optimize_report
from cli.text import format_length
from cli.workflows.fast_sizes import FAST, MIN_SAMPLED, FastSizes
from cli.workflows.optimize_job import OptimizeJob, with_bound

USUAL_RATIO = 0.955  # bytes of animation after a longer search, as a fraction of those after a fast one
MAX_REPAIRS = 4  # searches of some clips at a larger bound, until a result fits; the last one at the largest
MAX_UNUSED_FRACTION = 0.015  # of the animation's bytes; more are worth another search
REPAIR_FRACTION = 0.005  # of the same, that a larger bound would save beyond what is needed: so fewer clips need it
REPAIR_MARGIN = 1.25  # of the bytes too many: what a larger bound saves is an estimate
SAMPLE_DOUBT = 0.025  # fraction by which the bytes of all clips differ from those that a sample lets expect
MAX_RAISE_FACTOR = 1.25  # between bounds of groups of clips: where more is needed, some of those before are repaired
MAX_REFINEMENTS = 3


@dataclass(frozen=True, slots=True)
class _Clip:
    """The result of a clip at a bound, m, with its bytes."""

    result: ClipResult
    bound: float
    size: float


@dataclass(frozen=True, slots=True)
class _Result:
    """A result with its size and error."""

    optimized: Optimized
    point: RatePoint


class ByteLimit:
    """A byte limit for the output of a job. request: with any bound. most: m, the largest one."""

    def __init__(self, job: OptimizeJob, max_bytes: int, request: Request, ceiling: float | None = None) -> None:
        self._job = job
        self._max_bytes = max_bytes
        self._request = request
        self._fast = FastSizes(job, request)
        self._most = MAX_BOUND_PER_DIAGONAL * job.scale if ceiling is None else ceiling

    def run(self) -> tuple[Request, Optimized]:
        """Return the request and the result with the smallest error that fits. Raises CheckError if nothing fits."""
        ratio = 1.0 if self._request.effort == FAST else USUAL_RATIO
        bound = smallest_bound(self._max_bytes, self._job.scale, self._fast.at, ratio=ratio)
        found = self._fitting(self._most if bound is None else min(bound, self._most))
        best = min(filter(self._fits, found), key=lambda each: each.point.error, default=None)
        if best is None:
            fast = replace(self._request, effort=FAST)  # no longer search fits
            optimized = self._job.run(with_bound(fast, self._most))
            found.append(_Result(optimized, self._job.point(self._most, optimized)))
            if not self._fits(found[-1]):
                raise self._refusal([*(each.point for each in found), self._fast.at(0.0)])
            best = found[-1]
        return with_bound(self._request, best.point.max_error), best.optimized

    def _fitting(self, bound: float) -> list[_Result]:
        """Results of verified searches: at larger bounds until one fits, then at smaller ones while bytes are unused.

        Sizes jump in files of few keys, so that the first bound that fits can be far from the smallest.
        """
        clips = self._searched(bound)
        found = [self._written(clips)]
        for repair in range(MAX_REPAIRS):
            if self._fits(found[-1]) or found[-1].point.max_error >= self._most:
                break
            if repair == MAX_REPAIRS - 1:
                self._search(clips, list(clips), self._most)
            else:
                self._repair(clips, found[-1].point, self._repair_bound(found[-1].point))
            found.append(self._written(clips))
        if not self._fits(found[-1]):
            return found
        best = found[-1].point
        for _ in range(MAX_REFINEMENTS):
            point = found[-1].point
            if self._fits(found[-1]):
                best = point
                failed = max((each.point.max_error for each in found if not self._fits(each)), default=0.0)
                low = max(bound_below(best, self._max_bytes, self._fast.exponent(best.max_error)), failed)
                between = bound_between(low, best.max_error, self._job.scale)
                if between is None or self._max_bytes - best.size <= MAX_UNUSED_FRACTION * best.animation:
                    break
                self._search(clips, [i for i, each in clips.items() if each.bound > between], between)
            else:
                between = bound_between(point.max_error, best.max_error, self._job.scale)
                if between is None:
                    break
                self._repair(clips, point, min(self._repair_bound(point), between))
            found.append(self._written(clips))
        return found

    def _searched(self, bound: float) -> dict[int, _Clip]:
        """All clips after a full search, a sample first, each group at the bound that the bytes so far leave it.

        The bound never decreases but for the sample: the error of a file is that of its worst clip.
        """
        clips: dict[int, _Clip] = {}
        self._search(clips, self._fast.sample, bound)
        rest = [i for i in self._job.chosen if i not in clips]
        if not bound or not rest:  # without error, or of few clips
            self._search(clips, rest, bound)
            return clips
        wanted = self._bound_of(clips, self._job.chosen, bound, doubt=SAMPLE_DOUBT)
        if wanted < bound:
            bound = wanted
            self._search(clips, self._fast.sample, bound)
        bound = self._larger_bound(clips, rest, bound, doubt=SAMPLE_DOUBT)
        self._search(clips, rest[::5] + rest[1::5], bound)
        rest = [i for i in rest if i not in clips]
        self._search(clips, rest, self._larger_bound(clips, rest, bound))
        return clips

    def _larger_bound(
        self, clips: Mapping[int, _Clip], rest: Sequence[int], bound: float, *, doubt: float = 0
    ) -> float:
        """The bound, m, at which the clips that are left are likely to fit, not below one."""
        wanted = min(self._bound_of(clips, rest, bound, doubt=doubt), MAX_RAISE_FACTOR * bound)
        return min(max(wanted, bound), self._most)

    def _bound_of(self, clips: Mapping[int, _Clip], some: Sequence[int], bound: float, *, doubt: float) -> float:
        """The bound, m, at which some clips, and the others as they are, are likely to fit.

        doubt: fraction of the bytes by which what is expected may be wrong.
        """
        point, fast = self._fast.first
        other = point.size - sum(fast.values())  # bytes of the file apart from clips
        spent = sum(each.size for i, each in clips.items() if i not in set(some))
        here = sum(size_at(each.size, each.bound, bound, self._fast.exponent(bound)) for each in clips.values())
        ratio = here / max(sum(fast[i] for i in clips), 1.0)
        available = max(self._max_bytes - other - spent, 1.0)
        excess = max(ratio * sum(fast[i] for i in some), 1.0) / available
        if abs(math.log(excess)) <= doubt:
            return bound
        excess *= math.exp(math.copysign(doubt, -math.log(excess)))
        return bound_for(excess, bound, self._job.scale, self._fast.exponent(bound))

    def _repair(self, clips: dict[int, _Clip], point: RatePoint, bound: float) -> None:
        """Search as many clips again, at a larger bound, as are likely to save the bytes too many."""
        few = len(clips) < MIN_SAMPLED or not point.max_error
        needed = math.inf if few else REPAIR_MARGIN * (point.size - self._max_bytes)
        saved, chosen = 0.0, []
        for i in sorted(clips, key=lambda i: clips[i].bound):  # small bounds save most
            if saved >= needed:
                break
            saved += clips[i].size - size_at(clips[i].size, clips[i].bound, bound, self._fast.exponent(bound))
            chosen.append(i)
        self._search(clips, chosen, bound)

    def _repair_bound(self, point: RatePoint) -> float:
        """A bound, m, that saves the bytes too many, and some more: then not all clips need it."""
        if len(self._job.chosen) < MIN_SAMPLED or not point.max_error:
            bound = next_bound(point.max_error, self._job.scale, point, self._max_bytes)
        else:
            saved = (point.size - self._max_bytes) / max(point.animation, 1) + REPAIR_FRACTION
            exponent = self._fast.exponent(point.max_error)
            bound = bound_for(1 / max(1 - saved, 0.1), point.max_error, self._job.scale, exponent)
        return min(bound, self._most)

    def _search(self, clips: dict[int, _Clip], chosen: Sequence[int], bound: float) -> None:
        """Search some clips at a bound, m; a result that is in place and as good within it stays."""
        request = with_bound(self._request, bound)
        found = self._job.search(request, chosen) if chosen else {}
        for i, size in sizes(found, request).items():
            if i not in clips or clips[i].bound > bound or size < clips[i].size:
                clips[i] = _Clip(found[i], bound, size)

    def _written(self, clips: Mapping[int, _Clip]) -> _Result:
        """The file of these results."""
        bound = max((each.bound for each in clips.values()), default=0.0)
        results = {i: each.result for i, each in clips.items()}
        found = self._job.run(with_bound(self._request, bound), earlier=results)
        return _Result(found, self._job.point(bound, found))

    def _fits(self, result: _Result) -> bool:
        return result.point.size <= self._max_bytes

    def _refusal(self, points: Iterable[RatePoint]) -> CheckError:
        """The error for a limit that none of the points meets."""
        job, most = self._job, self._most
        least = min(points, key=lambda point: point.size)
        percent = f" ({format_number(100 * most / job.scale, 2)} %)" if job.scale else ""
        kept = optimize_report.retained_keys(job.source.document, job.chosen)
        return CheckError(
            f"doesn't fit {plural(self._max_bytes, 'byte')}: with an error of up to {format_length(most)}{percent} "
            f"it still takes {plural(least.size, 'byte')}, {least.animation} of them animation; "
            f"{kept}{'; ' if kept else ''}nothing was written",
            help=f"what fits, with your other options: gltf-anim optimize IN OUT --max-bytes {least.size}",
        )

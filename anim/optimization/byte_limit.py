"""Search for the smallest error within a byte limit: sizes by fast searches, then one full search, clip by clip."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from anim.errors import RangeError
from anim.optimization.clip_optimizer import ClipResult
from anim.optimization.fast_sizes import MIN_SAMPLED, FastSizes
from anim.optimization.file_optimizer import FAST, FileOptimizer
from anim.optimization.optimize import Optimized, estimate_sizes, is_output_of
from anim.optimization.options import Request
from anim.optimization.rate_distortion import (
    BOUND_STEP_FACTOR,
    MAX_BOUND_PER_DIAGONAL,
    MAX_STEP_FACTOR,
    RatePoint,
    bound_between,
    check_diagonal,
    is_smaller,
    next_bound,
    round_bound,
    smallest_bound,
)
from anim.optimization.stepwise_limit import StepwiseLimit, is_small

USUAL_RATIO = 0.955  # bytes of animation after a longer search, as a fraction of those after a fast one
EXPECTED_WEIGHT = 40  # clips whose sizes tell as much as the fast searches: a sample of 13 was 5-9 % too small
SIZE_MARGIN = 0.005  # of the animation's bytes, left free by groups: too many bytes cost another search of some clips
SAMPLE_UNCERTAINTY = 0.006  # fraction by which the bytes of all clips differ from those expected after a sample
MAX_RAISE_FACTOR = 1.25  # between bounds of groups of clips: where more is needed, some of those before are repaired
MAX_REPAIRS = 6  # searches of some clips at a larger bound, until a result fits; the last two are of all clips
REPAIR_FRACTION = 0.005  # of the animation's bytes, that a larger bound would save beyond the need: few clips need it
REPAIR_MARGIN = 1.25  # of the bytes too many: what a larger bound saves is an estimate
MAX_UNUSED_FRACTION = 0.015  # of the animation's bytes; more are worth another search
MAX_REFINEMENTS = 4


@dataclass(frozen=True, slots=True)
class _Clip:
    """The smallest result of a clip: its bound, m, and bytes. tried: the largest bound that was searched, m."""

    result: ClipResult
    bound: float
    size: float
    tried: float


@dataclass(frozen=True, slots=True)
class _Result:
    """A result with its size and error. tried: m, the largest bound at which all clips were searched."""

    optimized: Optimized
    point: RatePoint
    tried: float


class ByteLimitError(RangeError):
    """Nothing fits. smallest: the point with the fewest bytes that was found. max_error: m, the greatest allowed."""

    def __init__(self, max_bytes: int, smallest: RatePoint, max_error: float) -> None:
        least = f"expected at least {smallest.size}, for an error of up to {max_error:g} m"
        super().__init__(f"max_bytes is {max_bytes} ({least})")
        self.smallest = smallest
        self.max_error = max_error


class ByteLimit:
    """A limit of bytes for a file as written.

    request: its bound counts only as the ceiling. ceiling: m, the greatest allowed error; None for a tenth of the
    diagonal. Raises FormatError for a model of infinite size.
    """

    def __init__(self, file: FileOptimizer, max_bytes: int, request: Request, ceiling: float | None = None) -> None:
        check_diagonal(file.scale)
        self._file = file
        self._max_bytes = max_bytes
        self._request = request
        self._fast = FastSizes(file, request)
        self._usual_ratio = 1.0 if request.effort == FAST else USUAL_RATIO
        self._most = MAX_BOUND_PER_DIAGONAL * file.scale if ceiling is None else ceiling
        # In the place of the bound: output of the same limit comes back unchanged.
        self._name = ("max_bytes", str(max_bytes), str(ceiling is None), *(request.given or (repr(request.bounds),)))
        self._clips: dict[int, _Clip] = {}  # of those that differ

    def run(self) -> tuple[Request, Optimized]:
        """Return the result with the smallest error that fits, and its request. Raises ByteLimitError if none does."""
        file, named = self._file, replace(self._request, given=self._name)
        if is_output_of(file.document, file.clips, named, file.chosen):
            return named, Optimized(file.document, {}, {}, unchanged=True)
        bound = smallest_bound(self._max_bytes, file.scale, self._fast.measure, ratio=self._usual_ratio)
        likely = self._most if bound is None else min(bound, self._most)
        found = self._find_at_steps(likely) if likely and file.scale and is_small(file, self._fast) else []
        if not any(map(self._fits, found)):
            found += self._find_fitting(likely)
        if not any(map(self._fits, found)):  # results of several searches can share less than those of one
            results = self._file.search(self._request.with_bound(self._most), self._fast.clips)
            found.append(self._write_results(results, self._most, self._most))
        best = min(filter(self._fits, found), key=lambda each: each.point.error, default=None)
        if best is None:
            smallest = min((*(each.point for each in found), self._fast.measure(0.0)), key=lambda point: point.size)
            raise ByteLimitError(self._max_bytes, smallest, self._most)
        return self._request.with_bound(best.point.max_error), best.optimized

    def _find_at_steps(self, likely: float) -> list[_Result]:
        """Results of verified searches at bounds around the likely one, m, and of the best result of each clip."""
        found: list[_Result] = []

        def search(bound: float) -> tuple[Mapping[int, ClipResult], Mapping[int, float]]:
            request = self._request.with_bound(bound)
            results = self._file.search(request, self._fast.clips)
            return results, estimate_sizes(results, request)

        def write(results: Mapping[int, ClipResult], bound: float) -> int:
            found.append(self._write_results(results, bound, bound))
            return found[-1].point.size

        StepwiseLimit(self._max_bytes, self._file.scale, self._most, search, write).run(likely)
        return found

    def _find_fitting(self, bound: float) -> list[_Result]:
        """Results of verified searches: at larger bounds until one fits, then at smaller ones while bytes are unused.

        Sizes jump in files of few keys, so that the first bound that fits can be far from the smallest.
        """
        self._search_groups(bound)
        found = [self._write()]
        step = 1.0
        for repair in range(MAX_REPAIRS):
            if self._fits(found[-1]) or found[-1].tried >= self._most:
                break
            if repair == MAX_REPAIRS - 1:
                found += self._find_fast(bound)
                if self._fits(found[-1]):
                    break
                self._search(list(self._clips), self._most)
            elif repair == MAX_REPAIRS - 2:
                self._search(list(self._clips), self._fast.fitting_bound(self._max_bytes, above=found[-1].tried))
            else:
                self._repair(found[-1].point, self._repair_bound(found[-1].point, step))
                step *= 2
            found.append(self._write())
        if not self._fits(found[-1]):
            return found + self._find_fast(self._most)
        best = found[-1].point
        for _ in range(MAX_REFINEMENTS):
            point = found[-1].point
            failed = max((each.tried for each in found if not self._fits(each)), default=0.0)
            if self._fits(found[-1]):
                best = point
                between = self._smaller_bound(best, failed)
                if between is None or self._max_bytes - best.size <= MAX_UNUSED_FRACTION * best.animation:
                    break
                self._search([i for i, each in self._clips.items() if each.bound > between], between)
            else:
                between = bound_between(failed, best.max_error, self._file.scale)
                if between is None:
                    break
                self._repair(point, min(self._repair_bound(point), between))
            found.append(self._write())
        return found

    def _smaller_bound(self, best: RatePoint, failed: float) -> float | None:
        """A bound, m, that is likely to use the bytes that the best result leaves; None if it is too near.

        failed: m, the largest bound whose result was too large, or 0.
        """
        excess = best.animation / max(best.animation + self._max_bytes - best.size, 1)
        if not self._file.scale or not best.max_error:
            return None
        likely = self._fast.curve().bound_for(excess, best.max_error, self._file.scale)
        if likely <= failed:
            return bound_between(failed, best.max_error, self._file.scale)
        return likely if is_smaller(likely, best.max_error) else None

    def _find_fast(self, bound: float) -> list[_Result]:
        """The result of a fast search, which by chance can take fewer bytes; none if it is not likely to fit."""
        if self._request.effort == FAST or (bound < self._most and self._fast.measure(bound).size > self._max_bytes):
            return []
        request = replace(self._request.with_bound(bound), effort=FAST)
        results = self._file.search(request, self._fast.clips)
        return [self._write_results(results, bound, bound)]

    def _search_groups(self, bound: float) -> None:
        """Search all clips, a sample first, each group at the bound that the bytes so far leave it.

        The bound never decreases but for the sample: the error of a file is that of its worst clip.
        """
        fast = self._fast
        self._search(fast.sample, bound)
        rest = [i for i in fast.clips if i not in self._clips]
        if not bound or not rest:  # without error, or of few clips
            self._search(rest, bound)
            return
        wanted = self._bound_of(fast.clips, bound, uncertainty=SAMPLE_UNCERTAINTY)
        if wanted < bound:
            bound = wanted
            self._search(fast.sample, bound)
        bound = self._larger_bound(rest, bound, uncertainty=SAMPLE_UNCERTAINTY)
        self._search(rest[::5] + rest[1::5], bound)
        rest = [i for i in rest if i not in self._clips]
        self._search(rest, self._larger_bound(rest, bound))

    def _larger_bound(self, rest: Sequence[int], bound: float, *, uncertainty: float = 0.0) -> float:
        """The likely bound, m, of the remaining clips, not below one."""
        wanted = min(self._bound_of(rest, bound, uncertainty=uncertainty), MAX_RAISE_FACTOR * bound)
        return min(max(wanted, bound), self._most)

    def _bound_of(self, some: Sequence[int], bound: float, *, uncertainty: float) -> float:
        """The likely bound, m, of some clips, if the others stay as they are.

        uncertainty: fraction of the expected bytes by which they may differ.
        """
        point, fast = self._fast.first
        chosen = set(some)
        other = point.size - sum(fast.values())  # bytes of the file apart from clips
        used = sum(each.size for i, each in self._clips.items() if i not in chosen)
        left = self._max_bytes - SIZE_MARGIN * point.animation - other - used
        excess = max(self._ratio(bound) * sum(fast[i] for i in some), 1.0) / max(left, 1.0)
        if not self._file.scale or abs(math.log(excess)) <= uncertainty:
            return bound
        excess *= math.exp(math.copysign(uncertainty, -math.log(excess)))
        return self._fast.curve().bound_for(excess, bound, self._file.scale)

    def _ratio(self, bound: float) -> float:
        """Bytes of clips at a bound, m, as a fraction of the first fast search's: expected, and as found so far."""
        curve, fast = self._fast.curve(), self._fast.first[1]
        found = sum(curve.size_at(each.size, each.bound, bound) for each in self._clips.values())
        found /= max(sum(fast[i] for i in self._clips), 1.0)
        expected = curve.size_at(self._usual_ratio, self._fast.first[0].max_error, bound)
        weight = len(self._clips) / (len(self._clips) + EXPECTED_WEIGHT)
        return float(max(found, 1e-9) ** weight * expected ** (1 - weight))

    def _repair(self, point: RatePoint, bound: float) -> None:
        """Search as many clips again, at a larger bound, as are likely to save the bytes too many."""
        few = len(self._clips) < MIN_SAMPLED or not point.max_error
        needed = math.inf if few else REPAIR_MARGIN * (point.size - self._max_bytes)
        saved, chosen = 0.0, []
        for i, bytes_saved in self._savings(bound).items():
            if saved >= needed:
                break
            saved += bytes_saved
            chosen.append(i)
        self._search(chosen, bound)

    def _repair_bound(self, point: RatePoint, step: float = 1.0) -> float:
        """A bound, m, that is likely to save the bytes too many, and some more: then not all clips need it.

        step: factor on the bytes more, or of few clips on the logarithm of the distance from their bound.
        """
        tried = [each.tried for each in self._clips.values()]
        if not self._file.scale:
            return self._most
        if len(tried) < MIN_SAMPLED or not min(tried):
            low = max(tried)
            bound = next_bound(low, self._file.scale, point, self._max_bytes)
            return min(bound * (bound / low) ** (step - 1) if low else bound, self._most)
        bound = min(tried) * BOUND_STEP_FACTOR
        needed = point.size - self._max_bytes + step * REPAIR_FRACTION * point.animation
        while bound < MAX_STEP_FACTOR * max(tried) and sum(self._savings(bound).values()) < needed:
            bound *= BOUND_STEP_FACTOR
        return min(round_bound(bound, self._file.scale), self._most)

    def _savings(self, bound: float) -> dict[int, float]:
        """The bytes that clips are likely to save at a larger bound, m, than their last one: most come first."""
        curve = self._fast.curve()
        smaller = sorted((each.tried, i) for i, each in self._clips.items() if each.tried < bound)
        sizes = {i: self._clips[i].size for _, i in smaller}
        return {i: sizes[i] - curve.size_at(sizes[i], tried, bound) for tried, i in smaller}

    def _search(self, chosen: Sequence[int], bound: float) -> None:
        """Search some clips at a bound, m; a result that is in place and as good within it stays."""
        request = self._request.with_bound(bound)
        found = self._file.search(request, chosen) if chosen else {}
        for i, size in estimate_sizes(found, request).items():
            old = self._clips.get(i)
            if old is None or old.bound > bound or size < old.size:
                self._clips[i] = _Clip(found[i], bound, size, bound)
            else:
                self._clips[i] = replace(old, tried=max(old.tried, bound))

    def _write(self) -> _Result:
        """Return the file of the clips' results."""
        clips = self._clips.values()
        bound = max((each.bound for each in clips), default=0.0)
        tried = min((each.tried for each in clips), default=self._most)
        return self._write_results({i: each.result for i, each in self._clips.items()}, bound, tried)

    def _write_results(self, results: Mapping[int, ClipResult], bound: float, tried: float) -> _Result:
        named = replace(self._request.with_bound(bound), given=self._name)
        found = self._file.run(named, earlier=self._fast.expand(results))
        return _Result(found, self._file.measure_point(bound, found), tried)

    def _fits(self, result: _Result) -> bool:
        return result.point.size <= self._max_bytes

"""Smallest error within a byte limit by searches at steps of the bound: of small files, which are searched fast."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from anim.optimization.clip_optimizer import ClipResult
from anim.optimization.fast_sizes import MIN_SAMPLED, FastSizes
from anim.optimization.file_optimizer import FileOptimizer
from anim.optimization.rate_distortion import BOUND_STEP_FACTOR, MIN_BOUND_PER_DIAGONAL

MAX_VALUES = 20_000  # components of keys: with more, a search takes half a second and more
MAX_VERTICES = 20_000  # on which each search is verified
MAX_DEVIATION = 3.0  # factor between the bound that fast searches expect and the one that fits
NEAR_STEPS = 2  # below and above the smallest bound that fits: sizes and errors don't fall evenly


class _ClipChoice(NamedTuple):
    """A result of a clip. bound: m, of its search. size: likely bytes. error: m, measured."""

    result: ClipResult
    bound: float
    size: float
    error: float


@dataclass
class StepwiseLimit:
    """A limit of bytes for a file of few keys.

    search: results of all clips, and their likely bytes, within a bound in m. write: the bytes of the file of some
    results, of which the largest bound, m, is given too. ceiling: m, the greatest allowed bound.
    """

    max_bytes: int
    diagonal: float
    ceiling: float
    search: Callable[[float], tuple[Mapping[int, ClipResult], Mapping[int, float]]]
    write: Callable[[Mapping[int, ClipResult], float], int]
    _choices: dict[int, dict[int, _ClipChoice]] = field(default_factory=dict)  # by step and clip
    _sizes: dict[int, int] = field(default_factory=dict)  # of files by step, in bytes

    def run(self, likely: float) -> None:
        """Write files at bounds around the smallest one that fits, and one with the best result of each clip.

        likely: the bound, m, that is expected to fit: steps far from it are taken to fit, or not, until their neighbors
        show otherwise.
        """
        first, last = self._step(MIN_BOUND_PER_DIAGONAL * self.diagonal), self._step(self.ceiling)
        step = self._smallest_step(first, last, likely)
        while self._size(step) > self.max_bytes and step < last:
            likely *= MAX_DEVIATION
            step = self._smallest_step(first, last, likely)
        while step > first and self._size(step - 1) <= self.max_bytes:
            likely /= MAX_DEVIATION
            step = self._smallest_step(first, last, likely)
        for near in range(max(step - NEAR_STEPS, first), min(step + NEAR_STEPS, last) + 1):
            self._size(near)
        self._search_equal_sizes(step, last)
        self._combine()

    def _smallest_step(self, first: int, last: int, likely: float) -> int:
        """Return the step that a binary search ends at; the last one is taken to fit.

        It asks for the same steps in the same order whatever the limit, up to the first other answer: so a larger limit
        seldom has a larger bound, though sizes rise and fall.
        """
        low, high = first - 1, last
        while high - low > 1:
            middle = (low + high) // 2
            if self._is_enough(middle, likely):
                high = middle
            else:
                low = middle
        return high

    def _search_equal_sizes(self, step: int, last: int) -> None:
        """Search far above a step whose result is that of many larger bounds: by chance one has less error beyond."""
        distance = 1
        while step + distance <= last and self._size(step + distance) == self._sizes[step]:
            distance *= 2

    def _is_enough(self, step: int, likely: float) -> bool:
        """Return whether a bound fits; one far from the likely bound is not searched."""
        if self._bound(step) >= MAX_DEVIATION * likely:
            return True
        return self._bound(step) > likely / MAX_DEVIATION and self._size(step) <= self.max_bytes

    def _step(self, bound: float) -> int:
        return math.ceil(math.log(bound / self.diagonal) / math.log(BOUND_STEP_FACTOR) - 1e-9)

    def _bound(self, step: int) -> float:
        return min(self.diagonal * math.exp(step * math.log(BOUND_STEP_FACTOR)), self.ceiling)

    def _size(self, step: int) -> int:
        """Return the bytes of the file at a step, searched on first use."""
        if step not in self._sizes:
            bound = self._bound(step)
            results, sizes = self.search(bound)
            self._choices[step] = {
                i: _ClipChoice(each, bound, sizes[i], each.verdict.error.max_error) for i, each in results.items()
            }
            self._sizes[step] = self.write(results, bound)
        return self._sizes[step]

    def _combine(self) -> None:
        """Write the results of different bounds that have the smallest error together and are likely to fit.

        Likely bytes leave out what clips share, so that the next ones are tried until a file fits, as one does.
        """
        of_clips = {i: [found[i] for found in self._choices.values()] for i in next(iter(self._choices.values()))}
        step = min(self._sizes, key=lambda each: abs(self._sizes[each] - self.max_bytes))
        others = self._sizes[step] - sum(each.size for each in self._choices[step].values())
        fitting = (self._choices[each] for each, size in self._sizes.items() if size <= self.max_bytes)
        least = min((max(each.error for each in clips.values()) for clips in fitting), default=math.inf)
        errors = {choice.error for clip in of_clips.values() for choice in clip}
        for error in sorted(each for each in errors if each < least):
            some = {i: [choice for choice in clip if choice.error <= error] for i, clip in of_clips.items()}
            if not all(some.values()):
                continue
            best = {i: min(clip, key=lambda each: (each.size, each.error)) for i, clip in some.items()}
            if others + sum(each.size for each in best.values()) <= self.max_bytes:
                results = {i: each.result for i, each in best.items()}
                if self.write(results, max(each.bound for each in best.values())) <= self.max_bytes:
                    return


def is_small(file: FileOptimizer, fast: FastSizes) -> bool:
    """Return whether a file is searched so fast that more searches cost little: one of few clips, keys and vertices."""
    values = sum(track.values.size for i in fast.clips for track in file.clips[i].tracks)
    return len(fast.clips) < MIN_SAMPLED and values <= MAX_VALUES and file.scene.vertex_count <= MAX_VERTICES

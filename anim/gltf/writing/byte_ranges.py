"""Sets of byte ranges, and byte offsets after some of them are dropped."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from itertools import accumulate
from typing import TypeAlias

Range: TypeAlias = tuple[int, int]  # first byte, end

ALIGNMENT_BYTES = 4  # bytes; the maximum alignment in a glTF buffer


def union(ranges: Iterable[Range]) -> list[Range]:
    """Return the same bytes as sorted ranges that neither touch nor overlap."""
    merged: list[Range] = []
    for start, end in sorted(ranges):
        if start >= end:
            continue
        if merged and start <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((start, end))
    return merged


def difference(ranges: Iterable[Range], without: Iterable[Range]) -> list[Range]:
    """Return the bytes of `ranges` that are not in `without`.

    difference([(0, 10)], [(2, 4)]) → [(0, 2), (4, 10)]
    """
    left: list[Range] = []
    cuts = union(without)
    for start, end in union(ranges):
        first = max(bisect_right(cuts, (start, start)) - 1, 0)
        for cut_start, cut_end in cuts[first:]:
            if cut_start >= end:
                break
            if cut_end > start:
                left.append((start, cut_start))
                start = cut_end
        left.append((start, end))
    return [(start, end) for start, end in left if start < end]


def all_dropped(first: list[Range], then: Iterable[Range]) -> list[Range]:
    """Return the dropped bytes of a buffer without `first`, and after that without `then`, offsets in what is left.

    all_dropped([(0, 4)], [(2, 6)]) → [(0, 4), (6, 10)]
    """
    ends = list(accumulate((end - start for start, end in first), initial=0))  # dropped bytes before each range
    left = [start - before for start, before in zip((start for start, _ in first), ends, strict=False)]

    def old(at: int) -> int:
        return at + ends[bisect_right(left, at)]

    return union([*first, *((old(start), old(end - 1) + 1) for start, end in then if start < end)])


def aligned(ranges: Iterable[Range]) -> list[Range]:
    """Return each range shrunk to multiples of four, so that later bytes remain aligned."""
    inward = [
        (-(-start // ALIGNMENT_BYTES) * ALIGNMENT_BYTES, end // ALIGNMENT_BYTES * ALIGNMENT_BYTES)
        for start, end in ranges
    ]
    return [(start, end) for start, end in inward if start < end]


class OffsetMap:
    """New byte offsets of a buffer without its `dropped` ranges."""

    def __init__(self, dropped: list[Range]) -> None:
        self.dropped = union(dropped)
        self._starts = [start for start, _ in self.dropped]
        self._before = [0]
        for start, end in self.dropped:
            self._before.append(self._before[-1] + end - start)

    @property
    def dropped_bytes(self) -> int:
        """Total dropped bytes."""
        return self._before[-1]

    def __call__(self, at: int) -> int:
        """Return the new offset of byte `at`; for a dropped one, that of the next kept byte."""
        i = bisect_right(self._starts, at)
        inside = max(self.dropped[i - 1][1] - at, 0) if i else 0
        return at - self._before[i] + inside

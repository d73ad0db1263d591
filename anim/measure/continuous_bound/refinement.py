"""Refinement of the bound: samples in intervals with displacements that may exceed it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.measure.error.displacement import CHUNK, DisplacementField, lengths
from anim.measure.error.metric import MAX_SEARCHED, ErrorMetric
from anim.measure.error.point_groups import PointGroups
from anim.model import Clip


@dataclass(frozen=True, slots=True)
class Subintervals:
    """Intervals between neighboring samples, divided into equal parts, for one player.

    times: (T,) s, all ends of all parts; the last of an interval is the moment before its end. more: (C, T) m, upper
    bound of the rise of the displacement of a group around each within a part; nan if that interval is not refined.
    """

    player: str
    times: Floats
    more: Floats

    def some(self, start: int, end: int) -> Subintervals:
        """Return those with indices from `start` up to `end`."""
        here = slice(max(start, 0), max(end, 0))
        return Subintervals(self.player, self.times[here], self.more[:, here])


@dataclass(frozen=True, slots=True)
class RefinedMaximum:
    """Result of a refinement.

    bound: m, of the displacement in all intervals. largest: m, the largest sampled displacement. player,
    time: of that sample, s.
    """

    bound: float = 0.0
    largest: float = 0.0
    player: str = ""
    time: float = 0.0


def subdivide(player: str, times: Floats, rise: Floats, asked: Bools, parts: Ints) -> Subintervals:
    """Return the intervals between neighbors of `times` (F,) s, divided into `parts` (F − 1,).

    rise: (C, F − 1) m of groups in whole intervals. asked: (C, F − 1), mask of the intervals to refine for each group.
    """
    stretches = np.flatnonzero(asked.any(axis=0))
    counts = parts[stretches] + 1
    whole, stretch = np.repeat(parts[stretches], counts), np.repeat(stretches, counts)
    step = np.arange(len(whole)) - np.repeat(np.cumsum(counts) - counts, counts)
    start, end = times[stretch], times[stretch + 1]
    at = np.where(step == whole, np.nextafter(end, start), start + (end - start) * (step / whole))
    return Subintervals(player, at, np.where(asked, rise, np.nan)[:, stretch] / whole**2)


def refine(
    ruler: ErrorMetric,
    clips: tuple[Clip, Clip],
    asked: Sequence[Subintervals],
    parts: Sequence[PointGroups],
    *,
    target: float,
) -> RefinedMaximum:
    """Return the largest displacement in the refined intervals, and its upper bound.

    asked: of every player. parts: the surfaces of the groups, in order. target: m; vertices of groups with a smaller
    bound are not evaluated.
    """
    seen, left = RefinedMaximum(), MAX_SEARCHED
    for chunk in _chunks(asked, ruler.length):
        old, new = ruler.posed(*clips, [(each.player, each.times) for each in chunk])
        more = np.concatenate([each.more for each in chunk], axis=1)
        first = 0
        for part in parts:
            here = more[first : first + len(part.groups)]
            first += len(part.groups)
            if np.isnan(here).all():
                continue
            field = part.field(old, new)
            if field is None:
                continue
            bound, largest, frame, looked = _searched(field, here, target, left)
            left -= looked
            seen = replace(seen, bound=max(seen.bound, bound))
            if largest > seen.largest:
                players = np.repeat([each.player for each in chunk], [len(each.times) for each in chunk])
                seen = RefinedMaximum(seen.bound, largest, str(players[frame]), float(old.pose.times[frame]))
    return seen


def _chunks(asked: Sequence[Subintervals], length: int) -> Iterator[list[Subintervals]]:
    """Slices of all players' intervals, of up to `length` times together."""
    firsts = np.cumsum([0, *(len(each.times) for each in asked)]).tolist()
    for start in range(0, firsts[-1], length):
        some = (each.some(start - first, start + length - first) for each, first in zip(asked, firsts, strict=False))
        yield [each for each in some if len(each.times)]


def _searched(field: DisplacementField, more: Floats, target: float, most: int) -> tuple[float, float, int, int]:
    """The bound of all groups, the longest vector, its frame, and the number (≤ `most`) of evaluated ones."""
    tops = field.limits + more
    found, frame, looked = 0.0, 0, 0
    for group in np.flatnonzero((tops > target).any(axis=1)).tolist():
        frames = np.flatnonzero(tops[group] > target)
        vertices = len(field.vectors(group, frames[:1]))
        size = max(CHUNK // max(vertices, 1), 1)
        for some in (frames[i : i + size] for i in range(0, len(frames), size)):
            if looked > most:
                break
            longest = lengths(field, group, some).max(axis=0)
            looked += vertices * len(some)
            tops[group, some] = longest + more[group, some]
            if longest.max() > found:
                found, frame = float(longest.max()), int(some[longest.argmax()])
    return float(np.nanmax(tops)), found, frame, looked

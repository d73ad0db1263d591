"""Rate-distortion curve of a file, and the smallest error bound within a byte limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from anim.errors import FormatError

ERROR_FRACTIONS = tuple(
    10.0 ** (-exponent / 2) for exponent in range(10, 3, -1)
)  # of the diagonal: 1e-5 to 1e-2, two a decade
MIN_BOUND_PER_DIAGONAL, MAX_BOUND_PER_DIAGONAL = 1e-6, 0.1  # range of the search
TABLE_FRACTIONS = tuple(10.0 ** (k / 4 - 6) for k in range(21))  # of the diagonal: that range, four a decade
TABLE_FACTOR = TABLE_FRACTIONS[1] / TABLE_FRACTIONS[0]
FIRST_ENTRY, FIRST_STEP = 12, 4  # of the table: 1e-3 of the diagonal, and its neighbors a decade apart
FIRST_FRACTION = TABLE_FRACTIONS[FIRST_ENTRY]
MIN_SIZE_RATIO = 0.98  # of animation bytes at a smaller bound to those at a larger one; else they are not verifiable
EXACT_SIZE_RATIO = 1.25  # of bytes without error to those at the first entry; where fewer are left, they are not tried
SIZE_MARGIN = 3e-3  # of the animation's bytes: sizes between two entries are estimates
BOUND_STEP_FACTOR = 1.05  # between the bounds that a search may return
BOUND_EXPONENT_PER_SIZE = 16.0  # a bound 17 % larger saves about a percent of the animation's bytes
MAX_STEP_FACTOR = 4.0  # of a bound whose result was too large or too small


@dataclass(frozen=True, slots=True)
class RatePoint:
    """A bound, m, with the size of the resulting file in bytes and its error, m.

    animation: bytes of keys and of their JSON, without meshes and images.
    """

    max_error: float
    size: int
    error: float
    animation: int = 0


def check_diagonal(diagonal: float) -> None:
    """Raise FormatError for a model of infinite size, of which no fraction is a bound."""
    if not math.isfinite(diagonal):
        raise FormatError(
            "nodes are too far apart for an error in percent of the model's size (its diagonal is infinite)"
        )


def curve(
    diagonal: float, tried: Callable[[float], RatePoint], fractions: Sequence[float] = ERROR_FRACTIONS
) -> Iterator[RatePoint]:
    """Yield sizes at bounds from small to large. tried: optimizes with a bound in metres."""
    for fraction in sorted(fractions):
        yield tried(fraction * diagonal)


def smallest_bound(
    max_bytes: int, diagonal: float, sized: Callable[[float], RatePoint], *, ratio: float = 1.0
) -> float | None:
    """Return the smallest bound, m, whose result is likely to take at most `max_bytes`; None if there is none.

    sized: size at a bound, from a quick search. ratio: animation bytes of the final search as a fraction of those.
    Sizes are tried at bounds of one table only, and in between estimated from its neighbors, so that the result never
    increases with `max_bytes`.
    """
    if not diagonal:
        return 0.0 if sized(0.0).size <= max_bytes else None
    table = _SizeTable(diagonal, sized)
    first = table.point(FIRST_ENTRY)
    unused = max_bytes - first.size
    if unused >= (EXACT_SIZE_RATIO - 1) * first.animation and sized(0.0).size <= max_bytes:
        return 0.0
    entry = _first_entry(
        lambda entry, larger: table.size(entry, ratio) <= max_bytes and table.is_plausible(entry, larger)
    )
    if not table.has_larger(entry, max_bytes, ratio) and sized(0.0).size <= max_bytes:
        return 0.0
    for each in range(entry, len(TABLE_FRACTIONS)):
        bound = table.bound_before(each, max_bytes, ratio)
        if bound is not None:
            return min(round_bound(bound, diagonal), table.bound(each))
    last = len(TABLE_FRACTIONS) - 1
    return table.bound(last) if table.size(last, 1.0) <= max_bytes else None


def next_bound(bound: float, diagonal: float, point: RatePoint, max_bytes: int) -> float:
    """Return a larger bound, m, after the result at `bound`, which takes more than `max_bytes`."""
    animation = max(point.animation - (point.size - max_bytes), 1)
    excess = min(point.animation / animation, 2.0)
    factor = min(max(excess**BOUND_EXPONENT_PER_SIZE, BOUND_STEP_FACTOR), MAX_STEP_FACTOR)
    return round_bound(max(bound, MIN_BOUND_PER_DIAGONAL * diagonal) * factor, diagonal)


def bound_between(low: float, high: float, diagonal: float) -> float | None:
    """Return a bound, m, between two of which the lower one is taken for too small; None if they are too near."""
    middle = round_bound(math.sqrt(low * high), diagonal) if low and diagonal else high
    return middle if is_smaller(middle, high) else None


def is_smaller(bound: float, other: float) -> bool:
    """Return whether a bound, m, is smaller than another by so much that a search may save bytes."""
    return bound < other / math.sqrt(BOUND_STEP_FACTOR)


class _SizeTable:
    """Sizes at the bounds of the table, each found on first use."""

    def __init__(self, diagonal: float, sized: Callable[[float], RatePoint]) -> None:
        self._diagonal = diagonal
        self._sized = sized
        self._found: dict[int, RatePoint] = {}

    def bound(self, entry: int) -> float:
        """Return the bound, m, of an entry."""
        return float(TABLE_FRACTIONS[entry] * self._diagonal)

    def size(self, entry: int, ratio: float) -> float:
        """Return the bytes of the file if its animation takes `ratio` times those of the quick search."""
        point = self.point(entry)
        return point.size - (1 - ratio) * point.animation

    def is_plausible(self, entry: int, larger: int) -> bool:
        """Return whether an entry has as many bytes as a larger one; less come of a search that misses its bound."""
        if larger not in self._found:
            return True
        return self.point(entry).animation >= MIN_SIZE_RATIO * self.point(larger).animation

    def has_larger(self, entry: int, max_bytes: int, ratio: float) -> bool:
        """Return whether a smaller bound that was tried takes too many bytes: without error they are more still."""
        smaller = (each for each in self._found if each < entry)
        return any(self.size(each, ratio) > max_bytes and self.is_plausible(each, entry) for each in smaller)

    def bound_before(self, entry: int, max_bytes: int, ratio: float) -> float | None:
        """Return the bound, m, of `max_bytes` between an entry and the one before; None above the entry.

        Animation bytes are linear in between, both logarithmic.
        """
        high = self.point(entry)
        limit = max_bytes - SIZE_MARGIN * high.animation - (high.size - high.animation)
        if ratio * high.animation > limit:
            return None
        if not entry:
            return self.bound(entry)
        low = self.point(entry - 1)
        if not self.is_plausible(entry - 1, entry):
            return self.bound(entry)
        if ratio * low.animation <= limit:
            return self.bound(entry - 1)
        fraction = math.log(ratio * low.animation / limit) / math.log(low.animation / high.animation)
        return float(self.bound(entry - 1) * (self.bound(entry) / self.bound(entry - 1)) ** fraction)

    def point(self, entry: int) -> RatePoint:
        """Return the size from the quick search at an entry."""
        if entry not in self._found:
            self._found[entry] = self._sized(self.bound(entry))
        return self._found[entry]


def _first_entry(fits: Callable[[int, int], bool]) -> int:
    """Return the first entry of the table that fits, or its length; entries after one that fits count as fitting.

    fits: of an entry, and the first one so far, or the table's length. The order of entries depends on nothing but
    earlier answers, and each is asked for with the same one so far: more that fit never lead to a later entry.
    """
    count = len(TABLE_FRACTIONS)
    low, high = -1, count
    while high - low > 1:
        if low < 0 and high == count:
            entry = FIRST_ENTRY
        elif low < 0:
            entry = max(high - FIRST_STEP, 0)
        elif high == count:
            entry = min(low + FIRST_STEP, count - 1)
        else:
            entry = (low + high) // 2
        if fits(entry, high):
            high = entry
        else:
            low = entry
    return high


def round_bound(bound: float, diagonal: float) -> float:
    """Return the bound, m, rounded up to one of few: near byte limits then give the same result."""
    step = math.log(BOUND_STEP_FACTOR)
    largest = MAX_BOUND_PER_DIAGONAL * diagonal
    return min(diagonal * math.exp(step * math.ceil(math.log(bound / diagonal) / step - 1e-9)), largest)

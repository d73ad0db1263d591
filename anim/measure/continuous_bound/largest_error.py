"""The largest distance between two versions of a clip at any time, for reports that name one number."""

from __future__ import annotations

from dataclasses import dataclass

from anim.measure.continuous_bound.intervals import LONG
from anim.measure.continuous_bound.prover import BOUND_SLACK, Proof, Prover
from anim.measure.error.metric import NOISE, cut_times
from anim.model import Clip, Interpolation


@dataclass(frozen=True, slots=True)
class Spacing:
    """Times that are looked at first. parts: of each gap between keys, at least. step: s, no part is longer.
    longest: s, as of `Prover.certified`."""

    parts: int
    step: float
    longest: float


LINES = Spacing(1, 1 / 30, LONG)  # lines between keys are farthest apart at keys, but for turns
CUBICS = Spacing(4, 1 / 30, 0.0)  # two cubics can be alike at keys and half-way, and far apart elsewhere
FINE = Spacing(16, 1 / 480, 0.0)  # where the first look proves nothing


def largest_error(prover: Prover, before: Clip, after: Clip, *, floor: float = 0.0) -> Proof:
    """Return how far `after` is from `before` at most, as the specification plays them, and a bound on it.

    All keys are looked at, the last moment before each jump, and between keys wherever any vertex could be farther off
    than what was seen already. `is_closed` says whether the largest distance was found.
    floor: m, of what is less than this nobody needs to know: the largest distance in other clips of a file.
    """
    is_cubic = any(
        track.interpolation is Interpolation.CUBICSPLINE for clip in (before, after) for track in clip.tracks
    )
    first = CUBICS if is_cubic else LINES
    found = _proof(prover, before, after, first, floor)
    if is_closed(found, prover.ruler.diagonal, floor=floor):
        return found
    again = _proof(prover, before, after, FINE, floor)
    bounds = [each.bound for each in (found, again) if each.bound is not None]
    worst = max(found, again, key=lambda each: each.error.max_error)
    return Proof(min(bounds, default=None), worst.error, worst.player)


def is_closed(proof: Proof, diagonal: float, *, floor: float = 0.0) -> bool:
    """Return whether no vertex is farther off than 2 % more than was seen, or than `floor` m, or than rounding.

    diagonal: m, of the scene's bounding box.
    """
    size = max(proof.error.max_error, floor)
    return proof.bound is not None and proof.bound - size <= 2 * max(BOUND_SLACK * size, NOISE * diagonal)


def _proof(prover: Prover, before: Clip, after: Clip, spacing: Spacing, floor: float) -> Proof:
    times = cut_times(before, after, parts=spacing.parts, step=spacing.step)
    look = prover.ruler.sample_errors(before, after, times)
    return prover.certified(before, after, times, {"spec": look}, floor=floor, longest=spacing.longest)

"""Largest distance between two versions of a clip at all times, for reports with a single number."""

from __future__ import annotations

from typing import NamedTuple

from anim.measure.continuous_bound.intervals import MAX_UNSPLIT_S
from anim.measure.continuous_bound.prover import BOUND_SLACK, Proof, Prover
from anim.measure.error.metric import NOISE
from anim.measure.error.sample_times import cut_times
from anim.model import Clip, Interpolation
from anim.sampling.times import MAX_FRAMES


class Spacing(NamedTuple):
    """Spacing of the first samples. parts: least number between keys. step: s, largest distance.

    longest: s, as for `Prover.certified`.
    """

    parts: int
    step: float
    longest: float


LINES = Spacing(1, 1 / 30, MAX_UNSPLIT_S)  # lines between keys differ most at keys, except for rotations
CUBICS = Spacing(4, 1 / 30, 0.0)  # two cubics can be equal at keys and half-way, and different elsewhere
FINE = Spacing(16, 1 / 480, 0.0)  # for intervals in which the first samples prove nothing


def largest_error(prover: Prover, before: Clip, after: Clip, *, floor: float = 0.0) -> Proof:
    """Return the largest error of `after`, interpolated as specified by glTF, and an upper bound of it.

    Samples are at all keys, at the last moment before each jump, and between keys wherever a vertex could have a larger
    error than the samples so far; not of skeletons with hundreds of levels. `is_closed` tells if the largest error was
    found.
    floor: m, smaller errors are not refined: the largest error of other clips of a file.
    """
    is_cubic = any(
        track.interpolation is Interpolation.CUBICSPLINE for clip in (before, after) for track in clip.tracks
    )
    first = CUBICS if is_cubic else LINES
    found = _proof(prover, before, after, first, floor)
    is_short = max(before.end, after.end) < MAX_FRAMES * FINE.step
    if is_closed(found, prover.ruler.diagonal, floor=floor) or not prover.is_refined or not is_short:
        return found
    again = _proof(prover, before, after, FINE, floor)
    bounds = [each.bound for each in (found, again) if each.bound is not None]
    worst = max(found, again, key=lambda each: each.error.max_error)
    return Proof(min(bounds, default=None), worst.error, worst.player)


def is_closed(proof: Proof, diagonal: float, *, floor: float = 0.0) -> bool:
    """Return whether the bound is at most 2 % above the largest sample, or below `floor` m or rounding.

    diagonal: m, of the scene's bounding box.
    """
    size = max(proof.error.max_error, floor)
    return proof.bound is not None and proof.bound - size <= 2 * max(BOUND_SLACK * size, NOISE * diagonal)


def _proof(prover: Prover, before: Clip, after: Clip, spacing: Spacing, floor: float) -> Proof:
    times = cut_times(before, after, parts=spacing.parts, step=spacing.step)
    look = prover.ruler.sample_errors(before, after, times)
    return prover.certified(before, after, times, look, floor=floor, longest=spacing.longest)

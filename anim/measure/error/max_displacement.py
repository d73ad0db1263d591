"""The longest displacement of a field: vertices are evaluated where their bounds don't settle it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import MAX_SINGLE_M, Floats, Ints
from anim.measure.error.displacement import CHUNK, DisplacementField, SkinnedDisplacement, vector_lengths

MAX_TERM_RATIO = 20.0  # of the largest term of a vector to the longest vector; beyond it float32 loses digits
FIRST = 8  # frames evaluated before the bounds of the others are updated


class MaxDisplacement(NamedTuple):
    """The longest vector of a field. vertex: index in the group, −1 if only the bound was evaluated.

    limits: (G, F), the field's own; where vertices were evaluated, at most the longest of them.
    """

    length: float
    group: int
    frame: int
    vertex: int
    limits: Floats


def lengths(field: DisplacementField, group: int, frames: Ints) -> Floats:
    """Return the lengths (V_g, f) of the vectors of a group's vertices in some frames."""
    if isinstance(field, SkinnedDisplacement):
        return field.lengths(group, frames)
    return vector_lengths(field.vectors(group, frames))


def lengths_by_group(field: DisplacementField, groups: int, frames: Ints) -> list[Floats]:
    """Return the lengths of the vectors of all groups in some frames, in the order of groups, vertices, frames: flat.

    Skinned ones are computed in float32, in half of the time, where the longest is right to about a millionth there:
    not if terms cancel, as those of a model far from the origin do.
    """
    if isinstance(field, SkinnedDisplacement):
        single, largest = field.in_single_precision()
        if largest < MAX_SINGLE_M:
            found = _flat_lengths(single, groups, frames)
            longest = max((float(each.max(initial=0.0)) for each in found), default=0.0)
            if largest <= MAX_TERM_RATIO * longest:
                return found
    return _flat_lengths(field, groups, frames)


def _flat_lengths(field: DisplacementField, groups: int, frames: Ints) -> list[Floats]:
    if isinstance(field, SkinnedDisplacement) and (found := field.uniform_vectors(frames)) is not None:
        found *= found
        return [np.sqrt(found.sum(axis=2)).reshape(-1)]
    return [lengths(field, group, frames).reshape(-1) for group in range(groups)]


def max_displacement(field: DisplacementField, *, floor: float, slack: float, most: int) -> MaxDisplacement:
    """Return the longest vector: a bound that is at most `slack` times or `floor` above its length.

    floor: groups with smaller bounds are not searched. slack: ≥ 1. most: vertices × frames that are evaluated; if there
    are more, the bound of the rest is returned.
    """
    tops = field.limits.max(axis=1)
    group = int(tops.argmax())
    found = MaxDisplacement(0.0, group, int(field.limits[group].argmax()), -1, field.limits.copy())
    left = 0.0  # the largest bound of groups that were not evaluated
    for group in np.argsort(-tops, kind="stable").tolist():
        if tops[group] <= max(found.length * slack, floor) or most <= 0:
            left = max(left, float(tops[group]))  # those of the groups that follow are no larger
            break
        limits = field.limits[group]
        waiting = np.argsort(-limits, kind="stable")
        size = FIRST
        while len(waiting):
            at_most = float(limits[waiting[0]])
            if at_most <= max(found.length * slack, floor) or most <= 0:
                left = max(left, at_most)
                break
            frames, waiting = waiting[:size], waiting[size:]
            lengths_here = lengths(field, group, frames)
            found.limits[group, frames] = lengths_here.max(axis=0)
            vertex, column = np.unravel_index(int(lengths_here.argmax()), lengths_here.shape)
            if lengths_here[vertex, column] > found.length:
                length = float(lengths_here[vertex, column])
                found = MaxDisplacement(length, group, int(frames[column]), int(vertex), found.limits)
            most -= lengths_here.size
            size = max(min(2 * size, CHUNK // max(len(lengths_here), 1)), 1)
    return found if left <= found.length else found._replace(length=left)

"""Limit of colliders that overlap at the start: the engine holds 3 to 9 kB a pair, and solves it in every step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import UnsupportedError
from anim.maths import quaternion
from anim.simulation.rigid_bodies.description import CollisionFilter
from anim.simulation.rigid_bodies.filters import match_filters
from anim.simulation.rigid_bodies.rigid_scene import BodyKind, RigidScene

# Pairs of boxes around colliders. 20 000 take 80 to 180 MB, and a step of boxes 0.06 to 0.16 s, of round hulls 0.6 s. A
# dense pile is not limited: its colliders have 13 neighbors each, of which each counts half.
MAX_PAIRS, MAX_PAIRS_PER_COLLIDER = 20_000, 32
SAME_BODY_WEIGHT = 1 / 8  # of pairs that the engine finds and leaves out


class _Boxes(NamedTuple):
    """Boxes around C colliders in the scene, from low to high (C, 3) m, in the order of their low ends along `axis`.

    bodies, filters: (C,) indices.
    """

    low: Floats
    high: Floats
    bodies: Ints
    is_dynamic: Bools
    filters: Ints
    axis: int


def check_overlaps(scene: RigidScene) -> None:
    """Raise UnsupportedError where dynamic colliders overlap too many others, by the boxes around them at the start.

    Pairs of one body count an eighth, those that filters keep apart not at all. Planes have no box.
    """
    matches = match_filters(scene)
    boxes = _find_boxes(scene, {each: i for i, each in enumerate(matches)})
    collide = np.array(list(matches.values()), np.bool_)
    most = MAX_PAIRS + MAX_PAIRS_PER_COLLIDER * int(boxes.is_dynamic.sum())
    count = 0.0
    for i, others in _overlapping(boxes):
        is_same = boxes.bodies[others] == boxes.bodies[i]
        count += np.count_nonzero(~is_same & collide[boxes.filters[i]][boxes.filters[others]])
        count += SAME_BODY_WEIGHT * np.count_nonzero(is_same)
        if count > most:
            raise UnsupportedError(
                f"more than {most} pairs of colliders overlap at the start (limit {MAX_PAIRS}, and "
                f"{MAX_PAIRS_PER_COLLIDER} for each dynamic collider)",
                help="move the bodies apart, or let filters keep them from colliding",
            )


def _find_boxes(scene: RigidScene, filters: dict[CollisionFilter, int]) -> _Boxes:
    own = [(i, body, each) for i, body in enumerate(scene.bodies) for each in body.colliders]
    own = [found for found in own if found[2].shape.kind != "plane"]
    extents = [scene.extents.of(each.shape) for _, _, each in own]
    in_body = quaternion.to_matrix(np.array([each.frame.rotation for _, _, each in own]).reshape(-1, 4))
    in_scene = quaternion.to_matrix(np.array([body.frame.rotation for _, body, _ in own]).reshape(-1, 4))
    position = np.array([each.frame.position for _, _, each in own]).reshape(-1, 3)
    position = position + np.einsum("cij,cj->ci", in_body, np.array([e.center for e in extents]).reshape(-1, 3))
    center = np.array([body.frame.position for _, body, _ in own]).reshape(-1, 3)
    center = center + np.einsum("cij,cj->ci", in_scene, position)
    half = np.array([each.half_sizes for each in extents]).reshape(-1, 3)
    half = np.einsum("cij,cj->ci", np.abs(in_scene @ in_body), half)
    axis = int(np.ptp(center, axis=0).argmax()) if own else 0
    order = np.argsort((center - half)[:, axis], kind="stable")
    return _Boxes(
        (center - half)[order],
        (center + half)[order],
        np.array([index for index, _, _ in own], np.int64)[order],
        np.array([body.kind is BodyKind.DYNAMIC for _, body, _ in own], np.bool_)[order],
        np.array([filters[each.filter] for _, _, each in own], np.int64)[order],
        axis,
    )


def _overlapping(boxes: _Boxes) -> Iterator[tuple[int, Ints]]:
    """Indices of a box, and of those after it that overlap it, where one of both is dynamic.

    Each is compared with those that begin before it ends; a box that isn't dynamic with the dynamic ones alone.
    """
    low, high, axis = boxes.low, boxes.high, boxes.axis
    ends = np.searchsorted(low[:, axis], high[:, axis], side="right")
    dynamic = np.flatnonzero(boxes.is_dynamic)
    first, last = (np.searchsorted(dynamic, each, side="left") for each in (np.arange(len(low)) + 1, ends))
    for i in np.flatnonzero(boxes.is_dynamic | (first < last)).tolist():
        others = np.arange(i + 1, ends[i]) if boxes.is_dynamic[i] else dynamic[first[i] : last[i]]
        is_met = (low[others] <= high[i]).all(axis=1) & (high[others] >= low[i]).all(axis=1)
        yield i, others[is_met]

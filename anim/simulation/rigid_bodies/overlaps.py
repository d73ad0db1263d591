"""Limit of colliders that overlap at the start: the engine holds 3 kB for each pair, and solves it in every step."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import UnsupportedError
from anim.maths import quaternion
from anim.simulation.rigid_bodies.description import CollisionFilter, Shape
from anim.simulation.rigid_bodies.rigid_scene import BodyKind, RigidScene
from anim.simulation.rigid_bodies.shapes import NUM_SHARED, surface_points

# Pairs of boxes around colliders: those of a dense pile have 13 neighbors each, of which it counts half.
MAX_PAIRS, MAX_PAIRS_PER_COLLIDER = 1000, 32
SAME_BODY_WEIGHT = 1 / 8  # of pairs that the engine finds and leaves out


def check_overlaps(scene: RigidScene) -> None:
    """Raise UnsupportedError where dynamic colliders overlap too many others, by the boxes around them at the start.

    Pairs of one body count an eighth, those that filters keep apart not at all. Planes have no box.
    """
    own = [(i, body, each) for i, body in enumerate(scene.bodies) for each in body.colliders]
    own = [found for found in own if found[2].shape.kind != "plane"]
    if not own:
        return
    boxes = [_shape_box(each.shape) for _, _, each in own]
    in_body = quaternion.to_matrix(np.array([each.frame.rotation for _, _, each in own]))
    in_scene = quaternion.to_matrix(np.array([body.frame.rotation for _, body, _ in own]))
    position = np.array([each.frame.position for _, _, each in own])
    position = position + np.einsum("cij,cj->ci", in_body, np.array([center for center, _ in boxes]))
    center = np.array([body.frame.position for _, body, _ in own]) + np.einsum("cij,cj->ci", in_scene, position)
    half = np.einsum("cij,cj->ci", np.abs(in_scene @ in_body), np.array([half for _, half in boxes]))
    axis = int(np.ptp(center, axis=0).argmax())
    order = np.argsort((center - half)[:, axis], kind="stable")
    low, high = (center - half)[order], (center + half)[order]
    bodies = np.array([index for index, _, _ in own])[order]
    is_dynamic = np.array([body.kind is BodyKind.DYNAMIC for _, body, _ in own])[order]
    filters = {each: i for i, each in enumerate(dict.fromkeys(each.filter for _, _, each in own))}
    groups = np.array([filters[each.filter] for _, _, each in own])[order]
    collide = _accepted(list(filters))
    most = MAX_PAIRS + MAX_PAIRS_PER_COLLIDER * int(is_dynamic.sum())
    ends = np.searchsorted(low[:, axis], high[:, axis], side="right")
    count = 0.0
    for i, end in enumerate(ends.tolist()):
        later = slice(i + 1, end)
        found = (low[later] <= high[i]).all(axis=1) & (high[later] >= low[i]).all(axis=1)
        found &= is_dynamic[later] | is_dynamic[i]
        is_same = bodies[later] == bodies[i]
        count += np.count_nonzero(found & ~is_same & collide[groups[i]][groups[later]])
        count += SAME_BODY_WEIGHT * np.count_nonzero(found & is_same)
        if count > most:
            raise UnsupportedError(
                f"more than {most} pairs of colliders overlap at the start (limit {MAX_PAIRS}, and "
                f"{MAX_PAIRS_PER_COLLIDER} for each dynamic collider)",
                help="move the bodies apart, or let filters keep them from colliding",
            )


def _accepted(filters: list[CollisionFilter]) -> Bools:
    """Table (n, n) of filters, True where colliders of both collide."""
    return np.array([[own.accepts(other) and other.accepts(own) for other in filters] for own in filters])


@lru_cache(NUM_SHARED)
def _shape_box(shape: Shape) -> tuple[Floats, Floats]:
    """Center (3,) and half sizes (3,) of the box around a shape, in its collider's frame."""
    if shape.kind == "box":
        return np.array(shape.center), np.array(shape.size) / 2
    if shape.kind == "sphere":
        return np.array(shape.center), np.full(3, shape.size[0])
    points = shape.points if shape.kind in ("hull", "mesh") else surface_points(shape) + shape.center
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, (high - low) / 2

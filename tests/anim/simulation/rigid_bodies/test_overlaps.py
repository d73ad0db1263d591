"""Limit of colliders that overlap at the start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from anim.errors import UnsupportedError
from anim.simulation.rigid_bodies import overlaps
from anim.simulation.rigid_bodies.description import CollisionFilter, Shape
from anim.simulation.rigid_bodies.overlaps import check_overlaps
from anim.simulation.rigid_bodies.rigid_scene import BodyKind, RigidBody, RigidScene
from tests.anim.simulation.rigid_bodies.cases import (
    Array,
    body,
    collider,
    document,
    ground,
    needs_rapier,
    node,
    simulate,
)

BOX = Shape("box", (1.0, 1.0, 1.0))


@pytest.fixture(autouse=True)
def _no_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(overlaps, "MAX_PAIRS", 0)
    monkeypatch.setattr(overlaps, "MAX_PAIRS_PER_COLLIDER", 0)


def check(*bodies: RigidBody) -> None:
    check_overlaps(RigidScene(bodies, (), (0, -9.81, 0)))


def turned(made: RigidBody, rotation: Array) -> RigidBody:
    return replace(made, frame=replace(made.frame, rotation=rotation))


@pytest.mark.parametrize(
    ("shape", "position"),
    [
        (BOX, (0.9, 0.9, -0.9)),
        (Shape("sphere", (0.5,), center=(3, 0, 0)), (-3.9, 0, 0)),
        (Shape("capsule", (2.0, 0.25, 0.25)), (0, 1.7, 0)),
        (Shape("hull", points=np.array([[0.0, 0, 0], [4, 0, 0], [0, 1, 0], [0, 0, 1]])), (-4.4, 0, 0)),
    ],
    ids=["box", "sphere", "capsule", "hull"],
)
def test_shapes_in_each_other_are_found(shape: Shape, position: ArrayLike) -> None:
    with pytest.raises(UnsupportedError, match="overlap at the start"):
        check(body(BOX), body(shape, position))
    check(body(BOX), body(shape, 1.5 * np.array(position)))


def test_boxes_turn_with_their_bodies() -> None:
    plank, quarter = Shape("box", (4.0, 0.2, 0.2)), np.array([0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    check(body(BOX), body(plank, (0, 2, 0)))
    with pytest.raises(UnsupportedError):
        check(body(BOX), turned(body(plank, (0, 2, 0)), quarter))


def test_bodies_that_never_meet_do_not_count() -> None:
    check(*(body(BOX, kind=BodyKind.STATIC) for _ in range(3)))
    check(body(BOX), ground())
    apart = CollisionFilter(frozenset({"dust"}), not_collide_with=frozenset({"dust"}))
    check(*(body(BOX, own=apart) for _ in range(3)))
    check()


def test_colliders_of_one_body_count_an_eighth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(overlaps, "MAX_PAIRS", 1)
    one = body(BOX)
    check(replace(one, colliders=one.colliders * 4))
    with pytest.raises(UnsupportedError, match="more than 1 pairs"):
        check(replace(one, colliders=one.colliders * 5))


@needs_rapier
def test_a_run_is_refused_before_it_begins() -> None:
    made = document([node(motion={}, collider=collider(0)) for _ in range(2)], [{"type": "box"}])
    with pytest.raises(UnsupportedError, match="overlap at the start") as caught:
        simulate(made)
    assert "filters" in caught.value.help

"""Limit of colliders that overlap at the start."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any

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


def test_pairs_are_those_of_a_plain_loop() -> None:
    random = np.random.default_rng(0)
    kinds = [BodyKind.DYNAMIC if is_moved else BodyKind.STATIC for is_moved in random.random(80) < 0.5]
    places, sizes = random.random((80, 3)) * 6, random.random((80, 3)) * 2
    bodies = [
        body(Shape("box", tuple(size)), at, kind=kind) for size, at, kind in zip(sizes, places, kinds, strict=True)
    ]
    expected = 0
    for i, j in combinations(range(80), 2):
        if BodyKind.DYNAMIC in (kinds[i], kinds[j]):
            expected += bool((np.abs(places[i] - places[j]) <= (sizes[i] + sizes[j]) / 2).all())
    assert expected > 50
    assert sum(len(others) for _, others in pairs(*bodies)) == expected


def test_bodies_that_never_move_are_not_compared_with_each_other() -> None:
    """One body beside 20 000 static ones took 19 s."""
    still = [body(BOX, (x, 0, 0), kind=BodyKind.STATIC) for x in np.linspace(0, 1e-3, 500)]
    assert len(pairs(*still, body(BOX, (5, 0, 0)))) == 1
    ((_, others),) = pairs(body(BOX, (-0.5, 0, 0)), *still)
    assert len(others) == 500


def pairs(*bodies: RigidBody) -> list[tuple[int, Any]]:
    made = RigidScene(bodies, (), (0, -9.81, 0))
    return list(overlaps._overlapping(overlaps._find_boxes(made, {CollisionFilter(): 0})))


def test_a_slab_may_lie_on_many_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    """1500 were refused, which Rapier holds in 22 MB, and advances in 5 ms."""
    monkeypatch.undo()
    boxes = [body(BOX, (1.2 * (i % 40), 0, 1.2 * (i // 40)), kind=BodyKind.STATIC) for i in range(1600)]
    check(*boxes, body(Shape("box", (100.0, 1.0, 100.0)), (25, 0.9, 25)))
    with pytest.raises(UnsupportedError, match=r"more than 26432 pairs .* \(limit 20000, and 32 for each dynamic"):
        check(*(body(Shape("box", (0.1, 0.1, 0.1))) for _ in range(201)), *(body(BOX, kind=BodyKind.STATIC),) * 40)


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

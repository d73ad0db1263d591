"""Collision filters of a scene: pairs that collide, and the engine's limit."""

from __future__ import annotations

import pytest

from anim.errors import UnsupportedError
from anim.simulation.rigid_bodies import overlaps
from anim.simulation.rigid_bodies.description import CollisionFilter, Shape
from anim.simulation.rigid_bodies.filters import match_filters
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from tests.anim.simulation.rigid_bodies.cases import body

BOX = Shape("box", (1.0, 1.0, 1.0))


def scene(*filters: CollisionFilter) -> RigidScene:
    return RigidScene(tuple(body(BOX, own=each) for each in filters), (), (0.0, 0.0, 0.0))


def numbered(number: int) -> CollisionFilter:
    return CollisionFilter(frozenset({str(number)}))


def test_both_of_a_pair_accept_each_other() -> None:
    dust, wall = CollisionFilter(frozenset({"dust"}), collide_with=frozenset({"wall"})), CollisionFilter()
    named = CollisionFilter(frozenset({"wall"}))
    found = match_filters(scene(dust, wall, named, dust))
    assert found == {dust: [False, False, True], wall: [False, True, True], named: [True, True, True]}


def test_filters_are_counted_before_they_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thousand of them are a million pairs."""
    assert len(match_filters(scene(*map(numbered, range(32))))) == 32
    monkeypatch.setattr(CollisionFilter, "accepts", None)
    many = scene(*map(numbered, range(33)))
    for check in (match_filters, overlaps.check_overlaps):
        with pytest.raises(UnsupportedError, match=r"33 different collision filters \(limit 32\)") as caught:
            check(many)
        assert "one filter" in caught.value.help

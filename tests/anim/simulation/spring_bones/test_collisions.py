"""Collisions of many joints and colliders: one after another, however many are evaluated at once."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.simulation.spring_bones import collisions
from anim.simulation.spring_bones.colliders import Collider, ColliderShape, Vector
from anim.simulation.spring_bones.collisions import Collisions

NUM_JOINTS, NUM_COLLIDERS = 7, 40


def vector(g: np.random.Generator) -> Vector:
    x, y, z = g.uniform(-1, 1, 3).tolist()
    return x, y, z


def resolve(order: list[int] | None = None) -> Floats:
    """Tails (m, 3) of joints in a crowd of spheres, capsules and planes, of which each has its own selection."""
    g = np.random.default_rng(3)
    shapes = list(ColliderShape)
    found = [
        Collider(
            0,
            shapes[i % 3],
            offset=vector(g),
            radius=0.3,
            tail=vector(g),
            normal=(0.0, 1.0, 0.0) if i % 2 else (1.0, 0.0, 0.0),
            inside=i % 9 == 0,
        )
        for i in range(NUM_COLLIDERS)
    ]
    chosen: list[list[int]] = [g.permutation(NUM_COLLIDERS)[: 5 * i].tolist() for i in range(NUM_JOINTS)]
    head = g.uniform(-1, 1, (NUM_JOINTS, 3))
    length = g.uniform(0.3, 1, (NUM_JOINTS, 1))
    tail = head + length * np.array([1.0, 0, 0])
    rows = np.zeros(NUM_COLLIDERS, np.int64)
    radius = np.full(NUM_JOINTS, 0.02)
    world = np.eye(3, 4)[None]
    if order is None:
        return Collisions(found, chosen, radius, rows).resolve(world, head, length, tail)
    for i in order:  # joint by joint, collider by collider
        for index in chosen[i]:
            one = Collisions(found, [[index]], radius[i : i + 1], rows)
            tail[i] = one.resolve(world, head[i : i + 1], length[i : i + 1], tail[i : i + 1])[0]
    return np.asarray(tail)


@pytest.mark.parametrize("size", [1, 3, 16, 512])
def test_colliders_act_in_their_order_whatever_the_size_of_a_block(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = resolve(list(range(NUM_JOINTS)))
    monkeypatch.setattr(collisions, "BLOCK_PAIRS", size)
    np.testing.assert_array_equal(resolve(), expected)

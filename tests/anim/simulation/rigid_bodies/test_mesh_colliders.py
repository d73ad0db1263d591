"""Meshes of bodies: those without a volume, those that can't be divided, and one of many bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.errors import FormatError, UnsupportedError
from anim.maths import quaternion
from anim.memory import memory_limit
from anim.simulation.rigid_bodies.description import Shape
from anim.simulation.rigid_bodies.rapier import shapes
from anim.simulation.rigid_bodies.rapier.shapes import ShapeBuilder
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from anim.simulation.rigid_bodies.shapes import ScaledShapes
from tests.anim.simulation.rigid_bodies.cases import Array, body, needs_rapier, run

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
NOTCHED = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 0.2, 0], [0, 1, 0]])  # a profile that isn't convex


def mesh(points: Array, faces: list[list[int]]) -> Shape:
    return Shape("mesh", points=points, faces=np.array(faces))


@needs_rapier
@pytest.mark.parametrize("faces", [[[0, 0, 0]], [[0, 1, 1], [2, 3, 3]], [[0, 1, 2]]], ids=["point", "lines", "flat"])
def test_triangles_without_volume_are_refused_whatever_their_vertices(faces: list[list[int]]) -> None:
    with pytest.raises(FormatError, match="flat: its hull has no volume"):
        run(body(mesh(CORNERS, faces)))


@needs_rapier
def test_a_needle_is_its_hull() -> None:
    """Rapier panics for this mesh, of which it finds no convex piece."""
    thin = [1, 1e-3, 1e-3]
    points = np.array([[0.7, 0.3, 0.1], [0.3, 0.9, 0.8], [0.0, 0.2, 0.3], [0.9, 0.4, 0.2]]) * thin
    needle = body(mesh(points, [[3, 2, 0], [0, 1, 2]]))
    builder = ShapeBuilder(RigidScene((needle,), (), (0, 0, 0)), np.zeros(3), 1.0, 1.0, "node {}".format)
    assert builder.build(needle.colliders[0], needle).as_convex_polyhedron() is not None


@needs_rapier
def test_crossing_triangles_are_refused_before_they_are_divided() -> None:
    points = np.random.default_rng(0).random((400, 3))
    faces = [[0, i, i + 1] for i in range(1, 398)]
    with pytest.raises(
        UnsupportedError, match=r"the mesh of node 0 is too large .*: area 66.* \(limit 25, in squares"
    ) as caught:
        run(body(mesh(points, faces)))
    assert "hull" in caught.value.help


@needs_rapier
def test_all_meshes_of_a_scene_have_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    depth = np.concatenate([NOTCHED, NOTCHED + np.array([0, 0, 1])])
    sides = [[i, (i + 1) % 5, i + 5] for i in range(5)] + [[(i + 1) % 5, (i + 1) % 5 + 5, i + 5] for i in range(5)]
    caps = [[3, 1, 0], [3, 2, 1], [4, 3, 0]]
    faces = [*sides, *caps, *([c + 5, b + 5, a + 5] for a, b, c in caps)]
    run(*(body(mesh(depth, faces), (4 * i, 0, 0)) for i in range(2)), seconds=0.01)
    monkeypatch.setattr(shapes, "MAX_AREA_OF_SCENE", 4.0)
    with pytest.raises(UnsupportedError, match=r"all concave dynamic meshes together are .* \(limit 4, in"):
        run(*(body(mesh(depth, faces), (4 * i, 0, 0)) for i in range(2)))


@needs_rapier
def test_bodies_of_one_mesh_share_its_hull(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    hull = ShapeBuilder._hull

    def count(*args: Any) -> Any:
        asked.append(args)
        return hull(*args)

    monkeypatch.setattr(ShapeBuilder, "_hull", count)
    shape = Shape("hull", points=CORNERS)
    motion = run(*(body(shape, (2 * i, 0, 0)) for i in range(5)), seconds=0.1)
    assert len(asked) == 1
    np.testing.assert_allclose(motion.positions[-1, :, 1], motion.positions[-1, 0, 1], atol=1e-6)


def test_scales_that_differ_by_rounding_give_one_shape() -> None:
    made, shape = ScaledShapes(), Shape("hull", points=CORNERS)
    first = made.scale(shape, 0.7 * np.eye(3))
    turn = quaternion.to_matrix(np.array([0.5, 0.5, 0.5, 0.5]))
    assert made.scale(shape, turn.T @ (0.7 * turn) + 1e-17) is first
    assert made.scale(shape, 0.7001 * np.eye(3)) is not first
    assert made.scale(shape, -0.7 * np.eye(3)) is not first
    assert made.scale(Shape("hull", points=CORNERS), 0.7 * np.eye(3)) is not first
    assert made.scale(shape, np.eye(3) + 1e-16) is shape


def test_many_scales_of_a_mesh_are_counted_before_they_are_made() -> None:
    made, shape = ScaledShapes(), mesh(CORNERS, [[0, 1, 2]])
    with memory_limit(4000):
        for _ in range(20):
            made.scale(shape, 2 * np.eye(3))
        for scale in range(3, 11):
            made.scale(shape, scale * np.eye(3))
        with pytest.raises(UnsupportedError, match=r"under different scales would take 4\.41e-06 GB"):
            made.scale(shape, 11 * np.eye(3))

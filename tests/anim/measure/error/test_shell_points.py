"""Shells around nodes without vertices: closed forms, scaled parents, and who gets one."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.error.metric import ErrorMetric
from anim.measure.error.shell_points import nodes_without_vertices
from anim.measure.error.surface import surfaces
from anim.model import Mesh, MeshInstance, Scene, Skeleton
from tests.clips import about, clip, skeleton, track

NOTHING = np.empty(0)


def test_a_socket_that_turns_moves_its_shell_by_the_chord() -> None:
    """Node 0 has a bar of 10 m; node 1, 3 m off, carries nothing. Its shell has a radius of 10 cm."""
    scene = _bar(skeleton([-1, 0], translation=[[0, 0, 0], [3, 0, 0]]))
    turned = clip(track("rotation", [0], about("z", [2]), node=1))
    assert ErrorMetric(scene).error(clip(), turned).max_error == 0
    found = ErrorMetric(scene, shell=0.1).error(clip(), turned)
    assert found.max_error == pytest.approx(2 * 0.1 * np.sin(np.radians(1)), rel=1e-3)
    assert (found.place, found.joint, found.vertex) == ("1", "1", -1)
    moved = clip(track("translation", [0], [[3, 0.25, 0]], node=1))
    assert ErrorMetric(scene, shell=0.1).error(clip(), moved).max_error == pytest.approx(0.25, rel=1e-3)


def test_the_radius_is_meters_of_the_world_whatever_hangs_above() -> None:
    nodes = skeleton([-1, -1, 1], scale=[[1, 1, 1], [100, 100, 0.01], [1, 1, 1]])
    turned = clip(track("rotation", [0], about("z", [2]), node=2))
    found = ErrorMetric(_bar(nodes), shell=0.1).error(clip(), turned)
    assert found.max_error == pytest.approx(2 * 0.1 * np.sin(np.radians(1)), rel=1e-3)


def test_the_farthest_of_six_points_counts() -> None:
    """Moved by (1, 2, 3) mm and turned half about y: the ends along x and z go furthest."""
    scene = _bar(skeleton([-1, 0]))
    after = clip(
        track("rotation", [0], about("y", [180]), node=1), track("translation", [0], [[0.001, 0.002, 0.003]], node=1)
    )
    ends = [np.add([0.001, 0.002, 0.003], end) for end in ([-0.2, 0, 0], [0.2, 0, 0], [0, 0, 0.2], [0, 0, -0.2])]
    expected = max(np.linalg.norm(end) for end in ends)
    assert ErrorMetric(scene, shell=0.1).error(clip(), after).max_error == pytest.approx(expected, rel=1e-12)


def test_who_is_hidden() -> None:
    """0 carries a mesh; 1 hangs below it; 2 is above 3, which carries the other; 4 hangs alone."""
    nodes = skeleton([-1, 0, -1, 2, -1])
    scene = Scene(nodes, tuple(MeshInstance(i, _points(10.0), None, NOTHING) for i in (0, 3)))
    assert np.flatnonzero(nodes_without_vertices(nodes, surfaces(scene))).tolist() == [1, 4]


def _bar(nodes: Skeleton) -> Scene:
    return Scene(nodes, (MeshInstance(0, _points(10.0), None, NOTHING),))


def _points(length: float) -> Mesh:
    points = np.array([[0, 0, 0], [length, 0, 0]])
    none = np.empty((2, 0))
    return Mesh("bar", points, np.empty((0, 3), np.int64), none.astype(np.int64), none, np.empty((0, 2, 3)), NOTHING)

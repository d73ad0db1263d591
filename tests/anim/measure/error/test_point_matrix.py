"""Measured points, against plain loops over vertices."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.error import point_matrix as points_
from anim.measure.error.point_matrix import CARRIED, PointMatrix, all_points, sample_points
from anim.measure.error.point_rows import OneJointRows, stack_points
from anim.measure.error.surface import surfaces
from anim.model import MeshInstance, Scene, Skin
from anim.sampling import rest_pose, world_matrices
from tests.anim.optimization.making import JOINTS, every_point, scene
from tests.anim.skinning.scenes import looped, mesh
from tests.anim.skinning.scenes import scene as made
from tests.calls import count_calls
from tests.clips import skeleton

RNG = np.random.default_rng(3)
NONE = np.zeros(0)


def _world(of: Scene, frames: int = 4) -> Floats:
    """World matrices (N, F, 3, 4) of no particular pose."""
    return RNG.normal(size=(len(of.skeleton), frames, 3, 4))


def _places(of: Scene, world: Floats) -> Floats:
    """Every vertex (V, F, 3), by loops over frames, vertices and influences."""
    (instance,) = of.instances
    assert instance.skin is not None
    bind = np.concatenate((instance.skin.inverse_bind, np.tile([[[0.0, 0, 0, 1]]], (JOINTS, 1, 1))), axis=1)
    bound = np.swapaxes(world[instance.skin.joints], 0, 1) @ bind
    mesh = instance.mesh
    return looped(mesh.positions, mesh.joints, mesh.weights, bound).swapaxes(0, 1)


def test_places_are_those_of_every_vertex() -> None:
    of = scene()
    world = _world(of)
    points = every_point(of)
    assert points.places(world) == pytest.approx(_places(of, world), abs=1e-9)


@pytest.mark.parametrize("dense", [0, 10**9])
def test_moves_are_differences_of_places(dense: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points_, "DENSE", dense)
    of = scene()
    points = every_point(of)
    a, b = _world(of), _world(of)
    moved = points.rows().moves(stack_points(b, points.nodes) - stack_points(a, points.nodes))
    assert moved.swapaxes(1, 2) == pytest.approx(_places(of, b) - _places(of, a), abs=1e-4)


def test_a_joint_twice_on_one_vertex_counts_twice() -> None:
    of = made(mesh([[1.0, 0, 0]], [[0, 0]], [[0.25, 0.75]]), [-1])
    points = every_point(of)
    world = np.eye(4)[:3][None, None] * np.array([2.0, 1, 1, 1])[:, None][:3]
    world = np.repeat(world, 2, axis=0)
    moved = points.rows().moves(
        stack_points(world, points.nodes) - stack_points(np.tile(np.eye(4)[:3], (2, 1, 1, 1)), points.nodes)
    )
    assert moved[0, :, 0] == pytest.approx([1, 0, 0])


def test_shells_are_six_points_around_a_node() -> None:
    of = Scene(skeleton([-1, 0], translation=[[1, 0, 0], [0, 2, 0]], scale=[[2, 2, 2], [1, 1, 1]]), ())
    points = sample_points(of, {1}, 0.25)
    world = world_matrices(of.skeleton, rest_pose(of.skeleton)).swapaxes(0, 1)
    places = points.places(world)[:, 0]
    assert places.mean(axis=0) == pytest.approx([1, 4, 0])
    assert np.linalg.norm(places - [1, 4, 0], axis=1) == pytest.approx(
        np.full(6, 0.25)
    )  # metres of the world, under any scale
    assert len(np.unique(places.round(9), axis=0)) == 6


def test_nothing_to_measure() -> None:
    points = sample_points(Scene(skeleton([-1]), ()), frozenset(), 1.0)
    assert len(points) == 0
    assert points.places(np.ones((1, 5, 3, 4))).shape == (0, 5, 3)


def test_what_sticks_out_is_measured() -> None:
    """For every joint and direction of its space, no vertex that it carries most lies beyond the chosen ones."""
    of = scene(8)
    (surface,) = surfaces(of)
    chosen = sorted(points_.extreme_vertices(surface))
    assert 0 < len(chosen) < 60
    (instance,) = of.instances
    assert instance.skin is not None
    for joint in range(JOINTS):
        bind = instance.skin.inverse_bind[joint]
        most = [v for v in range(60) if instance.mesh.joints[v][instance.mesh.weights[v].argmax()] == joint]
        some = [
            v
            for v in range(60)
            if any(
                j == joint and w > CARRIED
                for j, w in zip(instance.mesh.joints[v], instance.mesh.weights[v], strict=True)
            )
        ]
        for mine in (most, some):
            local = {v: bind[:, :3] @ instance.mesh.positions[v] + bind[:, 3] for v in mine}
            for axis in range(3):
                for sign in (1, -1):
                    best = max((sign * place[axis] for place in local.values()), default=-np.inf)
                    assert max((sign * local[v][axis] for v in chosen if v in local), default=-np.inf) == best


def test_extra_vertices_are_measured_too() -> None:
    of = scene()
    usual = sample_points(of, frozenset(), 0.0)
    (surface,) = surfaces(of)
    missing = min(set(range(60)) - points_.extreme_vertices(surface))
    assert len(sample_points(of, frozenset(), 0.0, {(0, missing)})) == len(usual) + 1
    assert len(sample_points(of, frozenset(), 0.0, {(1, missing)})) == len(usual)


def test_meshes_of_different_numbers_of_influences() -> None:
    """A skinned mesh and two on their nodes: their points follow one another."""
    skinned = made(mesh([[1.0, 0, 0], [0, 2, 0]], [[0, 1], [1, 0]], [[0.5, 0.5], [0.75, 0.25]]), [-1, 0, 1])
    corners = np.array([[0.0, 0, 1], [0, 1, 1]])
    rigid = mesh(corners, [[0], [0]], [[1.0], [1.0]])
    instances = [*skinned.instances, *(MeshInstance(node, rigid, None, np.zeros(0)) for node in (2, 0))]
    of = Scene(skinned.skeleton, tuple(instances))
    world = _world(of)
    found = all_points(of, 0.0).places(world)
    assert found[:2] == pytest.approx(all_points(skinned, 0.0).places(world))
    for at, node in ((2, 2), (4, 0)):
        expected = np.einsum("fab,vb->vfa", world[node][..., :3], corners) + world[node][..., 3]
        assert found[at : at + 2] == pytest.approx(expected)


def test_morphed_as_at_rest() -> None:
    of = made(mesh([[1.0, 0, 0]], [[0]], [[1.0]], targets=[[[0, 2.0, 0]]], rest_weights=[0.5]), [-1])
    world = np.tile(np.eye(4)[:3], (2, 1, 1, 1))
    assert every_point(of).places(world)[0, 0] == pytest.approx([1, 1, 0])


def test_distinct_points_are_the_first_of_each_label() -> None:
    joints = np.array([[0, 1], [0, 1], [1, 0], [0, 1], [0, 1]])
    factors = np.ones((5, 2, 4))
    factors[3, 1, 2] = 2.0
    points = PointMatrix(np.array([4, 7]), joints, factors)
    chosen = points.distinct(np.array([0, 0, 0, 0, 1]))
    assert chosen.tolist() == [0, 2, 3, 4]
    assert points.take(chosen).joints.tolist() == [[0, 1], [1, 0], [0, 1], [0, 1]]


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_rows_of_one_joint_are_those_of_a_sparse_matrix(kind: type[np.floating[Any]]) -> None:
    from scipy.sparse import csr_array

    random = np.random.default_rng(0)
    joints, factors = random.integers(0, 50, 300), random.normal(size=(300, 4))
    columns = random.normal(size=(200, 6)).astype(kind)
    place = np.repeat(np.arange(300), 4), (4 * joints[:, None] + np.arange(4)).reshape(-1)
    sparse = csr_array((factors.reshape(-1), place), shape=(300, 200)).astype(kind)
    found = OneJointRows(joints, factors).astype(kind) @ columns
    assert found.dtype == kind
    assert (found == sparse @ columns).all()


def test_small_surfaces_are_measured_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skins with other bind poses, two meshes without a skin, one with morph targets between: the same points."""
    instances = [
        MeshInstance(0, mesh(RNG.normal(size=(5, 3)), [[0, 1]] * 5, [[0.25, 0.75]] * 5), Skin(np.arange(2), bind), NONE)
        for bind in RNG.normal(size=(2, 2, 3, 4))
    ]
    instances += [MeshInstance(i, mesh(RNG.normal(size=(4, 3)), [[]] * 4, [[]] * 4), None, NONE) for i in (1, 2)]
    targets = RNG.normal(size=(1, 3, 3))
    morphed = replace(mesh(RNG.normal(size=(3, 3)), [[]] * 3, [[]] * 3), targets=targets, rest_weights=np.ones(1))
    instances.insert(3, MeshInstance(0, morphed, None, np.ones(1)))
    of = Scene(skeleton([-1, 0, 1]), tuple(instances))
    extra = {(1, 2), (3, 0), (4, 3)}
    together = all_points(of, 0.0), sample_points(of, set(), 0.0, extra)
    counted = count_calls(monkeypatch, points_, "_of_surface")
    all_points(of, 0.0)
    assert len(counted) == 4
    monkeypatch.setattr(points_, "merge_small_surfaces", list)
    for found, alone in zip(together, (all_points(of, 0.0), sample_points(of, set(), 0.0, extra)), strict=True):
        np.testing.assert_array_equal(found.nodes, alone.nodes)
        np.testing.assert_array_equal(found.joints, alone.joints)
        np.testing.assert_array_equal(found.factors, alone.factors)


def test_of_many_nodes_that_follow_one_the_outermost_are_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
    places = np.random.default_rng(3).normal(size=(500, 3))
    nodes, anchors = np.arange(20, 500), np.where(np.arange(20, 500) < 30, 4, 7)
    assert points_.outermost_nodes(anchors, nodes, places).tolist() == nodes.tolist()
    monkeypatch.setattr(points_, "MIN_FOLLOWERS", 100)
    found = points_.outermost_nodes(anchors, nodes, places)
    assert set(range(20, 30)) < set(found.tolist())  # few follow node 4
    assert len(found) <= 10 + len(points_.ALL_DIRECTIONS)
    for corner in (*np.eye(3), *-np.eye(3), np.ones(3), np.array([1.0, -1.0, 1.0])):
        assert (places[found] @ corner).max() == (places[nodes] @ corner).max()
    assert not len(points_.outermost_nodes(anchors[:0], nodes[:0], places))

"""Points, edges, tethers and levels of a cloth mesh, and the vertices that selectors name."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import fixtures
from anim.errors import NotFoundError, RangeError
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.simulation.cloth.hierarchy import build_hierarchy
from anim.simulation.cloth.model import Fabric
from anim.simulation.cloth.selection import SIDES, select_vertices
from anim.simulation.cloth.tethers import tether_lengths
from anim.simulation.cloth.topology import build_topology, color_order
from tests.anim.simulation.cloth.cases import (
    sheet,
    simulate,
)


def test_vertices_at_one_place_are_one_point() -> None:
    positions, faces = sheet(4, 5)
    split, corners = positions[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
    whole, welded = build_topology(positions, faces, 1e-6), build_topology(split, corners, 1e-6)
    assert len(welded.first_vertex) == 20
    assert len(welded.edges) == len(whole.edges) == 20 + len(faces) - 1  # Euler's formula of a disk
    np.testing.assert_array_equal(split[welded.first_vertex][welded.point_of_vertex], split)
    inner = len(whole.edges) - 2 * (3 + 4)
    assert len(whole.hinges) == inner


def test_neighbors_in_the_order_of_edges_share_no_point() -> None:
    positions, faces = sheet(20, 20)
    edges = build_topology(positions, faces, 1e-6).edges
    shared = [bool(set(a) & set(b)) for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)]
    assert sum(shared) < 12  # where the color changes


def test_tethers_are_as_long_as_the_mesh() -> None:
    positions, faces = sheet(30, 30)
    topology = build_topology(positions, faces, 1e-6)
    anchors, lengths = tether_lengths(topology, positions, np.array([0, 29]))
    straight = np.linalg.norm(positions[:, None] - positions[[0, 29]][None], axis=2)
    np.testing.assert_allclose(lengths[:, 0], straight.min(axis=1), rtol=0.03)
    assert {0, 29} <= set(anchors[435].tolist())  # a point between both corners is held by both
    half = np.array([[np.cos(a), 0, np.sin(a)] for a in np.linspace(0, np.pi, 60)])  # a half cylinder
    around = np.concatenate([half, half + np.array([0, 0.05, 0])])
    at = np.arange(59)
    folded = np.concatenate([np.stack([at, at + 60, at + 1], 1), np.stack([at + 1, at + 60, at + 61], 1)])
    _, lengths = tether_lengths(build_topology(around, folded, 1e-6), around, np.array([0]))
    np.testing.assert_allclose(lengths[59, 0], np.pi, rtol=0.02)
    assert (anchors[:, 0] >= 0).all()


@pytest.mark.parametrize(
    ("selector", "error"),
    [("top", RangeError), ("joint:nobody", NotFoundError), ("material:*x", NotFoundError), ("box:0,0,0,1", RangeError)],
)
def test_selectors_without_sense_are_refused(selector: str, error: type[Exception]) -> None:
    scene = reader.scene(container.read(np.frombuffer(fixtures.build("arm"), np.uint8)))
    instance = scene.instances[0]
    with pytest.raises(error):
        select_vertices(selector, instance, instance.mesh.positions, scene.skeleton.names, ["skin"])


@pytest.mark.parametrize("side", SIDES)
def test_a_mesh_without_vertices_has_no_sides(side: str) -> None:
    scene = reader.scene(container.read(np.frombuffer(fixtures.build("arm"), np.uint8)))
    with pytest.raises(NotFoundError, match=f"'{side}' selects no vertex"):
        select_vertices(side, scene.instances[0], np.zeros((0, 3)), scene.skeleton.names, [])


def test_vertices_are_selected_by_joint_weights_and_material() -> None:
    scene = reader.scene(container.read(np.frombuffer(fixtures.build("arm"), np.uint8)))
    instance, names = scene.instances[0], scene.skeleton.names
    joints = [names[node] for node in instance.skin.joints] if instance.skin else []
    found = sum(
        select_vertices(f"joint:{name}", instance, instance.mesh.positions, names, []).astype(int)
        for name in joints
        if (instance.mesh.weights * (instance.mesh.joints == joints.index(name))).sum(axis=1).max() >= 0.5
    )
    assert np.asarray(found).min() >= 0
    assert np.asarray(found).max() >= 1


def test_a_mesh_without_free_points_or_edges_is_refused() -> None:
    positions, faces = sheet(3, 3)
    with pytest.raises(NotFoundError, match="every point"):
        simulate(positions, faces, np.ones(9))
    with pytest.raises(NotFoundError, match="no edges"):
        build_topology(positions, faces[:0], 1e-6)
    with pytest.raises(RangeError, match="density"):
        Fabric(density=-1.0)


def test_levels_join_points_on_straight_lines_by_the_length_of_the_mesh() -> None:
    positions, faces = sheet(9, 17, length=2.0)
    pinned = positions[:, 0] == 0
    topology = build_topology(positions, faces, 1e-6)
    levels = build_hierarchy(topology, positions, pinned)
    assert len(levels.starts) == 5  # 16, 8, 4 and 2 edges
    rows = np.abs(positions[levels.pairs[:, 0]] - positions[levels.pairs[:, 1]]) * 8
    straight = np.linalg.norm(rows, axis=1) / 8
    assert (levels.lengths >= straight - 1e-12).all()
    for first, end, span in zip(levels.starts[:-1], levels.starts[1:], (16, 8, 4, 2), strict=True):
        along = np.sort(rows[first:end], axis=1).round(6)  # 0, and both steps across the sheet
        on_line = (along[:, 2] == span) & (along[:, 1] == 0)
        np.testing.assert_allclose(levels.lengths[first:end][on_line], straight[first:end][on_line], rtol=1e-12)
        assert on_line.sum() >= 8 * (17 - span)
    assert not pinned[levels.pairs].all(axis=1).any()
    assert len(levels.pairs) < 12 * len(positions)  # linear in the points


def test_a_level_across_a_pleat_is_as_long_as_its_sides() -> None:
    """The chord of a pleat would hold it folded."""
    positions, faces = sheet(2, 9, width=0.05)
    pleated = positions + np.array([0, 0.05, 0]) * (np.arange(18) % 2)[:, None]
    levels = build_hierarchy(build_topology(pleated, faces, 1e-6), pleated, np.zeros(18, bool))
    side = np.hypot(0.125, 0.05)
    along = np.ptp(pleated[levels.pairs], axis=1)
    straight = (along[:, 0] == 0) & (levels.lengths < 3 * side)
    np.testing.assert_allclose(levels.lengths[straight], 2 * side, rtol=1e-12)
    assert straight.any()


@pytest.mark.parametrize("pairs", [[(0, k) for k in range(1, 3000)], [(k, k + 1) for k in range(50)] * 2])
def test_colors_are_the_first_free_ones_however_many_pairs_a_point_has(pairs: list[tuple[int, int]]) -> None:
    used: list[set[int]] = [set() for _ in range(3000)]
    colors = []
    for i, j in pairs:
        colors.append(next(color for color in itertools.count() if color not in used[i] and color not in used[j]))
        used[i].add(colors[-1])
        used[j].add(colors[-1])
    expected = np.argsort(colors, kind="stable")
    np.testing.assert_array_equal(color_order(np.array(pairs), 3000), expected)

"""Cloth in motion: momentum, free fall, friction, and pinned vertices that follow a skin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import fixtures
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.simulation.cloth.colliders import Capsule, Plane
from anim.simulation.cloth.model import Fabric
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.selection import select_vertices
from anim.simulation.cloth.simulate import simulate_cloth
from anim.simulation.cloth.solver import Environment
from anim.simulation.cloth.topology import build_topology
from anim.skinning.bake import bake
from tests.anim.simulation.cloth.cases import (
    STILL,
    G,
    advance,
    sheet,
    simulate,
)


def test_momentum_is_conserved_and_angular_momentum_converges_to_it() -> None:
    positions, faces = sheet(6, 6)
    topology = build_topology(positions, faces, 1e-6)
    lengths = np.linalg.norm(positions[topology.edges[:, 0]] - positions[topology.edges[:, 1]], axis=1)
    random = np.random.default_rng(2)
    w = random.uniform(5, 20, 36)
    spin = np.cross([0.3, 2.0, 0.5], positions - positions.mean(axis=0)) + 0.3 * random.standard_normal((36, 3))
    lost = []
    for substeps in (10, 20, 40):
        p, v = positions.copy(), spin.copy()
        before = (v / w[:, None]).sum(axis=0), np.cross(p, v / w[:, None]).sum(axis=0)
        for _ in range(30):
            advance(p, v, w, topology.edges, lengths, substeps, (1e-4, 0.0, 0.0, 2))
        np.testing.assert_allclose((v / w[:, None]).sum(axis=0), before[0], atol=1e-12)
        after = np.cross(p, v / w[:, None]).sum(axis=0)
        lost.append(np.linalg.norm(after - before[1]) / np.linalg.norm(before[1]))
    assert lost[0] < 0.1
    assert lost[1] < 0.6 * lost[0]
    assert lost[2] < 0.6 * lost[1]


def test_free_fall_is_rigid() -> None:
    positions, faces = sheet(6, 6)
    _, frames = simulate(positions, faces, np.zeros(36), fabric=Fabric(damping=0.0), environment=STILL, duration=0.5)
    t = np.arange(31) / 60
    expected = positions + np.array([0, -1, 0]) * (0.5 * G * t**2 + 0.5 * G * t / 600)[:, None, None]
    np.testing.assert_allclose(frames, expected, atol=1e-6)


def test_a_sheet_held_at_an_edge_keeps_its_length_and_the_same_seed_its_bytes() -> None:
    positions, faces = sheet(20, 20)
    options = {"environment": Environment(wind=(3, 0, 1), seed=5), "duration": 2.0, "estimate_error": False}
    run, frames = simulate(positions, faces, positions[:, 0] == 0, **options)
    _, again = simulate(positions, faces, positions[:, 0] == 0, **options)
    assert frames.tobytes() == again.tobytes()
    fixed = positions[:, 0] == 0
    assert np.abs(frames[:, fixed] - positions[fixed]).max() < 1e-6
    assert run.report.worst_stretch is not None
    assert run.report.worst_stretch["at_end"] < 0.05


@pytest.mark.parametrize(("friction", "slides"), [(0.2, True), (0.7, False)])
def test_a_sheet_on_an_incline_slides_by_coulombs_law(friction: float, slides: bool) -> None:
    positions, faces = sheet(6, 6, width=0.5, length=0.5)
    angle = np.radians(30)
    down, up = np.array([np.cos(angle), -np.sin(angle), 0]), np.array([np.sin(angle), np.cos(angle), 0])
    start = positions[:, [0]] * down + positions * [0, 0, 1] + 0.005 * up
    plane = Plane((0.0, 0.0, 0.0), (float(up[0]), float(up[1]), 0.0))
    fabric = Fabric(damping=0.0, friction=friction)
    _, frames = simulate(
        *(start, faces, np.zeros(36)), fabric=fabric, environment=STILL, obstacles=(plane,), duration=1.0
    )
    path = (frames - frames[0]) @ down
    expected = 0.5 * G * (np.sin(angle) - friction * np.cos(angle)) if slides else 0.0
    np.testing.assert_allclose(path[-1], expected, rtol=5e-3, atol=1e-5)
    np.testing.assert_allclose(frames @ up, 0.005, atol=1e-5)


def test_pinned_vertices_follow_the_skin_at_every_frame() -> None:
    document = container.read(np.frombuffer(fixtures.build("arm"), np.uint8))
    scene, clip = reader.scene(document), reader.clips(document)[0]
    instance = scene.instances[0]
    positions = instance.mesh.positions
    pinned = ~select_vertices("y-max", instance, positions, scene.skeleton.names, [])
    run = simulate_cloth(scene, clip, instance.node, pinned, ClothOptions(fps=24, duration=1.0))
    times = np.arange(25) / 24
    expected = bake(scene, clip, times=times, rigid=True, nodes=[instance.node]).load_all().positions
    np.testing.assert_allclose(run.cache.load_all().positions[1:, pinned], expected[1:, pinned], atol=1e-6)


STARTS = ("edge", "corners", "one corner", "ball", "wind", "relaxation", "self-collision")


@pytest.mark.parametrize("start", STARTS)
def test_half_the_step_changes_the_result_by_less_than_the_estimate(start: str) -> None:
    positions, faces = sheet(9, 9)
    x, z = positions[:, 0], positions[:, 2]
    pinned = {"corners": (x == 0) & np.isin(z, [0.0, 1.0]), "one corner": (x == 0) & (z == 0), "ball": x < 0}
    options: dict[str, Any] = {"duration": 0.5, "substeps": 6, "environment": STILL}
    if start == "wind":
        options["environment"] = Environment(wind=(6.0, 0, 2))
    if start == "ball":
        options["obstacles"] = (Capsule((0.5, 0.7, 0.5), (0.5, 0.7, 0.5), 0.2),)
    if start == "relaxation":
        options["solver"] = start
    run, coarse = simulate(
        *(positions, faces, pinned.get(start, x == 0)),
        **options,
        self_collision=start == "self-collision",
        estimate_error=True,
    )
    options["substeps"] = 12
    _, fine = simulate(
        *(positions, faces, pinned.get(start, x == 0)), **options, self_collision=start == "self-collision"
    )
    change = np.linalg.norm(coarse - fine, axis=2).max()
    assert run.report.error_estimate_m is not None
    assert 0 < change <= run.report.error_estimate_m

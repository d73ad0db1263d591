"""Cloth against colliders, the floor and itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import fixtures
from anim.errors import DataRangeError
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.model import Clip
from anim.sampling.sample import sample
from anim.simulation.cloth.colliders import Capsule, Plane, from_spring_colliders
from anim.simulation.cloth.driver import ClothDriver, bake_vertices
from anim.simulation.cloth.kernels.self_collision import separate_points
from anim.simulation.cloth.model import Fabric
from anim.simulation.cloth.solver import Environment
from anim.simulation.spring_bones.colliders import Collider, ColliderShape
from anim.skinning.bake import prepare_bake
from tests.anim.simulation.cloth.cases import (
    STILL,
    flag,
    sheet,
    simulate,
)


def test_a_collider_of_spring_bones_beyond_the_limits_is_a_fault_of_the_file() -> None:
    with pytest.raises(DataRangeError, match=r"a collider of spring bones: `radius` is 1e\+30 m"):
        from_spring_colliders([Collider(None, ColliderShape.SPHERE, radius=1e30)])


def test_cloth_stays_out_of_colliders_and_above_the_floor() -> None:
    positions, faces = sheet(16, 16)
    ball = Capsule((0.5, 0.6, 0.5), (0.5, 0.6, 0.5), 0.25)
    _, frames = simulate(
        *(positions, faces, np.zeros(256)), environment=replace(STILL, floor=0.0), obstacles=(ball,), duration=3.0
    )
    away = np.linalg.norm(frames - [0.5, 0.6, 0.5], axis=2)
    assert away.min() >= 0.25 + 0.005 - 1e-6
    assert frames[..., 1].min() >= 0.005 - 1e-6


@pytest.mark.parametrize("kind", ["sphere", "capsule", "plane", "inside sphere", "inside capsule"])
def test_free_cloth_stays_on_its_side_of_every_collider_of_spring_bones(kind: str) -> None:
    positions, faces = sheet(12, 12)
    shape, inside = ColliderShape(kind.split()[-1]), kind.startswith("inside")
    offset, tail, radius = (0.5, 0.5, 0.2), (0.5, 0.6, 0.8), 0.2
    if inside:
        offset, tail, radius = (0.5, 0.9, 0.4), (0.5, 0.9, 0.6), 0.8
    given = Collider(None, shape, offset, tail, (0.2, 1.0, 0.0), radius, inside)
    run, frames = simulate(
        *(positions, faces, np.zeros(144)), environment=STILL, obstacles=from_spring_colliders([given]), duration=1.5
    )
    assert run.report.penetration_m == 0.0
    delta, axis = frames - offset, np.subtract(tail, offset) if shape is ColliderShape.CAPSULE else np.zeros(3)
    t = np.clip(delta @ axis / max(axis @ axis, 1e-30), 0, 1)
    distance = np.linalg.norm(delta - t[..., None] * axis, axis=2)
    if shape is ColliderShape.PLANE:
        assert (delta @ [0.2, 1.0, 0.0] / np.hypot(0.2, 1)).min() > 0.005 - 1e-5
    elif inside:
        assert distance.max() < radius - 0.005 + 1e-5
    else:
        assert distance.min() > radius + 0.005 - 1e-5


def test_colliders_move_with_their_nodes_at_every_substep() -> None:
    scene, clip, node, _ = flag()
    pole = scene.skeleton.names.index("pole")
    obstacles = (Capsule((0.3, 1.0, 0), (0.3, 1.5, 0), 0.1, pole, pole), Plane((0, 0.5, 0), (0, 1, 0), pole))
    driver = ClothDriver(prepare_bake(scene, rigid=True, nodes=[node]), None, clip, scene, obstacles)
    times = np.linspace(0.1, 0.2, 61)
    rows = driver.colliders(times)
    world = sample(scene.skeleton, clip, times, space="world").world
    assert world is not None
    expected = world[:, pole, :, :3] @ [0.3, 1.0, 0] + world[:, pole, :, 3]
    np.testing.assert_allclose(rows[:, 0, :3], expected, atol=1e-12)
    np.testing.assert_allclose(rows[:, 1, 3:6], world[:, pole, :, 1], atol=1e-12)
    assert (np.linalg.norm(np.diff(rows[:, 0, :3], axis=0), axis=1) > 1e-5).all()


@pytest.mark.parametrize("name", ["flag", "tube", "morph_cube"])
def test_pinned_points_follow_the_mesh_at_every_substep(name: str) -> None:
    """The pinned points are baked alone, and are where the whole mesh has them: on a node, skinned, morphed."""
    document = container.read(np.frombuffer(fixtures.build(name), np.uint8))
    scene, clip = reader.scene(document), reader.clips(document)[0]
    node = next(each.node for each in scene.instances)
    baker = prepare_bake(scene, rigid=True, nodes=[node])
    vertices = np.arange(1, baker.vertices, 3)
    driver = ClothDriver(baker, bake_vertices(scene, node, vertices), clip, scene)
    times = clip.start + np.linspace(0, 0.5, 13)
    expected = np.concatenate([chunk.positions for chunk in baker.bake(clip, times=times).chunks()])[:, vertices]
    np.testing.assert_array_equal(driver.targets(times - clip.start), expected.astype(np.float64))
    assert np.ptp(expected, axis=0).max() > 1e-3
    resting = replace(driver, clip=Clip("", ()))
    for count in (5, 2):
        np.testing.assert_array_equal(
            resting.targets(np.arange(count) / 60), np.repeat(resting.all_vertices(0.0)[None, vertices], count, axis=0)
        )
    assert bake_vertices(scene, node, vertices[:0]) is None


def test_a_folded_strip_does_not_pass_through_itself() -> None:
    """A strip dropped on end folds over itself; layers keep apart by the thickness."""
    positions, faces = sheet(5, 41, width=0.1)
    z = positions[:, 2]
    start = np.stack([positions[:, 0], 0.01 + z, 0.001 * np.sin(9 * z)], axis=1)
    options: dict[str, Any] = {"fabric": Fabric(friction=1.0), "environment": Environment(floor=0.0), "substeps": 20}
    closest = []
    for own in (False, True):
        _, frames = simulate(start, faces, np.zeros(len(start)), **options, self_collision=own)
        far = np.linalg.norm(start[:, None] - start[None], axis=2) > 0.08
        closest.append(min(np.linalg.norm(x[:, None] - x[None], axis=2)[far].min() for x in frames))
    assert closest[0] < 0.005
    assert closest[1] > 0.018


def test_points_of_a_cloth_keep_apart_but_for_those_near_at_rest() -> None:
    p = np.array([[0.0, 0, 0], [0.04, 0, 0], [0.5, 0, 0], [0.52, 0, 0]])
    at_rest = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0.52, 0, 0]])
    separate_points(p, np.array([1.0, 3, 1, 1]), at_rest, 0.1)
    np.testing.assert_allclose(p[:2, 0], [-0.015, 0.085], atol=1e-12)
    np.testing.assert_array_equal(p[2:], at_rest[2:])

"""Rigs whose joints scale: own units, mirrors, joints without weight, and what methods that turn make of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.measure.error.surface import diagonal
from anim.model import Mesh, MeshInstance, Scene, Skin
from anim.sampling.times import frame_times
from anim.skinning.bake import bake
from anim.skinning.methods.registry import SKINNING_METHODS
from tests.anim.skinning.methods.test_linear_blend import TIMES, baked, moving
from tests.anim.skinning.odd_rigs import with_root_without_weight
from tests.anim.skinning.scenes import mesh, random_scene, scene
from tests.clips import about, clip, track
from tests.files import opened_path

TURNING = [name for name in SKINNING_METHODS if name != "lbs"]
CLOSE = 1e-5  # of the diagonal


@pytest.mark.parametrize("method", SKINNING_METHODS)
def test_a_joint_without_weight_may_have_any_bind_scale(method: str, asset: Callable[[str], Path]) -> None:
    """CesiumMan in hundredths, under a joint that carries nothing and is bound by the identity."""
    document = opened_path(asset("CesiumMan.glb"))
    of, (walk,) = reader.scene(document), reader.clips(document)
    times = frame_times(walk.start, walk.end, fps=12)
    plain = bake(of, walk, times=times, method=method).load_all().positions
    odd = bake(with_root_without_weight(of), walk, times=times, method=method).load_all().positions
    assert np.abs(odd - plain).max() < CLOSE * diagonal(of)


@pytest.mark.parametrize("method", SKINNING_METHODS)
@pytest.mark.parametrize("unit", [100.0, -1.0, -0.01, (2.0, 1.0, 0.5), (-3.0, 1.0, 1.0)])
def test_the_scale_in_which_a_mesh_was_bound_does_not_matter(method: str, unit: Any) -> None:
    """A mesh in other units, mirrored, or with a scale that is not uniform, and binds that take it back."""
    of = random_scene(6)
    played = moving(of, 1)
    plain, other = baked(of, played, method=method), baked(_in_unit(of, unit), played, method=method)
    # centers are means by area, and another scale along each axis makes other areas
    close = 2e-5 if method != "cor" or np.ndim(unit) == 0 else 0.1
    assert np.abs(other - plain).max() < close * np.abs(plain).max()


@pytest.mark.parametrize("method", TURNING)
@pytest.mark.parametrize("size", [0.01, 3.0, 100.0])
def test_joints_below_one_that_scales_blend_as_they_do_without(method: str, size: float) -> None:
    """What hangs on them alone is the same shape, made larger: joint 1 grows, and 2 and 3 below it with it."""
    of = _two_chains()
    turns = [track("rotation", [0, 1], about("z", [0, angle]), node=j) for j, angle in ((2, 80), (3, -50), (5, 60))]
    grown = clip(*turns, track("scale", [0], [[size] * 3], node=1))
    plain, larger = (baked(of, each, np.array([0.5, 1.0]), method=method) for each in (clip(*turns), grown))
    pivot = np.array([0, 1.0, 0])  # where joint 1 stands
    below = slice(0, 40)
    assert np.abs(larger[:, below] - (pivot + size * (plain[:, below] - pivot))).max() < 1e-5 * max(size, 1)
    assert np.abs(larger[:, 40:] - plain[:, 40:]).max() < 1e-5


@pytest.mark.parametrize("method", TURNING)
def test_parts_of_one_skin_may_be_bound_in_different_units(method: str) -> None:
    """Two chains that share no vertex, one of them in hundredths."""
    of = _two_chains()
    played = clip(*(track("rotation", [0, 1], about("z", [0, 70]), node=j) for j in (1, 2, 3, 5)))
    (instance,) = of.instances
    body, skin = instance.mesh, instance.skin
    assert skin is not None
    units = np.where(np.arange(6) < 4, 100.0, 1.0)
    points = body.positions * units[body.joints[:, :1]]
    binds = skin.inverse_bind / np.stack([units, units, units, np.ones(6)], axis=-1)[:, None]
    other = _with(of, replace(body, positions=points), Skin(skin.joints, binds))
    assert np.abs(baked(other, played, TIMES, method=method) - baked(of, played, TIMES, method=method)).max() < 2e-5


@pytest.mark.parametrize("size", [1e-3, 0.5, -1.0, 10.0])
def test_a_joint_that_grows_alone_does_so_about_its_own_place(size: float) -> None:
    """Half on an elbow that turns by 60° and grows: half of the growth, about the elbow, and then half of the turn."""
    points = np.array([[0.1, 0.9, 0], [0, 1.2, 0.1]])
    of = scene(mesh(points, [[0, 1]] * 2, [[0.5, 0.5]] * 2), [-1, 0], translation=[[0, 0, 0], [0, 1, 0]])
    of = _with(
        of,
        of.instances[0].mesh,
        Skin(np.arange(2), np.array([np.eye(4)[:3], [[1, 0, 0, 0], [0, 1, 0, -1], [0, 0, 1, 0]]])),
    )
    growing = clip(track("rotation", [0], about("z", [60]), node=1), track("scale", [0], [[size] * 3], node=1))
    elbow, half = np.array([0, 1.0, 0]), np.radians(30)
    turn = np.array([[np.cos(half), -np.sin(half), 0], [np.sin(half), np.cos(half), 0], [0, 0, 1]])
    wanted = elbow + (1 + size) / 2 * (points - elbow) @ turn.T
    assert np.abs(baked(of, growing, np.zeros(1), method="dqs")[0] - wanted).max() < 1e-6 * max(1, size)


def test_skins_of_one_file_have_each_their_own_unit() -> None:
    of = _two_chains()
    (instance,) = of.instances
    other = _in_unit(of, 0.01).instances[0]
    both = Scene(of.skeleton, (instance, other))
    played = clip(track("rotation", [0, 1], about("z", [0, 70]), node=2))
    for method in SKINNING_METHODS:
        found = baked(both, played, TIMES, method=method)
        assert np.abs(found[:, :60] - found[:, 60:]).max() < 1e-5


def _two_chains() -> Scene:
    """Joints 0 to 3 in a row with 40 vertices on pairs of 1, 2 and 3, and joints 4 and 5 beside with 20 more."""
    random = np.random.default_rng(5)
    places = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 0], [0, 1, 0], [5, 0, 0], [0, 1, 0]], float)
    world = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 0], [5, 0, 0], [5, 1, 0]], float)
    first = random.integers(1, 3, 40)
    joints = np.concatenate((np.stack((first, first + 1), axis=1), [[4, 5]] * 20))
    share = random.uniform(0.1, 0.9, 60)
    points = world[joints[:, 1]] + random.normal(size=(60, 3)) * 0.4
    faces = np.concatenate((random.integers(0, 40, (60, 3)), random.integers(40, 60, (30, 3))))
    binds = np.concatenate((np.tile(np.eye(3), (6, 1, 1)), -world[..., None]), axis=-1)
    body = mesh(points, joints, np.stack((share, 1 - share), axis=1), faces=faces)
    return scene(body, [-1, 0, 1, 2, -1, 4], inverse_bind=binds, translation=places)


def _in_unit(of: Scene, unit: Any) -> Scene:
    """The same scene, its mesh scaled by `unit` in bind space and the bind matrices taking it back."""
    (instance,) = of.instances
    assert instance.skin is not None
    factors = np.broadcast_to(np.asarray(unit, float), 3)
    binds = instance.skin.inverse_bind / np.append(factors, 1)
    return _with(
        of, replace(instance.mesh, positions=instance.mesh.positions * factors), Skin(instance.skin.joints, binds)
    )


def _with(of: Scene, body: Mesh, skin: Skin) -> Scene:
    (instance,) = of.instances
    return Scene(of.skeleton, (MeshInstance(instance.node, body, skin, instance.weights),))

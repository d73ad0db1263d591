"""Tangents: the way from a vertex to a neighbor that hangs on the same joints alike goes where the two go."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import AnyArray, Floats
from anim.errors import UnsupportedError
from anim.model import Clip, Mesh, Scene
from anim.skinning.bake import bake
from anim.skinning.methods.registry import SKINNING_METHODS
from tests.anim.skinning.methods.test_linear_blend import TIMES, moving
from tests.anim.skinning.scenes import mesh, random_scene, scene
from tests.clips import about, clip, track

STEP = 0.25  # m, from a vertex to its neighbors; the way there is straight, so it needn't be short


def unit(vectors: AnyArray) -> AnyArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def with_neighbors(of: Scene) -> tuple[Scene, Floats]:
    """The scene with every vertex three times: itself, a step along its tangent, a step along its bitangent."""
    body = of.instances[0].mesh
    random = np.random.default_rng(1)
    along = unit(random.normal(size=body.positions.shape))
    normal = unit(np.cross(along, random.normal(size=along.shape)))
    across = np.cross(normal, along)
    handed = np.where(np.arange(len(along)) % 2, -1.0, 1.0)
    points = np.concatenate([body.positions, body.positions + STEP * along, body.positions + STEP * across])
    tangents = np.tile(np.concatenate([along, handed[:, None]], axis=1), (3, 1))
    held = np.tile(body.joints, (3, 1)), np.tile(body.weights, (3, 1))
    faces = np.arange(3 * len(along)).reshape(3, -1).T  # each with its neighbors, so that all have a center of rotation
    tripled = mesh(points, *held, faces=faces, normals=np.tile(normal, (3, 1)), tangents=tangents)
    instance = of.instances[0]
    return Scene(of.skeleton, (type(instance)(instance.node, tripled, instance.skin, instance.weights),)), handed


@pytest.mark.parametrize("method", SKINNING_METHODS)
@pytest.mark.parametrize("stretch", [0.0, 0.4])
@pytest.mark.parametrize("space", ["world", "mesh"])
def test_tangents_and_normals_follow_the_surface(method: str, stretch: float, space: str) -> None:
    of, handed = with_neighbors(random_scene(3, vertices=60, scale_shear=stretch))
    cache = bake(of, moving(of, 4), times=TIMES, method=method, normals=True, tangents=True, space=space)
    found = cache.load_all()
    assert found.normals is not None
    assert found.tangents is not None
    own, along, across = np.split(found.positions.astype(float), 3, axis=1)
    ways = along - own, across - own
    tangents, normals = found.tangents[:, :60], found.normals[:, :60]
    length = np.linalg.norm(ways[0], axis=-1)
    clear = length > 0.05 * STEP  # joints that cancel out leave no way to go
    assert clear.mean() > 0.9
    assert np.abs(tangents - unit(ways[0]))[clear].max() < 3e-3
    flat = np.abs((normals * unit(ways[0])).sum(axis=-1)) + np.abs((normals * unit(ways[1])).sum(axis=-1))
    wide = clear & (np.linalg.norm(ways[1], axis=-1) > 0.05 * STEP)
    assert flat[wide].max() < 2e-2
    assert np.array_equal(cache.handedness, np.tile(handed, 3))  # type: ignore[arg-type]


def quad(**more: object) -> Mesh:
    points = [[0, 0, 0], [1, 0, 0], [0, 0, 1]]
    along = np.array([[1.0, 0, 0, -1]] * 3)
    return mesh(points, [[0]] * 3, [[1]] * 3, normals=np.array([[0.0, 1, 0]] * 3), tangents=along, **more)


def test_a_turn_by_hand() -> None:
    """About z by 90°, x goes to y; the handedness stays -1."""
    cache = bake(
        scene(quad(), [-1]),
        clip(track("rotation", [0], about("z", [90]))),
        times=np.zeros(1),
        normals=True,
        tangents=True,
    )
    whole = cache.load_all()
    assert whole.tangents == pytest.approx(np.array([[[0, 1, 0]] * 3]), abs=1e-7)
    assert whole.normals == pytest.approx(np.array([[[-1, 0, 0]] * 3]), abs=1e-7)
    assert cache.handedness == pytest.approx(-np.ones(3))


def test_morph_targets_add_to_tangents() -> None:
    """Half of a target that turns x towards z: (1, 0, 1) at unit length."""
    moved = np.zeros((1, 3, 3))
    moved[:, :, 2] = 2
    of = scene(quad(targets=np.zeros((1, 3, 3)), tangent_targets=moved, rest_weights=[0.5]), [-1])
    whole = bake(of, Clip("", ()), times=np.zeros(1), tangents=True).load_all()
    assert whole.tangents == pytest.approx(np.array([[[0.5**0.5, 0, 0.5**0.5]] * 3]), abs=1e-6)


def test_a_mesh_without_tangents_is_named() -> None:
    body = mesh([[0, 0, 0]], [[0]], [[1]], name="cape")
    with pytest.raises(UnsupportedError, match="mesh 'cape' has no tangents"):
        bake(scene(body, [-1]), Clip("", ()), times=np.zeros(1), tangents=True)

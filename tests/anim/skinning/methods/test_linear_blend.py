"""Linear blend skinning: a plain loop, a sparse product, and numbers worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.model import Clip, Scene
from anim.skinning.bake import bake
from tests.anim.skinning.scenes import looped, mesh, random_scene, scene, skinning_matrices
from tests.clips import about, clip, track

TIMES = np.linspace(0, 2, 45)  # more than a block, and no multiple of one


def moving(of: Scene, seed: int) -> Clip:
    """Every joint turns and moves."""
    random = np.random.default_rng(seed)
    times, tracks = np.linspace(0, 2, 6), []
    for node in range(len(of.skeleton) - 1):
        turns = random.normal(size=(6, 4))
        tracks.append(track("rotation", times, turns / np.linalg.norm(turns, axis=1, keepdims=True), node=node))
        tracks.append(track("translation", times, random.normal(size=(6, 3)), node=node))
    return clip(*tracks)


def baked(of: Scene, played: Clip, times: Floats = TIMES, **how: object) -> Floats:
    return bake(of, played, times=times, **how).load_all().positions.astype(float)  # type: ignore[arg-type]


@pytest.mark.parametrize("stretch", [0.0, 0.5])
def test_the_kernel_is_the_plain_loop_and_the_sparse_product(stretch: float) -> None:
    of = random_scene(3, scale_shear=stretch)
    played = moving(of, 4)
    body, matrices = of.instances[0].mesh, skinning_matrices(of, played, TIMES)
    plain = looped(body.positions, body.joints, body.weights, matrices)
    size = np.abs(plain).max()
    assert np.abs(baked(of, played) - plain).max() < 1e-6 * size

    rows = np.repeat(np.arange(len(body.positions)), body.joints.shape[1] * 4)
    columns = (body.joints[:, :, None] * 4 + np.arange(4)).ravel()
    whole = np.concatenate([body.positions, np.ones((len(body.positions), 1))], axis=1)
    values = (body.weights[:, :, None] * whole[:, None]).ravel()
    weights = sparse.csr_matrix((values, (rows, columns)), shape=(len(whole), 4 * matrices.shape[1]))
    product = weights @ matrices.transpose(1, 3, 0, 2).reshape(4 * matrices.shape[1], -1)
    assert np.abs(product.reshape(len(whole), -1, 3).transpose(1, 0, 2) - plain).max() < 1e-12 * size


def test_a_hinge_by_hand() -> None:
    """A point 1 m out on the x axis, half on a joint that stays and half on one that turns 90° about z."""
    of = scene(mesh([[1, 0, 0], [1, 0, 0]], [[0, 1], [1, 0]], [[0.5, 0.5], [1, 0]]), [-1, -1])
    played = clip(track("rotation", [0, 1], about("z", [0, 90]), node=1))
    found = baked(of, played, np.array([0.0, 1.0]))
    assert found[0] == pytest.approx(np.array([[1, 0, 0], [1, 0, 0]]), abs=1e-7)
    assert found[1] == pytest.approx(np.array([[0.5, 0.5, 0], [0, 1, 0]]), abs=1e-7)


def test_moving_every_joint_moves_every_vertex() -> None:
    of = random_scene(5)
    moved = Rotation.from_euler("xyz", [10, 20, 30], degrees=True)
    everything = clip(
        track("rotation", [0], (moved * Rotation.from_quat(of.skeleton.rotation[0].copy())).as_quat()[None]),
        track("translation", [0], moved.apply(of.skeleton.translation[0].copy())[None] + np.array([1, 2, 3])),
    )
    wanted = moved.apply(baked(of, clip(), np.zeros(1))[0]) + np.array([1, 2, 3])
    assert baked(of, everything, np.zeros(1))[0] == pytest.approx(wanted, abs=1e-5)


def test_many_influences() -> None:
    """Twelve joints, each moved to its own place, hold a point at the mean of them."""
    places = np.random.default_rng(1).normal(size=(12, 3))
    body = mesh([[0, 0, 0]], [list(range(12))], [[1 / 12] * 12])
    found = baked(scene(body, [-1] * 12, translation=places), clip(), np.zeros(1))
    assert found[0, 0] == pytest.approx(places.mean(axis=0), abs=1e-6)

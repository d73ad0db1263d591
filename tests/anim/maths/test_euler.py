"""Euler angles against scipy, and curves that run through lock."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from anim.arrays import Floats
from anim.errors import RangeError
from anim.maths import euler, quaternion
from anim.maths.euler import ORDERS, AxesConvention

CONVENTIONS = [(order, frame) for order in ORDERS for frame in AxesConvention]
GRID = np.arange(-4, 5) * np.pi / 4  # lock in every order is among them


def _scipy(order: str, frame: AxesConvention, angles: Floats) -> Floats:
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    q: Floats = rotation.from_euler(order if frame == AxesConvention.INTRINSIC else order.lower(), angles).as_quat()
    return q


def _angles(seed: int = 5) -> Floats:
    """Random, lock-grazing and multi-turn triples."""
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(GRID, GRID, GRID), axis=-1).reshape(-1, 3)
    grazing = grid + random.normal(size=grid.shape) * 10.0 ** random.uniform(-12, -2, (len(grid), 1))
    return np.concatenate((random.uniform(-np.pi, np.pi, (500, 3)), random.uniform(-30, 30, (500, 3)), grid, grazing))


@pytest.mark.parametrize(("order", "frame"), CONVENTIONS)
def test_quaternions_are_scipys(order: str, frame: AxesConvention) -> None:
    angles = _angles()
    ours = euler.to_quaternion(angles, order=order, frame=frame)
    assert quaternion.angle_between(ours, _scipy(order, frame, angles)).max() < 1e-9


@pytest.mark.parametrize(("order", "frame"), CONVENTIONS)
def test_back_to_angles_and_again_is_the_same_rotation(order: str, frame: AxesConvention) -> None:
    q = _scipy(order, frame, _angles())
    angles = euler.from_quaternion(q, order=order, frame=frame)
    assert quaternion.angle_between(euler.to_quaternion(angles, order=order, frame=frame), q).max() < 1e-7
    low, high = (0, np.pi) if euler.is_proper(order) else (-np.pi / 2, np.pi / 2)
    assert angles[:, 1].min() >= low - 1e-12
    assert angles[:, 1].max() <= high + 1e-12
    assert np.abs(angles[:, 0::2]).max() <= np.pi + 1e-12


@pytest.mark.parametrize(("order", "frame"), CONVENTIONS)
def test_curves_keep_every_rotation(order: str, frame: AxesConvention) -> None:
    q = _scipy(order, frame, _angles())
    angles = euler.unwrap(q, order=order, frame=frame)
    assert quaternion.angle_between(euler.to_quaternion(angles, order=order, frame=frame), q).max() < 1e-7
    assert np.abs(np.diff(angles, axis=0)).max() <= np.pi * 1.5


@pytest.mark.parametrize(("order", "frame"), CONVENTIONS)
@pytest.mark.parametrize("steps", [10, 11, 100])
def test_straight_through_lock_the_curves_stay_straight(order: str, frame: AxesConvention, steps: int) -> None:
    """The middle angle runs over every lock, twice around; the keys at lock itself are among the samples."""
    true = np.tile((0.3, 0.0, -0.4), (20 * steps + 1, 1))
    true[:, 1] = np.pi / 2 * np.arange(len(true)) / steps
    q = euler.to_quaternion(true, order=order, frame=frame)
    angles = euler.unwrap(q, order=order, frame=frame)
    assert np.abs(np.diff(angles, axis=0)).max() < np.pi / 2 / steps + 1e-6
    assert quaternion.angle_between(euler.to_quaternion(angles, order=order, frame=frame), q).max() < 1e-7


@pytest.mark.parametrize(("order", "frame"), CONVENTIONS)
@pytest.mark.parametrize("miss", [0.0, 1e-9, 1e-6, 1e-3, 0.1])
def test_a_second_of_smooth_motion_by_lock_has_no_jump(order: str, frame: AxesConvention, miss: float) -> None:
    """One turn about a slanted axis in a second at 240 frames, through lock or past it."""
    start = euler.to_quaternion(
        np.array((0.2, np.pi / 2 * (not euler.is_proper(order)), 0.1)), order=order, frame=frame
    )
    t = np.linspace(-0.5, 0.5, 241)[:, None]
    swing = quaternion.from_rotation_vector(t * [2.0, -1.5, 1.0])
    aside = quaternion.from_rotation_vector(np.array((miss, miss, 0.0)))
    q = quaternion.multiply(quaternion.multiply(swing, aside), start)
    angles = euler.unwrap(q, order=order, frame=frame)
    assert np.abs(np.diff(angles, axis=0)).max() < np.pi
    assert quaternion.angle_between(euler.to_quaternion(angles, order=order, frame=frame), q).max() < 1e-7


def test_a_pose_that_stays_at_lock_has_quiet_curves() -> None:
    angles = np.stack((np.linspace(0, 1, 50), np.full(50, np.pi / 2), np.linspace(0, 2, 50)), axis=-1)
    q = euler.to_quaternion(angles, order="XYZ")
    found = euler.unwrap(q, order="XYZ")
    assert np.abs(np.diff(found, axis=0)).max() < 0.1
    assert quaternion.angle_between(euler.to_quaternion(found, order="XYZ"), q).max() < 1e-7


def test_spins_keep_their_turns() -> None:
    true = np.stack((np.linspace(0, 30, 300), np.full(300, 0.2), np.full(300, -0.1)), axis=-1)
    q = euler.to_quaternion(true, order="YXZ")
    np.testing.assert_allclose(euler.unwrap(q, order="YXZ"), true, atol=1e-9)


def test_many_curves_at_once_are_each_as_alone() -> None:
    q = np.stack([_scipy("ZXY", AxesConvention.INTRINSIC, _angles(seed)) for seed in (1, 2, 3)], axis=1)
    together = euler.unwrap(q, order="YXZ")
    for i in range(3):
        np.testing.assert_array_equal(together[:, i], euler.unwrap(q[:, i], order="YXZ"))


@pytest.mark.parametrize("order", ORDERS)
def test_distance_to_lock_is_that_of_the_middle_angle(order: str) -> None:
    angles = _angles()
    q = euler.to_quaternion(angles, order=order)
    middle = euler.from_quaternion(q, order=order)[:, 1]
    sine = np.sin(middle) if euler.is_proper(order) else np.cos(middle)
    np.testing.assert_allclose(np.sin(euler.gimbal_distance(q, order=order)), np.abs(sine), atol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_the_cosine_of_the_distance_to_lock(order: str) -> None:
    q = quaternion.normalize(np.random.default_rng(5).normal(size=(1000, 4)))
    distance = euler.gimbal_distance(q, order=order)
    np.testing.assert_allclose(euler.gimbal_cosine(q, order=order), np.cos(distance), atol=1e-14)


def test_fewer_axes_are_fewer_turns() -> None:
    np.testing.assert_allclose(euler.to_quaternion(np.array([np.pi]), order="Y"), (0, 1, 0, 0), atol=1e-15)
    np.testing.assert_array_equal(euler.to_quaternion(np.zeros((2, 0)), order=""), [[0, 0, 0, 1]] * 2)


def test_an_unknown_order_is_refused() -> None:
    with pytest.raises(RangeError, match="`order` is 'XXY'"):
        euler.from_quaternion(np.array((0.0, 0, 0, 1)), order="XXY")


@pytest.mark.parametrize("order", ["XYZ", "ZXZ"])
def test_the_memory_of_many_keys_is_few_times_theirs(order: str) -> None:
    """Of numpy's arrays: a clip of ten hours has a million keys."""
    q = euler.to_quaternion(np.linspace((0, 0.1, 0), (300, 0.9, 20), 100_000), order=order)
    tracemalloc.start()
    try:
        euler.unwrap(q, order=order)
        assert tracemalloc.get_traced_memory()[1] < 7 * q.nbytes
    finally:
        tracemalloc.stop()

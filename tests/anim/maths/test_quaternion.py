"""Quaternions against scipy's Rotation, against their own definitions, and at the edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from anim.arrays import Floats
from anim.errors import DataRangeError
from anim.maths import quaternion as quat

HALF = np.sqrt(0.5)
IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


def random(count: int, seed: int) -> Floats:
    return np.asarray(Rotation.random(count, seed).as_quat(), dtype=np.float64)


A, B = random(200, 1), random(200, 2)
VECTORS = np.random.default_rng(3).normal(size=(200, 3))

parts = st.floats(-1, 1, allow_nan=False)
units = (
    arrays(np.float64, 4, elements=parts)
    .filter(lambda q: bool(np.linalg.norm(q) > 0.1))
    .map(lambda q: np.asarray(q / np.linalg.norm(q)))
)
triples = arrays(np.float64, 3, elements=parts)


def same(a: Floats, b: Floats, tolerance: float = 1e-14) -> bool:
    """Whether both are the same rotations, signs aside, to `tolerance` radians."""
    return bool(np.max(quat.angle_between(a, b)) < tolerance)


def test_product_agrees_with_scipy() -> None:
    assert same(quat.multiply(A, B), (Rotation.from_quat(A) * Rotation.from_quat(B)).as_quat())


def test_product_by_hand() -> None:
    i, j, k = np.eye(4)[:3]
    np.testing.assert_array_equal(quat.multiply(i, j), k)
    np.testing.assert_array_equal(quat.multiply(j, i), -k)
    np.testing.assert_array_equal(quat.multiply(i, i), -IDENTITY)


def test_matrix_both_ways_agrees_with_scipy() -> None:
    np.testing.assert_allclose(quat.to_matrix(A), Rotation.from_quat(A).as_matrix(), atol=1e-15)
    assert same(quat.from_matrix(Rotation.from_quat(A).as_matrix()), A)


def test_from_matrix_of_half_turns() -> None:
    turns = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [HALF, HALF, 0, 0], [0, HALF, HALF, 0]])
    np.testing.assert_allclose(quat.from_matrix(quat.to_matrix(turns)), turns, atol=1e-15)


def test_rotation_vectors_agree_with_scipy() -> None:
    np.testing.assert_allclose(quat.rotation_vector(A), Rotation.from_quat(A).as_rotvec(), atol=1e-14)
    assert same(quat.from_rotation_vector(VECTORS), Rotation.from_rotvec(VECTORS).as_quat())


def test_rotate_agrees_with_scipy_and_the_sandwich() -> None:
    expected = Rotation.from_quat(A).apply(VECTORS)
    np.testing.assert_allclose(quat.rotate(A, VECTORS), expected, atol=1e-14)
    pure = np.concatenate((VECTORS, np.zeros((len(VECTORS), 1))), axis=1)
    sandwich = quat.multiply(quat.multiply(A, pure), quat.conjugate(A))
    np.testing.assert_allclose(sandwich[:, :3], expected, atol=1e-14)


@pytest.mark.parametrize("u", [0.0, 0.01, 0.25, 0.5, 0.9, 1.0])
def test_slerp_agrees_with_scipy(u: float) -> None:
    for a, b in zip(A[:40], B[:40], strict=True):
        assert same(quat.slerp(a, b, u), Slerp([0, 1], Rotation.from_quat([a, b]))(u).as_quat())


def test_slerp_is_a_power_of_the_turn_and_broadcasts() -> None:
    u = np.linspace(-0.5, 1.5, 9)
    turn = quat.rotation_vector(quat.multiply(quat.conjugate(A[0]), B[0]))
    expected = quat.multiply(A[0], quat.from_rotation_vector(u[:, None] * turn))
    np.testing.assert_allclose(quat.slerp(A[0], B[0], u), quat.align_signs(expected), atol=1e-14)


def test_slerp_meets_its_ends_exactly() -> None:
    np.testing.assert_array_equal(quat.slerp(A, B, 0.0), A)
    np.testing.assert_array_equal(np.abs(quat.slerp(A, B, 1.0)), np.abs(B))
    assert (quat.dot(quat.slerp(A, B, 1.0), A) >= 0).all()


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1e-7, np.pi - 1e-12, np.pi])
def test_slerp_and_angle_at_the_edges(angle: float) -> None:
    b = quat.from_rotation_vector(np.array([0.0, angle, 0.0]))
    middle = quat.slerp(IDENTITY, b, 0.5)
    np.testing.assert_allclose(middle, [0, np.sin(angle / 4), 0, np.cos(angle / 4)], rtol=1e-14, atol=1e-300)
    np.testing.assert_allclose(quat.angle_between(IDENTITY, b), angle, rtol=1e-12, atol=1e-300)
    np.testing.assert_allclose(quat.angle_between(IDENTITY, -b), angle, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(("degrees", "off"), [(30, 0.033), (60, 0.27), (90, 0.92), (120, 2.2), (150, 4.5)])
def test_nlerp_leaves_slerp_by_the_published_amount(degrees: float, off: float) -> None:
    b = quat.from_rotation_vector(np.array([np.radians(degrees), 0, 0]))
    u = np.linspace(0, 1, 501)
    worst = np.degrees(quat.angle_between(quat.nlerp(IDENTITY, b, u), quat.slerp(IDENTITY, b, u)).max())
    assert worst == pytest.approx(off, rel=0.03)


def test_normalize() -> None:
    np.testing.assert_array_equal(quat.normalize(np.array([0, 0, 0, -2.0])), [0, 0, 0, -1])
    with pytest.raises(DataRangeError, match="length 0"):
        quat.normalize(np.zeros((2, 4)))


def test_align_signs_over_many_joints() -> None:
    keys = np.stack((A[:50], B[:50]), axis=1)
    aligned = quat.align_signs(keys)
    assert (quat.dot(aligned[1:], aligned[:-1]) >= 0).all()
    np.testing.assert_array_equal(aligned[0], keys[0])
    np.testing.assert_array_equal(np.abs(aligned), np.abs(keys))


def test_derivative_is_the_slope_of_a_turn() -> None:
    step = 1e-6
    ahead = quat.multiply(A, quat.from_rotation_vector(step * VECTORS))
    behind = quat.multiply(A, quat.from_rotation_vector(-step * VECTORS))
    np.testing.assert_allclose(quat.derivative(A, VECTORS), (ahead - behind) / (2 * step), atol=1e-8)
    np.testing.assert_allclose(quat.dot(A, quat.derivative(A, VECTORS)), 0, atol=1e-14)


@given(units, units)
def test_products_stay_unit_and_undo(a: Floats, b: Floats) -> None:
    product = quat.multiply(a, b)
    assert np.linalg.norm(product) == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(quat.multiply(quat.conjugate(a), product), b, atol=1e-14)


@given(units)
def test_logarithm_undoes_exponential(q: Floats) -> None:
    vector = quat.rotation_vector(q)
    assert np.linalg.norm(vector) <= np.pi + 1e-15
    assert same(quat.from_rotation_vector(vector), q)
    assert np.linalg.norm(vector) == pytest.approx(float(quat.angle_between(IDENTITY, q)), abs=1e-14)


@given(units, triples)
def test_rotation_keeps_lengths_and_agrees_with_the_matrix(q: Floats, vector: Floats) -> None:
    turned = quat.rotate(q, vector)
    assert np.linalg.norm(turned) == pytest.approx(float(np.linalg.norm(vector)), abs=1e-14)
    np.testing.assert_allclose(turned, quat.to_matrix(q) @ vector, atol=1e-14)


@given(units, units, st.floats(0, 1))
def test_slerp_stays_unit_and_divides_the_angle(a: Floats, b: Floats, u: float) -> None:
    between = quat.slerp(a, b, u)
    assert np.linalg.norm(between) == pytest.approx(1, abs=1e-14)
    assert float(quat.angle_between(a, between)) == pytest.approx(u * float(quat.angle_between(a, b)), abs=1e-13)


def test_series_are_aligned_alone() -> None:
    random = np.random.default_rng(7)
    series = np.repeat([0, 1, 2, 5], [3, 1, 6, 4])
    keys = quat.normalize(random.normal(size=(len(series), 4)))
    alone = np.concatenate([quat.align_signs(keys[series == number]) for number in np.unique(series)])
    np.testing.assert_array_equal(quat.align_signs(keys, series), alone)
    assert quat.align_signs(np.zeros((0, 4)), np.zeros(0, np.int64)).shape == (0, 4)


@pytest.mark.parametrize("width", [3, 4])
def test_products_of_many_components_are_those_of_few(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = np.random.default_rng(2).normal(size=(2, 50, 7, width))
    few = quat.dot(a, b)
    monkeypatch.setattr(quat, "LARGE", 1)
    assert np.array_equal(quat.dot(a, b), few)

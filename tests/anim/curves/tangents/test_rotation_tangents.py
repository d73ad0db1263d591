"""Tangent rules for rotations: continuous rates as players show them, one axis as its angle, and scipy's own spline."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, RotationSpline

from anim.arrays import Floats
from anim.curves.tangents.rule import SplineKeys
from anim.curves.tangents.table import TANGENTS, apply_rotation_tangents, apply_tangents, parse
from anim.maths import quaternion as quat
from tests.anim.curves.tangents.splines import C1, EVERY, RNG, TIMES, TURNS, piece


def attitude(times: Floats, keys: SplineKeys, k: int, u: Floats) -> Floats:
    return quat.normalize(piece(times, keys, k, u))


def body_rate(times: Floats, keys: SplineKeys, k: int, u: float, step: float = 1e-5) -> Floats:
    """Return the angular velocity (3,) in rad/s by a central difference of what a player shows."""
    a, b = attitude(times, keys, k, np.array([u - step, u + step]))
    return np.asarray(
        quat.rotation_vector(quat.multiply(quat.conjugate(a), b)) / (2 * step * (times[k + 1] - times[k]))
    )


@pytest.mark.parametrize("name", C1)
def test_turn_has_continuous_rate(name: str) -> None:
    keys = apply_rotation_tangents(TIMES, TURNS, parse("natural" if name == "periodic" else name))
    for k in range(1, 8):
        before, after = body_rate(TIMES, keys, k - 1, 1.0), body_rate(TIMES, keys, k, 0.0)
        np.testing.assert_allclose(before, after, atol=1e-6)


@pytest.mark.parametrize("name", ["natural", "clamped", "bspline"])
def test_turn_has_continuous_acceleration(name: str) -> None:
    keys = apply_rotation_tangents(TIMES, TURNS, parse(name))
    for k in range(1, 8):
        h0, h1, step = TIMES[k] - TIMES[k - 1], TIMES[k + 1] - TIMES[k], 1e-3
        rates = [body_rate(TIMES, keys, k - 1, u) for u in (1 - 2 * step, 1 - step, 1.0)]
        before = (3 * rates[2] - 4 * rates[1] + rates[0]) / (2 * step * h0)
        rates = [body_rate(TIMES, keys, k, u) for u in (0.0, step, 2 * step)]
        after = (-3 * rates[0] + 4 * rates[1] - rates[2]) / (2 * step * h1)
        np.testing.assert_allclose(before, after, atol=2e-3 * (1 + np.abs(before).max()))


def test_turn_about_one_axis_is_the_rule_on_its_angle() -> None:
    angles = np.array([0.0, 0.8, 0.5, 1.2, 2.0])
    q = quat.from_rotation_vector(angles[:, None] * np.array([0.0, 0.6, 0.8]))
    flipped = q * np.array([1, -1, -1, 1, -1.0])[:, None]
    for name in [n for n in EVERY if not parse(n).smooth]:
        plain = apply_tangents(TIMES[:5], angles[:, None], parse(name))
        turned = apply_rotation_tangents(TIMES[:5], flipped, parse(name))
        np.testing.assert_allclose(turned.values, q, atol=1e-15)
        rates = 2 * quat.multiply(quat.conjugate(q), turned.out_tangents)
        np.testing.assert_allclose(rates[:, :3], plain.out_tangents * [0.0, 0.6, 0.8], atol=1e-12)
        np.testing.assert_allclose(rates[:, 3], 0, atol=1e-12)


def test_natural_turn_is_near_scipys_rotation_spline() -> None:
    """Another construction of the same kind: the attitudes differ by a small share of the turns between keys."""
    times, vectors = np.linspace(0, 2.75, 12), np.cumsum(RNG.normal(size=(12, 3)) * 0.15, axis=0)
    rotations = Rotation.from_rotvec(vectors)
    keys = apply_rotation_tangents(times, rotations.as_quat(), TANGENTS["natural"])
    spline = RotationSpline(times, rotations)
    for k in range(3, 8):
        u = np.linspace(0, 1, 20)
        off = quat.angle_between(attitude(times, keys, k, u), spline(times[k] + u * 0.25).as_quat())
        assert np.degrees(off.max()) < 0.15


@pytest.mark.parametrize("name", [n for n in EVERY if n != "centripetal"])
def test_turn_loop_has_no_seam_even_when_it_ends_upside_down(name: str) -> None:
    """One whole turn in five keys comes back as −q."""
    angles = np.array([0.0, 1.0, 2.5, 4.0, 5.0, 2 * np.pi])
    wobble = quat.from_rotation_vector(np.sin(angles)[:, None] * np.array([0.3, 0.0, 0.1]))
    q = quat.multiply(quat.from_rotation_vector(angles[:, None] * np.array([0.0, 1.0, 0.0])), wobble)
    times = np.array([0, 0.3, 0.7, 1.2, 1.4, 1.9])
    keys = apply_rotation_tangents(times, q, parse(name), cyclic=True)
    assert quat.dot(keys.values[0], keys.values[-1]) < -0.999
    assert quat.angle_between(keys.values[0], keys.values[-1]) < 1e-12
    np.testing.assert_allclose(body_rate(times, keys, 4, 1.0), body_rate(times, keys, 0, 0.0), atol=1e-6)


def test_bspline_turn_is_unit_and_says_how_far_it_leaves() -> None:
    keys = apply_rotation_tangents(TIMES, TURNS, TANGENTS["bspline"])
    np.testing.assert_allclose(np.linalg.norm(keys.values, axis=1), 1, atol=1e-15)
    assert keys.departure == pytest.approx(float(quat.angle_between(keys.values, TURNS).max()))
    assert keys.departure > 0.1

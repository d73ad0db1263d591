"""Rotations of rigid matrices against scipy, and what counts as rigid."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.skinning.polar_decomposition import RIGID_TOLERANCE, decompose


def test_rotations_are_those_of_scipy() -> None:
    turns = np.concatenate([Rotation.random(200, 1).as_quat(), np.eye(4), -np.eye(4), np.full((1, 4), 0.5)])
    parts = decompose(_moved(Rotation.from_quat(turns).as_matrix()), np.zeros((1, 3)))
    assert parts.scale_shear is None
    assert np.abs(np.abs((parts.rotation[:, 0] * turns).sum(axis=1)) - 1).max() < 1e-15 * 10
    largest = np.take_along_axis(parts.rotation[:, 0], np.abs(parts.rotation[:, 0]).argmax(axis=1)[:, None], axis=1)
    assert (largest > 0).all()
    assert (parts.translation == [1, 2, 3]).all()


SHEAR = np.array([[1, 2 * RIGID_TOLERANCE, 0], [0, 1, 0], [0, 0, 1]])


@pytest.mark.parametrize("off", [np.diag([1, 1, 1 + RIGID_TOLERANCE]), np.diag([1, -1, 1]), SHEAR, np.zeros((3, 3))])
def test_one_matrix_with_scale_shear_or_mirror_is_not_rigid(off: Floats) -> None:
    linear = Rotation.random(5, 2).as_matrix()
    assert decompose(_moved(linear), np.zeros((1, 3))).scale_shear is None
    linear[3] = linear[3] @ off
    assert decompose(_moved(linear), np.zeros((1, 3))).scale_shear is not None


def _moved(linear: Floats) -> Floats:
    """Matrices (n, 1, 3, 4) that also move by 1, 2, 3 m."""
    moves = np.broadcast_to(np.array([[1.0], [2], [3]]), (len(linear), 3, 1))
    return np.concatenate((linear, moves), axis=2)[:, None]

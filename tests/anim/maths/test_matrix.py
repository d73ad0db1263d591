"""Affine matrices: inverses against numpy's of whole matrices."""

from __future__ import annotations

import numpy as np

from anim.maths import matrix


def _whole(affine: np.typing.NDArray[np.float64]) -> np.typing.NDArray[np.float64]:
    last = np.broadcast_to((0.0, 0.0, 0.0, 1.0), (*affine.shape[:-2], 1, 4))
    return np.concatenate((affine, last), axis=-2)


def test_the_inverse_is_that_of_whole_matrices() -> None:
    affine = np.random.default_rng(3).normal(size=(5, 2, 3, 4))
    np.testing.assert_allclose(_whole(matrix.inverse(affine)), np.linalg.inv(_whole(affine)), atol=1e-9)


def test_what_is_flattened_stays_flat() -> None:
    """A scale of (0, 2, 4) at (1, 2, 3): x is lost, the rest comes back."""
    flat = np.array([[0.0, 0, 0, 1], [0, 2, 0, 2], [0, 0, 4, 3]])
    point = np.array([[5.0, 6, 7]])
    back = matrix.apply(matrix.inverse(flat), matrix.apply(flat, point))
    np.testing.assert_allclose(back, [[0, 6, 7]], atol=1e-12)

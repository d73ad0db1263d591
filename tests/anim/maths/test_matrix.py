"""Affine matrices: inverses against numpy's of whole matrices."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
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


def test_products_from_tops_are_those_of_each_node_after_its_parent() -> None:
    random, count = np.random.default_rng(1), 300
    rotation = random.normal(size=(count, 4))
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    local = matrix.from_trs(random.normal(size=(count, 3)), rotation, np.ones((count, 3)))
    parents = np.array([-1, *(int(random.integers(max(i - 3, 0), i)) for i in range(1, count))])
    parents[[5, 170]] = -1
    found, tops = matrix.accumulate_from_tops(local, parents)
    expected: list[Floats] = []
    for i, parent in enumerate(parents.tolist()):
        whole = np.vstack((local[i], [0, 0, 0, 1]))
        expected.append(whole if parent < 0 else expected[parent] @ whole)
        assert tops[i] == (i if parent < 0 else tops[parent])
    np.testing.assert_allclose(found, np.array(expected)[:, :3], atol=1e-10)

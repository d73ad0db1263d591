"""Affine matrices: inverses against numpy's of whole matrices."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.maths import hierarchy, matrix
from tests.anim.maths.test_hierarchy import levels_of


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


@pytest.mark.parametrize("count", [300, 2000])
def test_products_from_tops_are_those_of_each_node_after_its_parent(count: int) -> None:
    """Also in a hierarchy that is deep and thin, whose levels are computed in sections."""
    random = np.random.default_rng(1)
    rotation = random.normal(size=(count, 4))
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    local = matrix.from_trs(random.normal(size=(count, 3)), rotation, np.ones((count, 3)))
    whole = np.array([-1, *(int(random.integers(max(i - 3, 0), i)) for i in range(1, count))])
    parents = whole.copy()
    tops = [5, 170, count // 2]
    parents[tops], local[tops] = -1, np.eye(4)[:3]
    levels = levels_of(whole.tolist())
    assert hierarchy.is_deep(levels) == (count == 2000)
    found = matrix.accumulate_from_tops(local, parents, levels)
    expected: list[Floats] = []
    for i, parent in enumerate(parents.tolist()):
        own = np.vstack((local[i], [0, 0, 0, 1]))
        expected.append(own if parent < 0 else expected[parent] @ own)
    np.testing.assert_allclose(found, np.array(expected)[:, :3], atol=1e-9)

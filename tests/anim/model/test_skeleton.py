"""Skeleton: a forest, level by level."""

from __future__ import annotations

import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from anim.errors import FormatError, RangeError, ShapeError
from anim.model import Skeleton
from tests.clips import skeleton


def test_levels_hold_every_node_once_and_parents_first() -> None:
    #   1       4
    #  / \      |
    # 3   0     5
    #     |
    #     2
    found = [sorted(level.tolist()) for level in skeleton([1, -1, 0, 1, -1, 4]).levels()]
    assert found == [[1, 4], [0, 3, 5], [2]]
    assert skeleton([]).levels() == []


@pytest.mark.parametrize("parents", [[0], [1, 0], [-1, 2, 3, 1], [1, 2, 2]])
def test_cycles_are_refused(parents: list[int]) -> None:
    with pytest.raises(FormatError, match="cycle"):
        skeleton(parents)


@pytest.mark.parametrize("parents", [[-2], [1], [-1, 5]])
def test_parents_exist(parents: list[int]) -> None:
    with pytest.raises(FormatError, match="does not exist"):
        skeleton(parents)


def test_rows_are_counted() -> None:
    with pytest.raises(ShapeError, match="translation has 2 rows for 1"):
        skeleton([-1], translation=np.zeros((2, 3)))
    with pytest.raises(ShapeError, match="rotation"):
        skeleton([-1], rotation=np.zeros((1, 3)))
    with pytest.raises(RangeError, match="scale"):
        skeleton([-1], scale=[[1, 1, float("nan")]])


def test_labels() -> None:
    none = np.zeros((2, 3))
    nodes = Skeleton(("hip", ""), np.array([-1, -1]), none, np.tile([0, 0, 0, 1.0], (2, 1)), none)
    assert nodes.label(0) == "node 0 'hip'"
    assert nodes.label(1) == "node 1"
    assert len(nodes) == 2


def test_nobody_writes_into_a_skeleton() -> None:
    sheared, local = np.array([0]), np.zeros((1, 3, 4))
    tree = replace(skeleton([-1, 0]), sheared=sheared, sheared_local=local)
    sheared[0], local[0] = 1, 7
    assert tree.sheared.tolist() == [0]
    assert not tree.sheared_local.any()
    parts = [getattr(tree, each.name) for each in fields(tree) if each.init]
    arrays = [each for each in parts if isinstance(each, np.ndarray)] + tree.levels()
    assert len(arrays) == 8
    assert [array.flags.writeable for array in arrays] == [False] * len(arrays)
    with pytest.raises(ShapeError, match="sheared_local has 2 matrices for 1 nodes"):
        replace(tree, sheared_local=np.zeros((2, 3, 4)))


def test_copies_are_read_only_and_comparison_is_by_identity() -> None:
    one = skeleton([-1, 0])
    other = pickle.loads(pickle.dumps(one))
    assert not other.translation.flags.writeable
    assert one == one
    assert one != other
    assert len({one, other}) == 2

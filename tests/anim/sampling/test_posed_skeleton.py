"""Frames of a hierarchy against products written out."""

from __future__ import annotations

import numpy as np

from anim.maths import matrix
from anim.model import Skeleton
from anim.sampling import PoseSampler
from tests.clips import clip, skeleton, track

TIMES = np.array([0.0, 0.1, 0.25, 0.7, 1.0])


def test_children_may_be_numbered_before_their_parents_and_sheared_nodes_keep_their_matrix() -> None:
    tree = skeleton([2, 0, -1, 1], translation=np.arange(12.0).reshape(4, 3), scale=np.full((4, 3), 2.0))
    sheared = np.array([[[1, 0.5, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9.0]]])
    tree = Skeleton(tree.names, tree.parents, tree.translation, tree.rotation, tree.scale, np.array([0]), sheared)
    played = clip(track("translation", [0, 1], [[0, 0, 0], [4, 0, 0]], node=2))
    world = PoseSampler(tree, played).posed(np.array([0.5])).world[:, 0]
    root = matrix.from_trs(np.array([2.0, 0, 0]), np.array([0.0, 0, 0, 1]), np.full(3, 2.0))
    assert np.array_equal(world[2], root)
    assert np.array_equal(world[0], matrix.multiply(root, sheared[0]))
    assert np.array_equal(world[1, :, 3], matrix.apply(world[0], np.array([[3.0, 4, 5]]))[0])
    assert np.array_equal(world[3, :, 3], matrix.apply(world[1], np.array([[9.0, 10, 11]]))[0])


def test_a_file_without_nodes_has_frames_without_matrices() -> None:
    empty = skeleton([], translation=np.empty((0, 3)), rotation=np.empty((0, 4)))
    assert PoseSampler(empty, clip()).posed(TIMES).world.shape == (0, 5, 3, 4)

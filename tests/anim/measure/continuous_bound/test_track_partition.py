"""Tracks sorted by what moves in either version."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.measure.continuous_bound.track_partition import partition_tracks
from anim.model import Scene
from anim.sampling.lazy_batch import LazyBatch
from tests.clips import CUBICSPLINE, clip, skeleton, track

OF = Scene(skeleton([-1, 0, 0]), ())
TIMES = [0.0, 1.0]
SAME, OTHER = np.ones((2, 3)), np.array([[1.0, 1, 1], [2, 1, 1]])


def _nodes(batches: Sequence[LazyBatch]) -> set[tuple[int | None, str]]:
    return {(each.node, each.path) for batch in batches for each in batch.tracks}


def test_what_moves_in_one_version_moves_in_both() -> None:
    first = clip(track("scale", TIMES, SAME, node=0), track("scale", TIMES, SAME, node=1))
    second = clip(track("scale", TIMES, SAME, node=0), track("scale", TIMES, OTHER, node=1))
    a, b = partition_tracks((OF, OF), (first, second))
    assert _nodes(a.moving) == _nodes(b.moving) == {(1, "scale")}
    assert _nodes(a.still) == _nodes(b.still) == {(0, "scale")}
    assert all(len(batch.time_axis) == len(batch.whole.values) == 1 for batch in a.still)


def test_a_cubic_of_equal_keys_moves_where_it_has_tangents() -> None:
    zero, some = np.zeros((2, 3)), np.ones((2, 3))
    both = [track("scale", TIMES, SAME, CUBICSPLINE, node=n, tangents=(t, t)) for n, t in ((0, zero), (1, some))]
    a, _ = partition_tracks((OF, OF), (clip(*both), clip(*both)))
    assert (_nodes(a.moving), _nodes(a.still)) == ({(1, "scale")}, {(0, "scale")})
    assert a.still[0].whole.tangents is not None
    assert a.still[0].whole.tangents[0].shape == (1, 1, 3)


def test_tracks_of_nodes_that_are_not_there_are_left_out() -> None:
    a, b = partition_tracks((OF, OF), (clip(track("scale", TIMES, OTHER, node=7)), clip()))
    assert [*a.moving, *a.still, *b.moving, *b.still] == []


def test_weights_by_their_number() -> None:
    first = clip(track("weights", TIMES, [[0, 1], [1, 1]], node=2), track("weights", TIMES, [[1], [1]], node=1))
    a, _ = partition_tracks((OF, OF), (first, first))
    assert [batch.whole.values.shape for batch in (*a.weights(2, 2), *a.weights(1, 1))] == [(2, 1, 2), (2, 1, 1)]
    assert a.weights(2, 3) == a.weights(0, 2) == []

"""Tracks that move, of many at once: the same as each alone."""

from __future__ import annotations

import numpy as np

from anim.show.plots.moving_tracks import are_moving
from tests import clips
from tests.anim.operations.tracks import TRACKS
from tests.clips import CUBICSPLINE, about

TURN = about("z", [30, 30, 30])
SIGNS = np.array([[1.0], [-1], [1]])


def test_signs_of_rotations_do_not_move_and_do_not_reach_the_next_track() -> None:
    tracks = [
        clips.track("rotation", [0, 1, 2], TURN * SIGNS),
        clips.track("rotation", [0, 1, 2], -TURN),
        clips.track("rotation", [0, 1, 2], about("z", [30, 31, 30])),
        clips.track("rotation", [0], TURN[:1]),
    ]
    assert are_moving(tracks).tolist() == [False, False, True, False]


def test_tangents_move_between_equal_keys() -> None:
    same, none, slope = np.ones((2, 3)), np.zeros((2, 3)), np.ones((2, 3))
    splines = [
        clips.track("scale", [0, 1], same, CUBICSPLINE, tangents=(none, none)),
        clips.track("scale", [0, 1], same, CUBICSPLINE, tangents=(none, slope)),
        clips.track("scale", [0], same[:1], CUBICSPLINE, tangents=(slope[:1], slope[:1])),
    ]
    assert are_moving(splines).tolist() == [False, True, False]


def test_changes_count_by_the_size_of_the_values() -> None:
    small = np.array([[1.0, 0, 0], [1 + 1e-5, 0, 0]])
    tracks = [clips.track("translation", [0, 1], each) for each in (small, small * [[1], [1.001]], 0 * small)]
    assert are_moving(tracks).tolist() == [False, True, False]


def test_many_tracks_are_as_each_alone() -> None:
    tracks = [*TRACKS.values(), *TRACKS.values()]
    assert are_moving(tracks).tolist() == [bool(are_moving([each])[0]) for each in tracks]


def test_tracks_that_share_keys_move_alike() -> None:
    moving, still = clips.track("scale", [0, 1], [[1, 1, 1], [2, 1, 1]]), clips.track("scale", [0, 1], np.ones((2, 3)))
    tracks = [moving, still, moving.on_node(4), still.on_node(5), moving.on_node(6)]
    assert are_moving(tracks).tolist() == [True, False, True, False, True]

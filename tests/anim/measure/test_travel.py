"""Seams and ways of clips against closed forms, and all clips at once against one pose at a time."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure import levers
from anim.measure.travel import Travel, traveling_root, travels
from anim.model import Clip, Skeleton
from anim.sampling import pose
from anim.sampling.pose import world_by_node
from tests import clips
from tests.anim.ops.tracks import TRACKS

ARM = clips.skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]])  # its size is 1 m
WALK = clips.clip(clips.track("translation", [0, 4], [[0, 0, 0], [2, 0, 0]]))


def only(skeleton: Skeleton, clip: Clip) -> Travel:
    return travels(skeleton, [clip])[0]


def test_a_root_that_leads_somewhere_is_taken_off_the_seam() -> None:
    way = only(ARM, WALK)
    assert (way.root, way.distance, way.speed) == (0, 2.0, 0.5)
    assert way.seam == pytest.approx(0, abs=1e-12)
    assert way.speed_seam == pytest.approx(0, abs=1e-9)
    assert traveling_root(ARM, WALK) == 0


def test_a_node_with_nothing_on_it_leads_nowhere() -> None:
    assert only(clips.skeleton([-1, -1]), WALK).seam == pytest.approx(2)
    assert traveling_root(clips.skeleton([-1, -1]), WALK) == -1


def test_there_and_back_closes_in_place_and_not_in_speed() -> None:
    swing = clips.clip(clips.track("translation", [0, 1, 2], [[0, 0, 0], [1, 0, 0], [0, 0, 0]]))
    way = only(ARM, swing)
    assert (way.root, way.distance, way.seam) == (0, 0.0, 0.0)
    assert way.speed_seam == pytest.approx(2)  # 1 m/s out, 1 m/s back


def test_a_quarter_turn_is_open_by_the_chord_of_the_farthest_lever() -> None:
    turn = clips.clip(clips.track("rotation", [0, 1], clips.about("z", [0, 90])))
    way = only(ARM, turn)
    assert way.root == -1
    assert way.seam == pytest.approx(np.sqrt(2) * (1 + levers.LEVER))
    speed = np.pi / 2 * (1 + levers.LEVER)  # at the start along y, at the end along −x
    assert way.speed_seam == pytest.approx(np.sqrt(2) * speed, rel=1e-3)


def test_the_root_is_the_moved_node_nearest_to_the_top() -> None:
    still = clips.track("translation", [0, 1], [[1, 1, 1], [1, 1, 1]], node=0)
    moved = clips.track("translation", [0, 1], [[1, 0, 0], [1, 3, 0]], node=1)
    assert only(ARM, clips.clip(moved, still)).root == 1


def test_a_clip_without_time_has_no_way() -> None:
    nothing = Travel(0.0, 0.0, -1, 0.0, 0.0)
    assert only(ARM, clips.clip(clips.track("translation", [1], [[3, 0, 0]]))) == nothing
    assert travels(clips.skeleton([]), [clips.clip()]) == [nothing]
    assert travels(ARM, []) == []


def test_clips_of_different_lengths_are_each_seen_at_their_own_ends() -> None:
    many = [clips.clip(track) for track in TRACKS.values()] + [WALK]
    first = world_by_node(ARM, pose(ARM, many[0], np.array([many[0].start])))  # how large it is there, levers follow
    for clip, way in zip(many, travels(ARM, many), strict=True):
        world = world_by_node(ARM, pose(ARM, clip, np.array([clip.start, clip.end])))
        points = levers.points(np.concatenate((first, world), axis=1)).reshape(2, levers.PER_NODE, 3, 3)
        away = points[:, :, 2] - points[:, :, 1]
        if traveling_root(ARM, clip) >= 0:
            away = away - away[0, 0]
        assert way.seam == pytest.approx(np.linalg.norm(away, axis=-1).max(), abs=1e-12)
        alone = only(ARM, clip)
        assert (way.root, way.distance, way.speed) == (alone.root, alone.distance, alone.speed)

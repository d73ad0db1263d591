"""Ways of clips against closed forms, and all clips at once against one at a time."""

from __future__ import annotations

import pytest

from anim.measure.inspect.root_motion import RootMotion, figure_nodes, root_motion_node, root_motions
from anim.model import Clip, Skeleton
from tests import clips
from tests.anim.operations.tracks import TRACKS

ARM = clips.skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]])  # its size is 1 m
WALK = clips.clip(clips.track("translation", [0, 4], [[0, 0, 0], [2, 0, 0]]))


def only(skeleton: Skeleton, clip: Clip) -> RootMotion:
    return root_motions(skeleton, [clip])[0]


def test_a_root_that_leads_somewhere() -> None:
    assert only(ARM, WALK) == RootMotion(0, 2.0, 0.5)
    assert root_motion_node(ARM, WALK) == 0


def test_a_node_with_nothing_on_it_leads_nowhere() -> None:
    assert root_motion_node(clips.skeleton([-1, -1]), WALK) == -1


def test_the_root_is_one_of_the_figure() -> None:
    """A box of another scene goes somewhere while the character, here its joint, stands still."""
    nodes = clips.skeleton([-1, 0, -1])
    box = clips.clip(clips.track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]], node=2))
    of_skin = figure_nodes({"skins": [{"joints": [1]}]}, nodes)
    assert of_skin == {0, 1}
    scenes = [{"nodes": [2]}, {"nodes": [0]}]
    assert figure_nodes({"scenes": scenes, "scene": 1, "nodes": [{"children": [1]}, {}, {}]}, nodes) == {0, 1}
    assert figure_nodes({}, nodes) == {0, 1, 2}
    assert root_motions(nodes, [box], figure=of_skin) == [RootMotion(-1, 0.0, 0.0)]
    assert root_motions(nodes, [box])[0].root == 2


def test_there_and_back_leads_nowhere() -> None:
    swing = clips.clip(clips.track("translation", [0, 1, 2], [[0, 0, 0], [1, 0, 0], [0, 0, 0]]))
    assert only(ARM, swing) == RootMotion(0, 0.0, 0.0)
    assert root_motion_node(ARM, swing) == -1


def test_a_turn_has_no_root() -> None:
    assert only(ARM, clips.clip(clips.track("rotation", [0, 1], clips.about("z", [0, 90])))).root == -1


def test_the_root_is_the_moved_node_nearest_to_the_top() -> None:
    still = clips.track("translation", [0, 1], [[1, 1, 1], [1, 1, 1]], node=0)
    moved = clips.track("translation", [0, 1], [[1, 0, 0], [1, 3, 0]], node=1)
    assert only(ARM, clips.clip(moved, still)).root == 1


def test_a_clip_without_time_has_no_way() -> None:
    nothing = RootMotion(-1, 0.0, 0.0)
    assert only(ARM, clips.clip(clips.track("translation", [1], [[3, 0, 0]]))) == nothing
    assert root_motions(clips.skeleton([]), [clips.clip()]) == [nothing]
    assert root_motions(ARM, []) == []


def test_clips_of_different_lengths_are_each_seen_at_their_own_ends() -> None:
    many = [clips.clip(track) for track in TRACKS.values()] + [WALK]
    ways = root_motions(ARM, many)
    for clip, way in zip(many, ways, strict=True):
        assert way == only(ARM, clip)
    assert ways[-1].distance == pytest.approx(2)

"""Skins find the skeleton that they share without looking at all."""

from __future__ import annotations

import numpy as np
import pytest

from anim.exchange.usd_skel import skeleton_group
from anim.exchange.usd_skel.bind_poses import MAX_POSES_PER_JOINT, BindPose, BindPoses
from anim.gltf.reading import reader
from anim.model import Skin
from tests import many
from tests.calls import count_calls
from tests.files import opened


def skin(*joints: int, height: float = 0.0) -> Skin:
    binds = np.tile(np.eye(4)[:3], (len(joints), 1, 1))
    binds[:, 1, 3] = height
    return Skin(np.array(joints), binds)


def test_skeletons_with_a_common_joint_in_their_order() -> None:
    poses = BindPoses()
    for number, joints in enumerate([(3, 4), (0, 1), (1, 2)]):
        poses.add(skin(*joints), number)
    assert poses.candidates(skin(2, 4)) == [0, 2]
    assert poses.candidates(skin(1)) == [1, 2]
    assert poses.candidates(skin(5)) == []


def test_an_equal_skin_is_found_behind_many_others() -> None:
    poses = BindPoses()
    for number in range(100):
        poses.add(skin(0, 1, height=number), number)
    first = list(range(MAX_POSES_PER_JOINT))
    assert poses.candidates(skin(0, 1, height=90)) == [*first, 90]
    assert poses.candidates(skin(0, 1, height=0.5)) == first


def test_each_skin_is_compared_with_few(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = reader.scene(opened(many.skins_different(100)))
    counted = count_calls(monkeypatch, BindPose, "matrix_into")
    groups = skeleton_group.group_skeletons(scene, scene.instances)
    assert len(groups) == 100
    assert len(counted) <= MAX_POSES_PER_JOINT * 100

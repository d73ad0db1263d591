"""Distances from the links between joints, and the clamp that keeps them."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.skinning.bake import bake
from anim.skinning.binding import bind_skin
from anim.skinning.methods.bulge_clamp import bone_segments, bone_tips
from tests.anim.skinning.scenes import mesh, scene
from tests.clips import about, clip, track
from tests.files import opened_fixture


def test_links_go_from_joint_to_joint() -> None:
    """A chain along x of three joints a metre apart: two links, and the last joint's own place."""
    binds = [np.eye(4)[:3].copy() for _ in range(3)]
    for i, bind in enumerate(binds):
        bind[0, 3] = -i
    points = [[0.5, 2, 0], [0.5, 2, 0], [2.5, 2, 0], [-1, 0, 0]]
    body = mesh(points, [[0, 0], [1, 0], [2, 0], [0, 1]], [[1, 0], [1, 0], [1, 0], [0.75, 0.25]])
    of = scene(body, [-1, 0, 1], inverse_bind=binds)
    found = bone_segments(bind_skin(of.instances[0], of.skeleton.parents))
    assert found.tips.tolist() == [1, 2, 2]
    assert found.distance == pytest.approx([2, np.hypot(0.5, 2), np.hypot(0.5, 2), 1])
    assert found.fraction == pytest.approx([0, 0, 0, 0.75])


def test_the_clamp_takes_the_bulge_of_a_bent_arm_and_nothing_else() -> None:
    of = reader.scene(opened_fixture("tube"))
    made = bind_skin(of.instances[0], of.skeleton.parents)
    rest = bone_segments(made).distance
    bend = clip(track("rotation", [0], about("x", [90]), node=1))
    free = bake(of, bend, times=np.zeros(1), method="dqs").load_all().positions[0].astype(float)
    held = bake(of, bend, times=np.zeros(1), method="dqs", bulge_clamp=True).load_all().positions[0].astype(float)
    shared = bone_segments(made).fraction
    assert np.array_equal(free[shared == 0], held[shared == 0])

    before, after = (np.linalg.norm(points - _nearest(points), axis=1) for points in (free, held))
    assert (before[shared > 0.5] / rest[shared > 0.5]).max() > 1.3
    assert after == pytest.approx(np.where(before > rest, before - shared * (before - rest), before), abs=1e-5)


def test_a_twist_is_not_touched() -> None:
    of = reader.scene(opened_fixture("tube"))
    twist = clip(track("rotation", [0], about("y", [120]), node=1))
    free = bake(of, twist, times=np.zeros(1), method="dqs").load_all().positions
    held = bake(of, twist, times=np.zeros(1), method="dqs", bulge_clamp=True).load_all().positions
    assert np.abs(free - held).max() < 1e-6


def test_scaled_joints_allow_more() -> None:
    of = reader.scene(opened_fixture("tube"))
    grown = clip(track("scale", [0], [[3, 3, 3]], node=0))
    free = bake(of, grown, times=np.zeros(1), method="dqs").load_all().positions
    held = bake(of, grown, times=np.zeros(1), method="dqs", bulge_clamp=True).load_all().positions
    assert np.abs(free - held).max() < 1e-5


def _nearest(points: np.ndarray) -> np.ndarray:
    """Nearest points of the lower link, from the foot to the middle; the upper joint's is its own place there."""
    return np.asarray(np.clip(points[:, 1:2], 0, 0.5) * [0, 1, 0])


@pytest.mark.parametrize("seed", range(3))
def test_bones_of_random_trees(seed: int) -> None:
    """Joints in any order, against a search of each joint's children."""
    random = np.random.default_rng(seed)
    order = random.permutation(20)
    above = np.full(20, -1)
    for i in range(1, 20):
        above[order[i]] = order[random.integers(i)] if random.random() < 0.9 else -1
    start, tips = bone_tips(above)
    for joint in range(20):
        below = np.flatnonzero(above == joint)
        assert tips[start[joint] : start[joint + 1]].tolist() == (below.tolist() or [joint])


def test_bones_of_a_long_chain_take_no_search_per_joint() -> None:
    """Which would be 40 billion comparisons."""
    start, tips = bone_tips(np.arange(200_000) - 1)
    assert tips.tolist() == [*range(1, 200_000), 199_999]
    assert start.tolist() == list(range(200_001))

"""Distances that vertices move where single nodes change, in one block and in many."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.reading import reader
from anim.measure.loops import carried_distance
from anim.measure.loops.carried_distance import carried_distances
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Pose, Scene
from anim.sampling.pose import sample_pose
from tests.clips import about, clip, skeleton, track
from tests.files import opened_fixture

TREE = skeleton([-1, 0, 1, 1, 0, 4], translation=np.arange(18).reshape(6, 3) / 10)
TURN = clip(
    *(track("rotation", [0, 1], about("xyz"[i % 3], [0, 10 + i]), node=i) for i in (1, 2, 3, 5)),
    track("translation", [0, 1], np.array([[0, 0, 0], [0, 0, 0.5]]), node=4),
)


def _ends(skin: SkinMotion, end: float, moving: Clip = TURN) -> list[Pose]:
    return [sample_pose(skin.skeleton, moving, np.array([time])) for time in (0.0, end)]


def _distances(skin: SkinMotion, root: int = -1) -> Floats:
    nodes = np.array([1, 2, 3, 4, 5])
    return carried_distances(skin, _ends(skin, 1.0), 0 * nodes, nodes, np.array([root]))


@pytest.mark.parametrize("root", [-1, 4])
@pytest.mark.parametrize("limit", [1, 12])
def test_blocks_give_the_same_distances(limit: int, root: int, monkeypatch: pytest.MonkeyPatch) -> None:
    skin = SkinMotion(Scene(TREE, ()))
    whole = _distances(skin, root)
    assert (whole > 0).sum() == 5 - (root == 4)
    monkeypatch.setattr(carried_distance, "MAX_MATRICES", limit)
    assert _distances(skin, root) == pytest.approx(whole, rel=1e-5)


def test_blocks_of_a_skinned_figure_give_the_same_distances(monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened_fixture("biped")
    skin = SkinMotion(reader.scene(document))
    ends = _ends(skin, 0.3, reader.clips(document)[0])
    nodes = np.arange(len(skin.skeleton))
    whole = carried_distances(skin, ends, 0 * nodes, nodes, np.array([0]))
    assert (whole > 0).sum() > 3
    monkeypatch.setattr(carried_distance, "MAX_MATRICES", 3 * len(nodes))
    assert carried_distances(skin, ends, 0 * nodes, nodes, np.array([0])) == pytest.approx(whole, rel=1e-4, abs=1e-7)


def test_a_scene_without_points_has_no_distances() -> None:
    skin = SkinMotion(Scene(skeleton([]), ()))
    none = np.array([], np.int64)
    assert carried_distances(skin, _ends(skin, 1.0, clip()), none, none, np.array([-1])).shape == (0,)

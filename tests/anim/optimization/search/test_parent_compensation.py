"""Rotations that aim at their node's direction in the world: errors above do not carry on below."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix
from anim.model import Scene
from anim.optimization.options import Packing
from anim.optimization.search.candidates import Candidates
from anim.optimization.search.parent_compensation import ParentCompensation, budget_gain
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.time_axes import SharedAxis
from tests.anim.optimization.making import TIMES, truth_of, turning
from tests.clips import clip, skeleton, track

# An arm of four bones, each 1 m long, and a point at its tip.
ARM = Scene(skeleton([-1, 0, 1, 2], translation=[[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]]), ())
TIP = PointMatrix(np.array([3]), np.array([[0]]), np.array([[[1.0, 0, 0, 1]]]))
BENDS = clip(*(track("rotation", TIMES, turning(0.6 + 0.2 * i, (0.2 * i, 1, i)), node=i) for i in range(4)))
EVERY_KEY = np.ones(len(TIMES), np.bool_)
COARSE = [2e-2] * 4


def _truth() -> SourceMotion:
    return truth_of(ARM, BENDS, TIP)


def _directions(rotation: Floats) -> Rotation:
    """World rotations of the last node, by scipy: (W,)."""
    found = Rotation.identity()
    for own in rotation:
        found = found * Rotation.from_quat(own)
    return found


def _shown(source: SourceMotion, keys: Bools) -> tuple[Floats, Floats]:
    """What all rotations show, stored coarsely: each for itself, and aiming at the world."""
    axis = SharedAxis(keys, (0, 1, 2, 3))
    candidates = Candidates(source, Packing.EXT)
    local, aimed = source.local[1].copy(), source.local[1].copy()
    for i, each in candidates.of(axis, COARSE):
        local[source.moving[i].node] = each.shown
    found = dict(ParentCompensation(ARM.skeleton, source, candidates).follow([axis], COARSE, aimed))
    assert sorted(found) == [0, 1, 2, 3]
    assert all((aimed[source.moving[i].node] == each.shown).all() for i, each in found.items())
    return local, aimed


@pytest.mark.parametrize("keys", [EVERY_KEY, np.arange(25) % 4 == 0])
def test_directions_are_no_more_off_below_than_above(keys: Bools) -> None:
    source = _truth()
    local, aimed = _shown(source, keys)
    off = [(_directions(shown) * _directions(source.local[1]).inv()).magnitude().max() for shown in (local, aimed)]
    alone = (Rotation.from_quat(aimed[0]) * Rotation.from_quat(source.local[1][0]).inv()).magnitude().max()
    assert off[1] < 0.65 * off[0]
    assert off[1] < 2 * alone or not keys.all()


def test_roots_are_as_they_were() -> None:
    local, aimed = _shown(_truth(), EVERY_KEY)
    assert (local[0] == aimed[0]).all()
    assert (local[3] != aimed[3]).any()


def test_tracks_on_no_axis_are_made_up_for() -> None:
    """Joint 1 is held straight: joint 2 turns for both."""
    source = _truth()
    axis = SharedAxis(EVERY_KEY, (0, 2, 3))
    shown = source.local[1].copy()
    shown[1] = [0, 0, 0, 1]
    for _ in ParentCompensation(ARM.skeleton, source, Candidates(source, Packing.CORE)).follow(
        [axis], [0.0] * 4, shown
    ):
        pass
    off = _directions(shown[:3]) * _directions(source.local[1][:3]).inv()
    assert off.magnitude()[source.on_grid].max() < 1e-5


def test_leeway_is_the_whole_arm_against_one_bone() -> None:
    assert budget_gain(ARM.skeleton, _truth(), TIP) == pytest.approx([_reach(0), _reach(1), _reach(2), 1])


def _reach(node: int) -> float:
    """How far the tip gets from a node at most, by scipy; in bones of 1 m."""
    source = _truth()
    tip = np.zeros((len(source.at), 3))
    for i in range(3, node - 1, -1):
        tip = Rotation.from_quat(source.local[1][i]).apply(tip + np.array([1.0, 0, 0]))
    return float(np.linalg.norm(tip, axis=1).max())


def test_only_rotations_have_leeway() -> None:
    sway = track("translation", TIMES, np.ones((25, 3)) * TIMES[:, None], node=0)
    source = truth_of(ARM, clip(sway, *BENDS.tracks), TIP)
    assert budget_gain(ARM.skeleton, source, TIP)[0] == 1


def test_nodes_below_the_last_rotation_track_take_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A long chain whose second node turns: world rotations of two nodes are needed."""
    chain = Scene(skeleton(range(-1, 99), translation=np.tile([0.01, 0, 0], (100, 1))), ())
    tip = PointMatrix(np.array([99]), np.array([[0]]), np.array([[[0.1, 0, 0, 1]]]))
    source = truth_of(chain, clip(track("rotation", TIMES, turning(0.6, (0, 1, 0)), node=1)), tip)
    sizes: list[int] = []

    def called(a: Floats, b: Floats) -> Floats:
        sizes.append(len(b))
        return multiply(a, b)

    multiply = quaternion.multiply
    monkeypatch.setattr(quaternion, "multiply", called)
    compensation = ParentCompensation(chain.skeleton, source, Candidates(source, Packing.CORE))
    assert sizes == [1, 1]
    found = dict(compensation.follow([SharedAxis(EVERY_KEY, (0,))], [1e-3], source.local[1].copy()))
    assert list(found) == [0]
    assert len(sizes) <= 6

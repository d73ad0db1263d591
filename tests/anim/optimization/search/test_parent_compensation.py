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
from anim.optimization.search.axis_merging import SharedAxis
from anim.optimization.search.keyed_tracks import KeyedTracks
from anim.optimization.search.parent_compensation import ParentCompensation, budget_gain
from anim.optimization.search.source_motion import ROTATION, SourceMotion
from anim.optimization.search.stacked_clips import StackedClips
from tests.anim.optimization.making import TIMES, truth_of, turning
from tests.clips import clip, skeleton, track

# An arm of four bones, each 1 m long, and a point at its tip.
ARM = Scene(skeleton([-1, 0, 1, 2], translation=[[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]]), ())
TIP = PointMatrix(np.array([3]), np.array([[0]]), np.array([[[1.0, 0, 0, 1]]]))
BENDS = clip(*(track("rotation", TIMES, turning(0.6 + 0.2 * i, (0.2 * i, 1, i)), node=i) for i in range(4)))
EVERY_KEY = np.ones(len(TIMES), np.bool_)
COARSE = np.full(4, 2e-2)
ONE = np.array([0])


def _truth() -> SourceMotion:
    return truth_of(ARM, BENDS, TIP)


def _stacked(*sources: SourceMotion) -> StackedClips:
    return StackedClips(ARM.skeleton, sources, TIP)


def _shown_by_node(clips: StackedClips, shown: Floats, clip: int) -> Floats:
    """Rotations (4, M, W) of nodes with tracks as those of all nodes (N, W', 4), without repeated times."""
    source = clips.sources[clip]
    rotation = source.local[1].copy()
    rotation[clips.moving] = np.moveaxis(shown, 0, 2)[:, : len(source.at)]
    return rotation


def _directions(rotation: Floats) -> Rotation:
    """World rotations of the last node, by scipy: (W,)."""
    found = Rotation.identity()
    for own in rotation:
        found = found * Rotation.from_quat(own)
    return found


def _shown(source: SourceMotion, keys: Bools) -> tuple[Floats, Floats]:
    """What all rotations show, stored coarsely: each for itself, and aiming at the world."""
    clips = _stacked(source)
    keyed = KeyedTracks(clips, Packing.EXT)
    axes = keyed.on([(0, [SharedAxis(keys, (0, 1, 2, 3))])])
    local, aimed = clips.local[1].copy(), clips.local[1].copy()
    for made in keyed.each(ROTATION, axes, COARSE):
        local[:, clips.row[made.tracks], 0] = made.shown
    found = list(ParentCompensation(ARM.skeleton, clips, keyed).follow(axes, COARSE, aimed, ONE))
    assert sorted(i for made in found for i in made.tracks.tolist()) == [0, 1, 2, 3]
    assert all((aimed[:, clips.row[made.tracks], 0] == made.shown).all() for made in found)
    return _shown_by_node(clips, local[:, :, 0], 0), _shown_by_node(clips, aimed[:, :, 0], 0)


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
    clips = _stacked(source)
    keyed = KeyedTracks(clips, Packing.CORE)
    axes = keyed.on([(0, [SharedAxis(EVERY_KEY, (0, 2, 3))])])
    rotation = clips.local[1].copy()
    rotation[:, 1] = np.array([0.0, 0, 0, 1])[:, None, None]
    for _ in ParentCompensation(ARM.skeleton, clips, keyed).follow(axes, np.zeros(4), rotation, ONE):
        pass
    shown = _shown_by_node(clips, rotation[:, :, 0], 0)
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
        sizes.append(a.shape[0])
        return multiply(a, b)

    multiply = quaternion.multiply
    monkeypatch.setattr(quaternion, "multiply", called)
    clips = StackedClips(chain.skeleton, [source], tip)
    keyed = KeyedTracks(clips, Packing.CORE)
    compensation = ParentCompensation(chain.skeleton, clips, keyed)
    assert sizes == [1, 1]
    axes = keyed.on([(0, [SharedAxis(EVERY_KEY, (0,))])])
    (found,) = compensation.follow(axes, np.array([1e-3]), clips.local[1].copy(), ONE)
    assert found.tracks.tolist() == [0]
    assert len(sizes) <= 6


@pytest.mark.parametrize("packing", [Packing.CORE, Packing.EXT])
def test_clips_together_have_the_keys_of_each_alone(packing: Packing) -> None:
    """Clips of other lengths and other tracks, one of them not asked for, and one with a track on no axis."""
    short = np.linspace(0, 0.7, 8)
    others = (
        clip(*(track("rotation", short, turning(0.9, (1, i, 0), short), node=i) for i in (3, 1))),
        clip(track("rotation", np.linspace(0, 3, 40), turning(1.2, times=np.linspace(0, 3, 40)), node=2)),
    )
    what = (BENDS, *others)
    masks = [np.ones(len(truth_of(ARM, each, TIP).grid), np.bool_) for each in what]
    masks[0][1::2] = False
    members = ((0, 1, 3), (0, 1), (0,))
    clips = _stacked(*(truth_of(ARM, each, TIP) for each in what))
    keyed = KeyedTracks(clips, packing)
    axes = keyed.on([(b, [SharedAxis(masks[b], members[b])]) for b in (0, 1)])
    some, tolerances = np.array([0, 1]), np.full(len(clips.clip), 1e-2)
    shown = np.take(clips.local[1], some, axis=2)
    follow = ParentCompensation(ARM.skeleton, clips, keyed).follow
    stored = {
        i: keys
        for made in follow(axes, tolerances, shown, some)
        for i, keys in zip(made.tracks.tolist(), made.stored, strict=True)
    }
    assert sorted(stored) == [0, 1, 3, 4, 5]
    for b in (0, 1):
        alone = _stacked(truth_of(ARM, what[b], TIP))
        own = KeyedTracks(alone, packing)
        rotation = alone.local[1].copy()
        there = own.on([(0, [SharedAxis(masks[b], members[b])])])
        for made in ParentCompensation(ARM.skeleton, alone, own).follow(there, tolerances, rotation, ONE):
            for i, keys in zip(made.tracks.tolist(), made.stored, strict=True):
                np.testing.assert_array_equal(stored[int(clips.first_track[b]) + i].values, keys.values)
        expected = _shown_by_node(alone, rotation[:, :, 0], 0)
        assert _shown_by_node(clips, shown[:, :, b], b) == pytest.approx(expected, abs=1e-12)

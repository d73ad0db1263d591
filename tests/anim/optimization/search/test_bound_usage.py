"""Bound usage against plain loops: what is shown, point by point and moment by moment."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Scene
from anim.optimization.options import Bounds
from anim.optimization.search import bound_usage
from anim.optimization.search.bound_usage import MIN_INTERVAL_S, MIN_ROUNDINGS, BoundUsage
from anim.optimization.search.playback import level_world_matrices
from anim.optimization.search.source_motion import PATHS, SourceMotion
from anim.optimization.search.stacked_clips import StackedClips
from tests.anim.measure.error.brute_force import points_on_a_node
from tests.anim.optimization.making import TIMES, nodding, truth_of, waving
from tests.anim.optimization.search.stacks import CLIPS, OF, POINTS, stack
from tests.calls import count_calls
from tests.clips import clip, skeleton, track

ALLOWED = np.random.default_rng(11).uniform(0.5, 2, (len(POINTS), len(CLIPS)))
LEVELS = OF.skeleton.levels()
EVERY = np.arange(len(CLIPS))
SPEED = Bounds(0.1, 0.0, max_speed_error=0.3)
SINGLE = 4 / MIN_ROUNDINGS  # of the bound: rounding of positions in float32
ANGLE = Bounds(0.1, 0.0, max_angle=math.radians(0.5))


def _changed(source: SourceMotion, seed: int) -> list[Floats]:
    """The truth (N, W, C) with every moving track a little off; rotations nearly of unit length, as stored ones."""
    rng = np.random.default_rng(seed)
    shown = [part.copy() for part in source.local]
    for each in source.moving:
        part = shown[PATHS.index(each.path)]
        part[each.node] += 0.01 * rng.normal(size=part[each.node].shape)
        if each.path == "rotation":
            part[each.node] = quaternion.normalize(part[each.node]) * rng.uniform(1, 1 + 5e-5, (len(source.at), 1))
    return shown


def _stacked(clips: StackedClips, changed: list[list[Floats]]) -> list[Floats]:
    """What is shown of clips (N, W', C) as components of the nodes with tracks (C, M, b, W)."""
    length = clips.at.shape[1]
    every = []
    for path in range(3):
        parts = [each[path][clips.moving] for each in changed]
        padded = [np.concatenate((part, np.repeat(part[:, -1:], length - part.shape[1], 1)), 1) for part in parts]
        every.append(np.moveaxis(np.stack(padded), (0, 1, 2, 3), (2, 1, 3, 0)))
    return every


def _moves(source: SourceMotion, shown: list[Floats]) -> Floats:
    """How far each point is from where it should be, (P, W, 3)."""
    return POINTS.places(level_world_matrices(OF.skeleton, shown, LEVELS)) - POINTS.places(
        level_world_matrices(OF.skeleton, source.local, LEVELS)
    )


def _truths() -> list[SourceMotion]:
    return [truth_of(OF, each, POINTS) for each in CLIPS]


def test_the_largest_distance_of_each_point() -> None:
    """Of clips of all lengths: repeated times change nothing."""
    changed = [_changed(source, b) for b, source in enumerate(_truths())]
    clips = stack(*CLIPS)
    usage = BoundUsage(OF.skeleton, clips, ALLOWED, Bounds(0.1, 0.0))
    found = usage.slerp_raw(_stacked(clips, changed), EVERY)
    assert found.shape == ALLOWED.shape
    for b, source in enumerate(_truths()):
        expected = np.linalg.norm(_moves(source, changed[b]), axis=2).max(axis=1) / ALLOWED[:, b]
        assert found[:, b] == pytest.approx(expected, rel=1e-5, abs=SINGLE)
    assert usage.slerp_raw(clips.local, EVERY).max() < SINGLE


def test_speeds_count_where_they_are_bounded() -> None:
    changed = [_changed(source, b) for b, source in enumerate(_truths())]
    clips = stack(*CLIPS)
    found = BoundUsage(OF.skeleton, clips, ALLOWED, SPEED).slerp_raw(_stacked(clips, changed), EVERY)
    for b, source in enumerate(_truths()):
        moves = _moves(source, changed[b])
        gaps = np.maximum(np.diff(source.at), MIN_INTERVAL_S)
        speeds = np.linalg.norm(np.diff(moves, axis=1), axis=2) / gaps
        expected = np.maximum(np.linalg.norm(moves, axis=2).max(axis=1) / ALLOWED[:, b], speeds.max(axis=1) / 0.3)
        assert found[:, b] == pytest.approx(expected, rel=1e-4)


def test_a_bound_on_speeds_that_float32_does_not_hold() -> None:
    changed = [_changed(source, b) for b, source in enumerate(_truths())]
    clips = stack(*CLIPS)
    bounds = (replace(SPEED, max_speed_error=each) for each in (1e-20, 1e-200))
    small, least = (
        BoundUsage(OF.skeleton, clips, ALLOWED, each).slerp_raw(_stacked(clips, changed), EVERY) for each in bounds
    )
    assert least == pytest.approx(1e180 * small, rel=1e-5)


def test_angles_of_ancestors_add_up() -> None:
    """Each rotation counts with those above it, and with the largest sum below it, by scipy and loops."""
    changed = [_changed(source, b) for b, source in enumerate(_truths())]
    clips = stack(*CLIPS)
    found = BoundUsage(OF.skeleton, clips, ALLOWED, ANGLE).own(_stacked(clips, changed), EVERY)
    assert ANGLE.max_angle is not None
    carrying = {node for level in clips.levels for node in level.tolist()}
    for b, source in enumerate(_truths()):
        turned = [
            (Rotation.from_quat(a) * Rotation.from_quat(t).inv()).magnitude().max()
            for a, t in zip(changed[b][1], source.local[1], strict=True)
        ]
        above = [[node] for node in range(len(OF.skeleton))]
        for chain in above:
            while (parent := int(OF.skeleton.parents[chain[-1]])) >= 0:
                chain.append(parent)
        sums = [sum(turned[node] for node in chain) for chain in above]
        for g, each in enumerate(source.moving):
            below = [sums[node] for node in carrying if each.node in above[node]]
            expected = max(below) / ANGLE.max_angle if each.path == "rotation" else 0.0
            assert found[b][g] == pytest.approx(expected, rel=1e-4, abs=1e-12)


@pytest.mark.parametrize("bounds", [Bounds(0.1, 0.0), SPEED, ANGLE])
@pytest.mark.parametrize("some", [[0], [1], [2], [0, 2], [1, 2]])
def test_padding_and_other_clips_change_no_usage(some: list[int], bounds: Bounds) -> None:
    """Of some of the clips in the stack, and of each in a stack of its own."""
    changed = [_changed(source, b) for b, source in enumerate(_truths())]
    clips = stack(*CLIPS)
    usage = BoundUsage(OF.skeleton, clips, ALLOWED, bounds)
    shown = [part[:, :, some] for part in _stacked(clips, changed)]
    found = [play(shown, np.array(some)) for play in (usage.slerp_raw, usage.nlerp)]
    own = usage.own(shown, np.array(some))
    for n, b in enumerate(some):
        single = stack(CLIPS[b])
        alone = BoundUsage(OF.skeleton, single, ALLOWED[:, b : b + 1], bounds)
        there, one = _stacked(single, [changed[b]]), np.array([0])
        for each, play in zip(found, (alone.slerp_raw, alone.nlerp), strict=True):
            assert each[:, n] == pytest.approx(play(there, one)[:, 0], rel=1e-5, abs=SINGLE)
        assert own[n] == pytest.approx(alone.own(there, one)[0], rel=1e-12)
        assert own[n].any() == (bounds is ANGLE)


def test_clips_with_wide_bounds_are_measured_in_float32(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each by its own bounds: narrow ones need float64, in which the same error is found."""
    changed = [_changed(source, b) for b, source in enumerate(_truths())]
    clips = stack(*CLIPS)
    shown, far = _stacked(clips, changed), ALLOWED * [1, 1e-5, 1]
    mixed = BoundUsage(OF.skeleton, clips, far, Bounds(0.1, 0.0)).slerp_raw(shown, EVERY)
    monkeypatch.setattr(bound_usage, "MIN_ROUNDINGS", np.inf)
    exact = BoundUsage(OF.skeleton, clips, far, Bounds(0.1, 0.0)).slerp_raw(shown, EVERY)
    assert mixed == pytest.approx(exact, rel=1e-5, abs=SINGLE)
    assert (mixed != exact).any(axis=0).tolist() == [True, False, True]


def test_parents_far_away_need_float64_though_points_are_near() -> None:
    """A root goes a million metres there and back, and its child the other way: float32 worlds are off by some cm."""
    far = np.outer(np.sin(TIMES), [1e6, 0, 0])
    away = clip(track("translation", TIMES, far, node=0), track("translation", TIMES, 0.3 - far, node=1))
    (shown,) = points_on_a_node([[0, 0, 0], [1, 0, 0]]).instances
    clips = stack(away, of=Scene(skeleton([-1, 0]), (replace(shown, node=1),)))
    allowed = np.full((len(clips.points), 1), 0.01)
    usage = BoundUsage(skeleton([-1, 0]), clips, allowed, Bounds(0.01, 0.0))
    assert usage.slerp_raw(clips.local, np.array([0])).max() < 1e-3


@pytest.mark.parametrize("length", [1, 2, 7])
def test_blocks_of_times_give_the_same(length: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Long clips are measured block by block, so that memory does not follow their length; speeds cross its ends."""
    changed = [_changed(source, b) for b, source in enumerate(_truths())]
    clips = stack(*CLIPS)
    shown, some = [part[:, :, 1:] for part in _stacked(clips, changed)], np.array([1, 2])
    whole = BoundUsage(OF.skeleton, clips, ALLOWED, SPEED)
    expected = [whole.slerp_raw(shown, some), whole.nlerp(shown, some)]
    monkeypatch.setattr(bound_usage, "MAX_BLOCK_MATRICES", 2 * length * len(OF.skeleton))
    monkeypatch.setattr(bound_usage, "MIN_BLOCK_TIMES", 1)
    blocks = BoundUsage(OF.skeleton, clips, ALLOWED, SPEED)
    counted = count_calls(monkeypatch, BoundUsage, "_usage_over")
    found = [blocks.slerp_raw(shown, some), blocks.nlerp(shown, some)]
    assert len(counted) == 2 * -(-clips.at.shape[1] // max(length, 2)) > 2
    for a, b in zip(found, expected, strict=True):
        assert a == pytest.approx(b, rel=1e-4)


def test_component_wise_players_are_compared_with_the_source_as_they_show_it() -> None:
    """The source's own chords leave no error there, and on the arc they do."""
    what = (nodding(), nodding(times=np.linspace(0, 2, 13)))
    clips = stack(*what)
    usage = BoundUsage(OF.skeleton, clips, np.ones((len(POINTS), 2)), Bounds(0.1, 0.0))
    chords = []
    for truth in (truth_of(OF, each, POINTS) for each in what):
        assert truth.chords is not None
        chords.append([truth.local[0], truth.chords, truth.local[2]])
    shown = _stacked(clips, chords)
    assert usage.nlerp(shown, np.arange(2)).max() < 1e-6
    assert usage.slerp_raw(shown, np.arange(2)).max(axis=0).min() > 1e-4


def test_without_a_bound_on_angles_tracks_have_no_usage_of_their_own() -> None:
    clips = stack(waving())
    usage = BoundUsage(OF.skeleton, clips, ALLOWED[:, :1], Bounds(0.1, 0.0))
    (own,) = usage.own(_stacked(clips, [_changed(truth_of(OF, waving(), POINTS), 0)]), np.array([0]))
    assert own.tolist() == [0] * 5

"""By how much displacements rise between times, and what a second look makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.continuous_bound.influence_radius import influence_radius, join_reaches
from anim.measure.continuous_bound.interval_rise import ClipTimes, IntervalRise, interval_rise, prepare_versions
from anim.measure.continuous_bound.refinement import refine
from anim.measure.continuous_bound.subintervals import OpenIntervals, join_intervals, subdivide
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip, Scene
from tests.anim.measure.continuous_bound.making import apart, pair
from tests.anim.skinning.scenes import mesh, random_scene, scene
from tests.clips import CUBICSPLINE, LINEAR, about, clip, track

RADIUS = 2.0  # m
POINT = scene(mesh([[RADIUS, 0, 0]], [[0]], [[1.0]]), [-1])
HELD = clip(track("rotation", [0], about("z", [0])))


def _turning(degrees: float, end: float = 1.0) -> Clip:
    return clip(track("rotation", [0, end], about("z", [0, degrees])))


def _rises(of: Scene, before: Clip, after: Clip, times: Floats, player: str = "spec") -> IntervalRise:
    ruler = ErrorMetric(of)
    reaches = [each for each in map(influence_radius, ruler.parts) if each is not None]
    return interval_rise([ClipTimes(prepare_versions((of, of), (before, after)), times)], reaches, [player])


def test_a_turn_away_from_rest_rises_by_its_sagitta() -> None:
    """h²/8 · ω²r, of a small turn: what an arc is above its chord, to first order."""
    times = np.array([0.0, 0.01, 0.03])
    found = _rises(POINT, HELD, _turning(30), times)
    speed = np.radians(30)
    assert found.rise[0] == pytest.approx(np.diff(times) ** 2 / 8 * speed**2 * RADIUS, rel=0.02)
    assert found.jump.max() < 1e-12


def test_of_two_turns_only_the_difference_rises() -> None:
    """However fast both are: ω₂² − ω₁², and ω² times what is between them already."""
    times = np.array([0.0, 0.01])
    found = _rises(POINT, _turning(150, 0.25), _turning(150.01, 0.25), times)
    speeds = np.radians([600, 600.04])
    least = 1e-4 / 8 * RADIUS * (speeds[1] ** 2 - speeds[0] ** 2)
    assert least <= found.rise[0, 0] <= 1.5 * least


def test_a_matrix_above_widens_as_a_scale_does() -> None:
    """A root that no translation, rotation and scale give: by the largest of its stretches, twice here."""
    times = np.array([0.0, 0.01, 0.03])
    point = scene(mesh([[RADIUS, 0, 0]], [[1]], [[1.0]]), [-1, 0])
    matrix = np.array([[[0, 2, 0, 5], [0.5, 0, 0, 0], [0, 0, 1, 0]]], float)
    skewed = replace(point, skeleton=replace(point.skeleton, sheared=np.array([0]), sheared_local=matrix))
    turning = clip(track("rotation", [0, 1], about("z", [0, 30]), node=1))
    plain, widened = (_rises(each, clip(), turning, times).rise for each in (point, skewed))
    assert plain.max() > 0
    assert widened == pytest.approx(2 * plain)


def test_lines_do_not_rise() -> None:
    a, b = (clip(track("translation", [0, 1], np.array([[0, 0, 0], [x, 1, 0]]))) for x in (1.0, 1.1))
    assert not _rises(POINT, a, b, np.array([0.0, 1.0])).rise.any()


def test_what_has_no_bound_is_infinite() -> None:
    """A cubic through zero has no direction there."""
    still, keys = np.zeros((2, 4)), np.array([[0, 0, 0, 1.0], [0, 0, 0, -1.0]])
    through = clip(track("rotation", [0, 1], keys, CUBICSPLINE, tangents=(still, still)))
    assert np.isinf(_rises(POINT, HELD, through, np.array([0.0, 0.9, 1.0])).rise).any()


@pytest.mark.parametrize("player", ["spec", "three", "raw", "nlerp"])
def test_every_stretch_keeps_its_own_bound(player: str) -> None:
    of, before, after = pair(3, modes=(LINEAR,), wild=(0.3,))
    times = np.unique(np.concatenate([np.linspace(0, 1, 60), before.key_times, after.key_times]))
    ruler = ErrorMetric(of)
    found = _rises(of, before, after, times, player)
    limits = np.concatenate(ruler.sample_errors(before, after, times, players=(player,)).limits[player])
    tops = (np.maximum(limits[:, :-1], limits[:, 1:] + found.jump) + found.rise).max(axis=0)
    for share in (0.2, 0.5, 0.8, 1 - 1e-12):
        for i in range(0, len(tops), 7):
            at = np.array([times[i] + share * (times[i + 1] - times[i])])
            assert apart(of, before, after, at, player) <= tops[i] * (1 + 1e-7)


def test_cuts_by_hand() -> None:
    """Two parts of the first stretch for both groups, three of the last for the second one."""
    asked = np.array([[True, False, False], [True, False, True]])
    rise = np.array([[4.0, 1, 9], [8, 1, 18]])
    found = subdivide("spec", join_intervals([np.array([0.0, 1, 2, 5])]), rise, asked, np.array([2, 9, 3]))
    assert found.times.tolist() == [0, 0.5, np.nextafter(1, 0), 2, 3, 4, np.nextafter(5, 2)]
    assert np.array_equal(found.more[0], [1, 1, 1, *[np.nan] * 4], equal_nan=True)
    assert found.more[1].tolist() == [2, 2, 2, 2, 2, 2, 2]
    assert found.some(-3, 2).times.tolist() == [0, 0.5]


def test_ends_far_below_the_target_are_not_sampled_again() -> None:
    """A rise of 8 above 1 at the start and 6 at the end: by 2 in two parts, by 8/9 in three."""
    ends = np.array([[1.0, 0]]), np.array([[6.0, 0]])
    intervals = OpenIntervals("spec", ends, np.array([[8.0, 9]]), np.array([[True, False]]))
    assert intervals.margin(7.0, 0.5).tolist() == [[1.0, 7.0]]
    assert intervals.num_parts(intervals.margin(7.0, 0.5)).tolist() == [3, 1]
    assert intervals.num_parts(0.5).tolist() == [4, 1]
    found, bound = intervals.subdivide(join_intervals([np.array([0.0, 6, 7])]), np.array([3, 1]), 7.0)
    assert found.times.tolist() == [2, 4]
    assert bound == pytest.approx([6 + 8 / 9, 0])
    found, bound = intervals.subdivide(join_intervals([np.array([0.0, 6, 7])]), np.array([2, 1]), 7.0)
    assert found.times.tolist() == [3, np.nextafter(6, 0)]
    assert bound == pytest.approx([1 + 8 / 4, 0])


def test_intervals_above_the_target_stay_open_until_they_are_fine() -> None:
    ends, rise = (np.zeros((2, 3)), np.zeros((2, 3))), np.full((2, 3), 4.0)
    intervals = OpenIntervals("spec", ends, rise, np.array([[True, False, True], [True, False, False]]))
    asked, _ = intervals.subdivide(join_intervals([np.array([0.0, 1, 2, 3])]), np.array([2, 2, 2]), 0.5)
    asked.tops[:] = asked.more + np.array([[0, 1, 0, 0, 0, 2], [0, 0, 0, 9, 9, 9]])  # 9 where no bound is asked for
    found = intervals.close(asked, np.full(3, 1.5), np.array([True, True, False]))
    assert found.tolist() == [1.0, 0.0, 3.0]
    assert intervals.is_open.tolist() == [[True, False, False], [False, False, False]]


@pytest.mark.parametrize("length", [1, 2, 1000])
def test_a_second_look(monkeypatch: pytest.MonkeyPatch, length: int) -> None:
    """Half-way through a swing that both ends don't show, by the player that shows it; in chunks of any length."""
    away = clip(track("translation", [0, 1, 2], np.array([[0, 0, 0], [0, 0.3, 0], [0, 0, 0]])))
    ruler = ErrorMetric(POINT)
    monkeypatch.setattr(ErrorMetric, "length", length)
    asked = [
        subdivide(
            player, join_intervals([np.array([0.0, 2.0])]), np.array([[0.4]]), np.array([[True]]), np.array([parts])
        )
        for player, parts in (("nlerp", 1), ("spec", 2))
    ]
    (seen,) = refine(ruler, [(HELD, away)], asked, ruler.parts, target=np.array([0.05]))
    assert (seen.player, seen.time) == ("spec", 1.0)
    assert seen.largest == pytest.approx(0.3)
    assert max(np.nanmax(each.tops) for each in asked) == pytest.approx(max(0.3 + 0.4 / 4, 0.4))


def test_arms_reach_every_vertex() -> None:
    of = random_scene(5, joints=6, vertices=80)
    (part,) = ErrorMetric(of).parts
    found = influence_radius(part)
    assert found is not None
    (instance,) = of.instances
    assert instance.skin is not None
    for node, arm in zip(found.nodes, found.arms, strict=True):
        carried = instance.mesh.positions[((instance.mesh.joints == node) & (instance.mesh.weights > 0)).any(axis=1)]
        bind = instance.skin.inverse_bind[node]
        assert arm == pytest.approx(np.linalg.norm(carried @ bind[:, :3].T + bind[:, 3], axis=1).max())
    assert not found.apart.any()
    two = join_reaches([found, found])
    assert len(two.nodes) == 2 * len(found.nodes)
    assert [each.tolist() for each in two.groups[len(found.groups) :]] == [
        (each + len(found.nodes)).tolist() for each in found.groups
    ]


def test_shells_reach_as_far_as_their_points() -> None:
    of = ErrorMetric(Scene(POINT.skeleton, POINT.instances), shell=0.01)
    found = [each for each in map(influence_radius, of.parts) if each is not None]
    assert [each.arms.tolist() for each in found[1:]] == [[pytest.approx(0.01 * of.diagonal)] * len(found[1].nodes)]


def test_morphed_points_rise_with_their_targets() -> None:
    """A point on the joint that a target carries 10 m away is displaced by a turn there, not where it rests."""
    of = scene(mesh([[0.1, 0, 0]], [[0]], [[1.0]], targets=[[[10.0, 0, 0]]]), [-1])
    weights = track("weights", [0, 1], [[0.9], [1.0]], node=1)
    times = np.array([0.0, 0.01])
    found = _rises(of, clip(*HELD.tracks, weights), clip(*_turning(30).tracks, weights), times)
    assert found.rise[0, 0] >= 1e-4 / 8 * np.radians(30) ** 2 * 9.1
    assert found.rise[0, 0] <= 1.3 * 1e-4 / 8 * np.radians(30) ** 2 * 10.1

"""What a clip truly does, against chains of plain matrices, and how far a change can carry a point."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Scene
from anim.optimization.options import Reference
from anim.optimization.search.answering_points import AnsweringPoints
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.optimization.search.source_analysis import FreeTracks, analyze_sources
from anim.optimization.search.source_motion import PATHS, key_grid, measurement_times
from anim.sampling import sample_pose, world_matrices
from tests.anim.optimization.making import every_point, nodding, scene, stepping, truth_of, turning, waving
from tests.clips import CUBICSPLINE, STEP, about, clip, skeleton, track

RNG = np.random.default_rng(2)
NO_TANGENTS = (np.zeros((2, 3)), np.zeros((2, 3)))


def test_keys_may_lie_on_every_key_and_within_splines() -> None:
    line = track("translation", [0, 0.125, 1], np.zeros((3, 3)))
    assert key_grid([line]).tolist() == line.times.tolist()
    spline = track("scale", [0.5, 1.5], np.ones((2, 3)), CUBICSPLINE, tangents=NO_TANGENTS)
    grid = key_grid([line, spline])
    assert set(line.times) | set(spline.times) <= set(grid)
    assert np.diff(grid[(grid >= 0.5) & (grid <= 1.5)]).max() <= 1 / 60 + 1e-6
    assert (grid.astype(np.float32) == grid).all()
    assert key_grid([]).tolist() == [0]


def test_moments_lie_on_keys_between_them_and_before_jumps() -> None:
    steps = track("translation", [0, 0.25, 2], np.zeros((3, 3)), STEP)
    at = measurement_times(np.array([0.0, 1, 2]), [steps])
    assert at.tolist() == [0, np.nextafter(0.25, 0), 0.25, 0.5, 1, 1.5, 2]


def test_levels_hold_what_points_hang_on_and_no_more() -> None:
    nodes = skeleton([-1, 0, 1, 1, -1, 4])
    assert [level.tolist() for level in required_levels(nodes, np.array([3]))] == [[0], [1], [3]]
    assert [level.tolist() for level in required_levels(nodes, np.array([5, 0]))] == [[0, 4], [5], []]


def _chained(of: Scene, node: int, local: tuple[Floats, Floats, Floats], frame: int) -> Floats:
    """world_from_node (4, 4) as a product of matrices, turns as stored: their length scales, as in players."""
    translation, rotation, scale = (part[node, frame] for part in local)
    x, y, z, w = rotation
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + 2 * (w * cross + cross @ cross)
    own = np.eye(4)
    own[:3, :3], own[:3, 3] = turn * scale, translation
    parent = int(of.skeleton.parents[node])
    return own if parent < 0 else np.asarray(_chained(of, parent, local, frame) @ own)


def test_worlds_are_products_of_matrices_with_turns_as_stored() -> None:
    of = scene(scale_shear=0.3)
    count = len(of.skeleton)
    local = (RNG.normal(size=(count, 3, 3)), 1.01 * quaternion.normalize(RNG.normal(size=(count, 3, 4))),
             RNG.uniform(0.5, 2, (count, 3, 3)))  # fmt: skip
    found = level_world_matrices(of.skeleton, local, of.skeleton.levels())
    for node in range(count):
        for frame in range(3):
            assert found[node, frame] == pytest.approx(_chained(of, node, local, frame)[:3], abs=1e-9)


def test_worlds_are_the_sampled_pose() -> None:
    """Of nodes that carry points, and of all above them."""
    of, what = scene(), waving()
    points = every_point(of)
    source = truth_of(of, what, points)
    assert (source.at[source.on_grid] == source.grid).all()
    expected = world_matrices(of.skeleton, sample_pose(of.skeleton, what, source.at)).swapaxes(0, 1)
    needed = np.concatenate(required_levels(of.skeleton, points.nodes))
    assert source.world[needed] == pytest.approx(expected[needed], abs=1e-12)


def test_keys_only() -> None:
    source = truth_of(scene(), waving(), every_point(scene()), Reference.KEYS)
    assert (source.at == source.grid).all()


def test_rest_and_middle_are_off_by_what_they_say() -> None:
    of, what = scene(), waving()
    for each in truth_of(of, what, every_point(of)).moving:
        own = what.tracks[each.index]
        assert (each.node, each.path) == own.target
        rest = getattr(of.skeleton, each.path)[each.node]
        off = np.linalg.norm(each.values - rest, axis=1)
        if each.path == "rotation":
            off = np.minimum(off, np.linalg.norm(each.values + rest, axis=1))
            assert np.linalg.norm(each.middle) == pytest.approx(1)
        assert each.from_rest == pytest.approx(off.max() * each.meters, abs=1e-9)
        assert each.from_middle == pytest.approx(np.linalg.norm(each.values - each.middle, axis=1).max() * each.meters)
    held = truth_of(of, what, every_point(of)).moving[4]
    assert (held.from_middle, held.from_rest > 0) == (0, True)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("stretch", "slack"), [(0.0, 1.01), (0.2, 1.5)])
def test_no_change_of_a_track_carries_a_point_further_than_its_meters(seed: int, stretch: float, slack: float) -> None:
    """Each track, changed at random by a little: no answering vertex moves more than it says, but for shear."""
    of = scene(seed, scale_shear=stretch)
    what = waving()
    points = every_point(of)
    source = truth_of(of, what, points)
    rng = np.random.default_rng(seed)
    levels = required_levels(of.skeleton, points.nodes)
    before = points.places(level_world_matrices(of.skeleton, source.local, levels))
    for each in source.moving:
        local = tuple(part.copy() for part in source.local)
        change = 1e-4 * rng.normal(size=each.values.shape)
        changed = each.values + change
        if each.path == "rotation":
            changed = quaternion.normalize(changed)
            change = changed - each.values
        local[PATHS.index(each.path)][each.node] = changed
        after = points.places(level_world_matrices(of.skeleton, (local[0], local[1], local[2]), levels))
        moved = np.linalg.norm(after - before, axis=2)
        allowed = each.meters * np.linalg.norm(change, axis=1).max()
        assert source.answering.largest(moved.max(axis=1), [each.node])[0] <= slack * allowed
        assert moved.max() > 0.05 * allowed  # and it says no more than it must


def test_tracks_that_stay_have_no_chords() -> None:
    """Trials play them on the arc: chords of the source alone would count as an error of the free tracks."""
    of = scene()
    quarters = track("scale", [0, 0.25, 1], np.ones((3, 3)))
    both = clip(*(track("rotation", [0, 1], about("x", [0, 120]), node=i) for i in (1, 2)), quarters)
    points = every_point(of)
    answering = AnsweringPoints(points, of.skeleton.parents)
    (source,) = analyze_sources(
        of.skeleton, [FreeTracks(both, (1, 2), 1e-5)], points, answering, reference=Reference.CURVE
    )
    assert source.chords is not None
    assert np.abs(source.chords - source.local[1]).max(axis=(1, 2)).round(3).nonzero()[0].tolist() == [2]


def test_chords_are_asked_for_where_they_leave_the_arc() -> None:
    of = scene()
    points = every_point(of)
    for rotations, bent in ((turning(0.2), False), (about("z", [0, 90]), True)):
        times = np.linspace(0, 2, len(rotations))
        quarters = track("scale", [0, 0.5, 2], np.ones((3, 3)))
        source = truth_of(of, clip(track("rotation", times, rotations, node=1), quarters), points)
        assert (source.chords is not None) is bent
        if source.chords is not None:
            mixed = np.stack([np.interp(source.at, times, column) for column in rotations.T], axis=1)
            mixed /= np.linalg.norm(mixed, axis=1, keepdims=True)
            assert source.chords[1] == pytest.approx(mixed, abs=1e-12)
            assert np.abs(source.chords[1] - source.local[1][1]).max() > 0.001


@pytest.mark.parametrize("reference", list(Reference))
def test_clips_together_are_analyzed_as_each_alone(reference: Reference) -> None:
    """Of other durations, tracks and free tracks; one of them with chords."""
    of = scene(scale_shear=0.2)
    points = every_point(of)
    bent = clip(track("rotation", [0, 3.0], about("z", [0, 170]), node=1), *waving().tracks[2:], name="bent")
    clips = [nodding(), bent, clip(track("scale", [0.5], np.ones((1, 3)), node=2)), waving(), stepping()]
    asked = [FreeTracks(each, range(n % 2, len(each.tracks)), 1e-6) for n, each in enumerate(clips)]
    below, needed = (
        AnsweringPoints(points, of.skeleton.parents),
        np.concatenate(required_levels(of.skeleton, points.nodes)),
    )
    together = analyze_sources(of.skeleton, asked, points, below, reference=reference)
    for each, found in zip(asked, together, strict=True):
        (alone,) = analyze_sources(of.skeleton, [each], points, below, reference=reference)
        for name in ("grid", "at", "on_grid", "own", "chords"):
            np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))
        pairs = ((*each.local, each.world[needed]) for each in (found, alone))
        for one, other in zip(*pairs, strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-14)
        assert len(found.moving) == len(each.free)
        for mine, own in zip(found.moving, alone.moving, strict=True):
            assert (mine.index, mine.node, mine.path, mine.closure) == (own.index, own.node, own.path, own.closure)
            for name in ("values", "rest", "middle", "meters", "from_rest", "from_middle"):
                np.testing.assert_allclose(getattr(mine, name), getattr(own, name), rtol=1e-12, atol=1e-14)
    assert [each.chords is None for each in together].count(True) < len(together)

"""Clips side by side, against each of them as sampled by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.maths import quaternion
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.error.point_rows import stack_points
from anim.model import Clip, Scene
from anim.optimization.search import stacked_clips
from anim.optimization.search.source_motion import PATHS
from anim.optimization.search.stacked_clips import END_WEIGHT, StackedClips
from anim.sampling import sample_pose, world_matrices
from tests.anim.optimization.making import every_point, scene, truth_of, turning
from tests.anim.optimization.search.stacks import CLIPS, OF, POINTS, stack
from tests.clips import about, clip, skeleton, track


def _world(of: Scene, what: Clip, at: Floats) -> Floats:
    """World matrices (N, W, 3, 4) of the sampled pose."""
    return world_matrices(of.skeleton, sample_pose(of.skeleton, what, at)).swapaxes(0, 1)


def test_shorter_clips_repeat_their_last_time() -> None:
    stacked = stack(*CLIPS)
    lengths = [len(source.at) for source in stacked.sources]
    assert lengths[0] < lengths[1] < lengths[2] == stacked.at.shape[1]
    for b, source in enumerate(stacked.sources):
        count = len(source.at)
        assert (stacked.at[b, :count] == source.at).all()
        assert (stacked.at[b, count:] == source.at[-1]).all()
        assert (stacked.at[b, stacked.on_grid[b]] == stacked.grid[b]).all()
        assert (stacked.grid[b, : len(source.grid)] == source.grid).all()
        assert stacked.weights[b].tolist() == [END_WEIGHT, *[1.0] * (count - 2), END_WEIGHT] + [0] * (
            stacked.at.shape[1] - count
        )
        passed = [int((source.grid <= time).sum()) - 1 for time in stacked.at[b]]
        assert stacked.before[b].tolist() == passed


def test_tracks_follow_one_another() -> None:
    stacked = stack(*CLIPS)
    every = [(b, each) for b, what in enumerate(CLIPS) for each in what.tracks]
    assert stacked.first_track.tolist() == [0, 3, 8, 11]
    assert stacked.clip.tolist() == [b for b, _ in every]
    assert [(int(n), PATHS[p]) for n, p in zip(stacked.node, stacked.path, strict=True)] == [
        each.target for _, each in every
    ]


def test_values_are_padded_by_their_last() -> None:
    stacked = stack(*CLIPS)
    every = [each for source in stacked.sources for each in source.moving]
    for each, path, row, number in zip(every, stacked.path, stacked.row, stacked.clip, strict=True):
        found = stacked.local[path][:, row, number]
        count = len(each.values)
        assert (found[:, :count] == each.values.T).all()
        assert (found[:, count:] == each.values[-1][:, None]).all()
    known = np.concatenate((stacked.moving, stacked.varying, stacked.constant))
    for b, source in enumerate(stacked.sources):
        expected = np.moveaxis(source.local[1], 2, 0)[:, known]
        assert (stacked.rotation[:, known, b, : len(source.at)] == expected).all()


def test_columns_are_the_sampled_poses() -> None:
    stacked = stack(*CLIPS)
    for b, what in enumerate(CLIPS):
        expected = stack_points(_world(OF, what, stacked.at[b]), stacked.points.nodes)
        assert stacked.columns[:, :, b].reshape(expected.shape) == pytest.approx(expected, abs=1e-12)


def test_points_of_nodes_that_move_with_their_parents_are_on_those() -> None:
    of = scene(scale_shear=0.3)
    what = clip(track("rotation", [0, 1, 2], about("y", [0, 60, 90]), node=1))
    points = every_point(of)
    stacked = stack(what, of=of)
    assert set(stacked.points.nodes.tolist()) <= {0, 1} < set(points.nodes.tolist())
    world = _world(of, what, stacked.at[0])
    assert stacked.points.places(world) == pytest.approx(points.places(world), abs=1e-9)


def test_points_stay_on_nodes_that_move_in_any_clip() -> None:
    """Also on nodes that no clip moves, but two clips hold at different places."""
    turn = track("rotation", [0, 1], about("y", [0, 60]), node=1)
    clips = [clip(turn, track("translation", [0, 1], [[0, at, 0]] * 2, node=3)) for at in (1.0, 2.0)]
    free = [0]
    sources = [truth_of(OF, each, POINTS, free=free) for each in clips]
    alone, both = (StackedClips(OF.skeleton, some, POINTS) for some in (sources[:1], sources))
    assert set(both.points.nodes.tolist()) == {*alone.points.nodes.tolist(), 3}
    for b, what in enumerate(clips):
        world = _world(OF, what, both.at[b])
        assert both.points.places(world) == pytest.approx(POINTS.places(world), abs=1e-9)


def _by_chord(of: Scene, what: Clip, at: Floats) -> Floats:
    """World matrices (N, W, 3, 4) of a clip whose rotations are mixed by components between their keys."""
    shown = sample_pose(of.skeleton, what, at)
    rotation = shown.rotation.copy()
    for each in what.tracks:
        if each.path == "rotation":
            keys = quaternion.align_signs(each.values)
            mixed = np.stack([np.interp(at, each.times, column) for column in keys.T], axis=1)
            rotation[:, each.node] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return world_matrices(of.skeleton, replace(shown, rotation=rotation)).swapaxes(0, 1)


def test_chords_are_those_of_mixed_rotations_in_all_clips() -> None:
    """Of a clip with large steps, and of one that needs none beside it."""
    quarters = track("scale", [0, 0.25, 1], np.ones((3, 3)))
    bent = clip(track("rotation", [0, 1, 2.5], about("z", [0, 90, 200]), node=1), quarters)
    even = clip(track("rotation", np.linspace(0, 2, 100), turning(0.05, times=np.linspace(0, 2, 100)), node=2))
    stacked = stack(even, bent)
    assert stacked.by_chord is not stacked.columns
    for b, what in enumerate((even, bent)):
        expected = stack_points(_by_chord(OF, what, stacked.at[b]), stacked.points.nodes)
        assert stacked.by_chord[:, :, b].reshape(expected.shape) == pytest.approx(expected, abs=1e-6)
    assert np.abs(stacked.by_chord - stacked.columns)[:, :, 1].max() > 0.01


def test_chords_count_only_where_they_leave_the_arc() -> None:
    def both(rotations: Floats) -> bool:
        times = np.linspace(0, 2, len(rotations))
        stacked = stack(clip(track("rotation", times, rotations, node=1)))
        return stacked.by_chord is not stacked.columns

    assert not both(turning(0.2))
    assert both(about("z", [0, 90]))


def test_chords_are_normalized_mixes() -> None:
    """A point at x = 1, a quarter of the way through 120° in one step."""
    of = Scene(skeleton([-1]), ())
    points = PointMatrix(np.array([0]), np.array([[0]]), np.array([[[1.0, 0, 0, 1]]]))
    rotation = track("rotation", [0, 1], about("z", [0, 120]))
    quarters = track("scale", [0, 0.25, 1], np.ones((3, 3)))
    stacked = StackedClips(of.skeleton, [truth_of(of, clip(rotation, quarters), points)], points)
    x_axis = stacked.by_chord[0, :, 0].T
    quarter = int(np.searchsorted(stacked.at[0], 0.25))
    mix = 0.75 * about("z", 0) + 0.25 * about("z", 120)
    assert stacked.at[0, quarter] == 0.25
    assert x_axis[quarter] == pytest.approx(Rotation.from_quat(mix).as_matrix()[:, 0])
    assert stacked.columns[0, :, 0].T[quarter] == pytest.approx([np.cos(np.radians(30)), 0.5, 0])


@pytest.mark.parametrize("block", [1, 40, 1 << 20])
def test_nodes_that_stay_are_found_in_blocks(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = stack(*CLIPS)
    monkeypatch.setattr(stacked_clips, "BLOCK_VALUES", block)
    found = stack(*CLIPS)
    for name in ("constant", "varying", "constant_matrices"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    first = whole.sources[0].local
    for node in [*found.constant.tolist(), *found.varying.tolist()]:
        parts = [(part[node], first[i][node, 0]) for each in found.sources for i, part in enumerate(each.local)]
        assert (node in found.constant) == all((values == start).all() for values, start in parts)

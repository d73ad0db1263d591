"""Poses and world matrices against a plain recursion with 4×4 products."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.errors import AnimError, NotFoundError, RangeError, ShapeError
from anim.gltf.reading import reader
from anim.model import Clip, Skeleton, TimeAxis
from anim.sampling import lazy_batch, rest_pose, sample_pose, world_matrices
from anim.sampling.batch import Batch
from anim.sampling.clips import sample_world_matrices
from anim.sampling.lazy_batch import LazyBatch, lazy_batches
from anim.sampling.players import PLAYERS, sampler
from anim.sampling.pose import PoseSampler
from anim.sampling.track import KeyInterval, find_interval, sample
from fixtures.broken.pieces import text
from tests.clips import about, clip, skeleton, track
from tests.files import opened, opened_fixture

RNG = np.random.default_rng(5)


def test_what_no_track_moves_is_at_rest() -> None:
    nodes = skeleton([-1, 0], translation=[[1, 2, 3], [4, 5, 6]], scale=[[1, 1, 1], [2, 2, 2]])
    found = sample_pose(nodes, clip(track("translation", [0, 1], [[0, 0, 0], [2, 2, 2]], node=1)), np.array([0.5, 9.0]))
    assert found.translation.tolist() == [[[1, 2, 3], [1, 1, 1]], [[1, 2, 3], [2, 2, 2]]]
    assert found.scale.tolist() == [[[1, 1, 1], [2, 2, 2]]] * 2
    assert found.rotation.tolist() == [[[0, 0, 0, 1]] * 2] * 2
    assert found.times.tolist() == [0.5, 9.0]
    assert found.weights == {}


def test_every_track_lands_at_its_node_and_part() -> None:
    document = opened_fixture("interpolations")
    (walk,) = reader.clips(document)
    at = np.linspace(0, 2.5, 26)
    found = sample_pose(reader.skeleton(document), walk, at)
    for each in walk.tracks:
        assert each.node is not None
        part: Floats = getattr(found, each.path)
        np.testing.assert_array_equal(part[:, each.node], sample(each, at))


def test_weights_are_by_node() -> None:
    document = opened_fixture("morph_cube")
    for each in reader.clips(document):
        at = np.array([0.0, 0.25, 0.75])
        found = sample_pose(reader.skeleton(document), each, at)
        assert list(found.weights) == [each.tracks[0].node]
        np.testing.assert_array_equal(found.weights[0], sample(each.tracks[0], at))


def test_pointers_at_node_properties_move_the_node_and_others_nothing() -> None:
    document = opened_fixture("pointer")
    nodes, clips = reader.skeleton(document), {each.name: each for each in reader.clips(document)}
    at = np.array([0.0, 0.5])
    np.testing.assert_allclose(sample_pose(nodes, clips["turn"], at).rotation[1, 0], about("y", 90), atol=1e-7)
    assert list(sample_pose(nodes, clips["weights"], at).weights) == [0]
    for name in ("color", "blink", "light"):
        found = sample_pose(nodes, clips[name], at)
        np.testing.assert_array_equal(found.rotation, np.tile(nodes.rotation, (2, 1, 1)))


@pytest.mark.parametrize("name", ["biped", "interpolations", "arm"])
def test_world_matrices_of_clips(name: str) -> None:
    document = opened_fixture(name)
    nodes = reader.skeleton(document)
    for each in reader.clips(document):
        _check_world(nodes, each, np.linspace(each.start, each.end, 7))


@pytest.mark.parametrize("trial", range(5))
def test_world_matrices_of_random_forests(trial: int) -> None:
    """Parents in any order of numbers, uneven and mirroring scales."""
    n = 12
    order = RNG.permutation(n)
    parents = np.full(n, -1)
    for i in range(1, n):
        parents[order[i]] = order[RNG.integers(0, i)] if RNG.random() < 0.8 else -1
    rest_pose = {"translation": RNG.normal(size=(n, 3)), "scale": RNG.normal(size=(n, 3))}
    nodes = skeleton(parents.tolist(), rotation=_quaternions(n), **rest_pose)
    tracks = [track("rotation", [0, 1], _quaternions(2), node=i) for i in range(0, n, 2)]
    tracks += [track("translation", [0, 2], RNG.normal(size=(2, 3)), node=i) for i in range(0, n, 3)]
    _check_world(nodes, clip(*tracks), np.array([0.0, 0.3, 1.5]))


def test_a_sheared_matrix_stands_whole_in_the_chain() -> None:
    sheared = np.array([[1, 0.5, 0, 1], [0, 2, 0.25, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    nodes = [
        {"children": [1], "translation": [1, 0, 0], "rotation": about("z", 90).tolist()},
        {"children": [2], "matrix": sheared.T.ravel().tolist()},
        {"translation": [0, 1, 0], "scale": [2, 2, 2]},
    ]
    document = opened(text({"nodes": nodes}))
    found = world_matrices(reader.skeleton(document), rest_pose(reader.skeleton(document)))[0]
    turned = np.array([[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    child = np.array([[2, 0, 0, 0], [0, 2, 0, 1], [0, 0, 2, 0], [0, 0, 0, 1.0]])
    np.testing.assert_allclose(found[1], (turned @ sheared)[:3], atol=1e-15)
    np.testing.assert_allclose(found[2], (turned @ sheared @ child)[:3], atol=1e-15)


def test_no_nodes_and_no_times_are_fine() -> None:
    nothing = skeleton([])
    assert world_matrices(nothing, rest_pose(nothing)).shape == (1, 0, 3, 4)
    one = skeleton([-1])
    moved = clip(track("translation", [0], [[1, 2, 3]]))
    assert world_matrices(one, sample_pose(one, moved, np.empty(0))).shape == (0, 1, 3, 4)


def _check_world(nodes: Skeleton, moved: Clip, at: Floats) -> None:
    found = world_matrices(nodes, sample_pose(nodes, moved, at))
    for frame, t in enumerate(at):
        for node in range(len(nodes)):
            np.testing.assert_allclose(found[frame, node], _world(nodes, moved, node, float(t))[:3], atol=1e-12)


def _world(nodes: Skeleton, moved: Clip, node: int, t: float) -> Floats:
    """world_from_node as a 4×4 product from the root down, by scipy's rotations."""
    parts = {"translation": nodes.translation[node], "rotation": nodes.rotation[node], "scale": nodes.scale[node]}
    for each in moved.tracks:
        if each.node == node:
            parts[each.path] = sample(each, np.array([t]))[0]
    local = np.eye(4)
    local[:3, :3] = Rotation.from_quat(parts["rotation"]).as_matrix() @ np.diag(parts["scale"])
    local[:3, 3] = parts["translation"]
    parent = int(nodes.parents[node])
    return local if parent < 0 else np.asarray(_world(nodes, moved, parent, t) @ local)


def _quaternions(n: int) -> Floats:
    q = RNG.normal(size=(n, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


@pytest.mark.parametrize("name", ["interpolations", "biped", "morph_cube", "accessors"])
def test_stretches_of_time_are_the_whole(name: str) -> None:
    """Few keys are stacked for themselves, then all: the same bits, outside the keys too."""
    document = opened_fixture(name)
    skeleton = reader.skeleton(document)
    for played in reader.clips(document):
        times = np.linspace(played.start - 0.1, played.end + 0.1, 301)
        for player in PLAYERS:
            wanted = PoseSampler(skeleton, played, sampler(player)).at(times)
            stretch = PoseSampler(skeleton, played, sampler(player))
            for _ in range(2):
                for low in range(0, len(times), 7):
                    part = stretch.at(times[low : low + 7])
                    for field in ("translation", "rotation", "scale"):
                        assert np.array_equal(getattr(part, field), getattr(wanted, field)[low : low + 7])
                    for node, weights in wanted.weights.items():
                        assert np.array_equal(part.weights[node], weights[low : low + 7])


def _stacked(stack: LazyBatch, at: Floats) -> tuple[Batch, KeyInterval]:
    """The keys that a stack returns at times, and their intervals in these."""
    place = find_interval(stack.time_axis.times, at)
    batch, left, right = stack.at(place.left, place.right)
    return batch, place._replace(left=left, right=right)


def _two_lines(keys: int) -> LazyBatch:
    """Two translations that are equal to the time, with a key per second."""
    axis = TimeAxis(np.arange(keys))
    values = np.tile(axis.times[:, None], 3)
    (stack,) = lazy_batches([track("translation", axis, values, node=node) for node in (0, 1)])
    return stack


def test_keys_are_stacked_where_they_are_needed_and_all_in_the_end() -> None:
    stack = _two_lines(100)
    for low in range(0, 200, 10):
        at = np.linspace(low % 100 + 0.5, low % 100 + 3.5, 5)
        batch, place = _stacked(stack, at)
        assert len(batch.times) == 5
        assert batch.sample(at, place)[:, 1, 2].tolist() == at.tolist()
    seen = [len(_stacked(stack, np.array([low + 0.5]))[0].times) for low in range(60)]
    assert (seen[0], seen[-1]) == (2, 100)
    assert len(_stacked(_two_lines(100), np.arange(60.0))[0].times) == 100, "half of them at once"


def test_of_long_tracks_only_requested_keys_are_stacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lazy_batch, "MAX_STACKED_KEYS", 199)
    stack = _two_lines(100)
    for _ in range(3):
        for at, keys in ((np.linspace(0, 98.5, 198), 100), (np.linspace(20, 29.5, 9), 11), (np.array([3, 3.5, 90]), 4)):
            batch, place = _stacked(stack, at)
            assert len(batch.times) == keys
            assert batch.sample(at, place)[:, 1, 2].tolist() == at.tolist()
            assert batch.is_inside(at).all()
    assert PoseSampler(skeleton([-1, -1]), clip(*stack.tracks)).at(np.zeros(0)).translation.shape == (0, 2, 3)


def test_a_node_that_the_skeleton_lacks_is_refused() -> None:
    with pytest.raises(NotFoundError, match="there is no node 999"):
        sample_pose(skeleton([-1]), clip(track("scale", [0], [[1, 1, 1]], node=999)), np.zeros(1))


@pytest.mark.parametrize(
    ("at", "error"), [(np.array([np.nan]), RangeError), (0.5, ShapeError), (np.zeros((1, 2)), ShapeError)]
)
def test_times_that_are_none_are_refused(at: Any, error: type[AnimError]) -> None:
    moving = track("scale", [0, 1], [[1, 1, 1], [2, 2, 2]])
    with pytest.raises(error, match="times"):
        sample_pose(skeleton([-1]), clip(moving), at)
    with pytest.raises(error, match="times"):
        sample(moving, at)


def test_world_matrices_of_several_clips_are_those_of_their_poses() -> None:
    """Also of nodes without tracks, and with a sheared matrix."""
    nodes = replace(
        skeleton([-1, 0, 1, -1], translation=RNG.normal(size=(4, 3)), scale=RNG.uniform(0.5, 2, (4, 3))),
        sheared=np.array([3]),
        sheared_local=RNG.normal(size=(1, 3, 4)),
    )
    clips = [
        clip(track("rotation", [0, 1], about("x", [0, 90]), node=1)),
        clip(track("translation", [0, 1], RNG.normal(size=(2, 3)), node=2)),
    ]
    times = RNG.uniform(0, 1, (2, 5))
    found, _ = sample_world_matrices(nodes, clips, times)
    for each, at, world in zip(clips, times, np.split(found, 2, axis=1), strict=True):
        assert (world == np.swapaxes(world_matrices(nodes, sample_pose(nodes, each, at)), 0, 1)).all()

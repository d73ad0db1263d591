"""Searches on the moving nodes alone: the same points, and the same result, as on all nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.maths import quaternion
from anim.measure.error import reduced_skeleton
from anim.model import Clip, Mesh, MeshInstance, Scene, Skeleton, Skin
from anim.optimization.options import EFFORTS, Bounds
from anim.optimization.search.lockstep import SearchRequest
from anim.optimization.search.long_clips import search_all
from anim.optimization.search.reduced_context import reduce_context
from anim.sampling.pose import sample_pose
from anim.sampling.world import world_by_node
from tests.anim.optimization.making import scene, setting_of, turning, waving
from tests.clips import clip, track

NODES = 80
BOUND = 0.01  # m
TIMES = np.linspace(0, 2, 25)  # s


@pytest.fixture(autouse=True)
def _reduce_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reduced_skeleton, "MIN_NODES", 50)


def _mesh(random: np.random.Generator, name: str, joints: int) -> Mesh:
    weights = random.uniform(size=(6, 2)) + 0.1
    return Mesh(
        name,
        random.normal(size=(6, 3)),
        np.array([[0, 1, 2], [3, 4, 5]]),
        random.integers(0, joints, (6, 2)) if joints else np.empty((6, 0), np.int64),
        weights / weights.sum(axis=1, keepdims=True) if joints else np.empty((6, 0)),
        np.empty((0, 6, 3)),
        np.empty(0),
    )


def _scene(seed: int) -> Scene:
    """Branches, one of them sheared, with rigid meshes on some nodes, and a skin of moving and of static joints."""
    random = np.random.default_rng(seed)
    parents = np.array([-1, *(int(random.integers(max(i - 4, 0), i)) for i in range(1, NODES - 2)), -1, NODES - 2])
    skeleton = Skeleton(
        tuple(f"n{i}" for i in range(NODES)),
        parents,
        0.3 * random.normal(size=(NODES, 3)),
        quaternion.normalize(random.normal(size=(NODES, 4))),
        random.uniform(0.8, 1.2, (NODES, 3)),
        np.array([20]),
        np.eye(4)[None, :3] + 0.2 * random.normal(size=(1, 3, 4)),
    )
    skin = Skin(random.permutation(NODES)[:8], np.eye(4)[None, :3] + 0.3 * random.normal(size=(8, 3, 4)))
    rigid = [MeshInstance(i, _mesh(random, f"m{i}", 0), None, np.empty(0)) for i in range(2, NODES, 5)]
    return Scene(skeleton, (MeshInstance(1, _mesh(random, "body", 8), skin, np.empty(0)), *rigid))


def _clip() -> Clip:
    return clip(
        track("rotation", TIMES, turning(1.2, times=TIMES), node=2),
        track("rotation", TIMES, turning(-0.7, (1, 2, 0), TIMES), node=7),
        track("translation", TIMES, np.stack((np.sin(TIMES), TIMES, 0 * TIMES), axis=1), node=0),
        track("scale", TIMES, 1 + 0.1 * np.sin(TIMES)[:, None] * [1, 2, 1], node=40),
        track("rotation", TIMES, turning(0.5, times=TIMES), node=NODES - 1),
    )


def _request(what: Clip) -> SearchRequest:
    count = len(what.tracks)
    return SearchRequest(what, tuple(range(count)), BOUND, 0.0, np.ones(count, np.bool_), ((),) * count, frozenset())


@pytest.mark.parametrize("seed", range(4))
def test_points_are_moved_to_the_same_places(seed: int) -> None:
    of, what = _scene(seed), _clip()
    context = setting_of(of, (what,), bounds=Bounds(BOUND, 0.02))
    smaller, (request,) = reduce_context(context, [_request(what)])
    assert len(smaller.skeleton) < NODES / 4
    full, few = (
        each.points.places(world_by_node(each.skeleton, sample_pose(each.skeleton, played, TIMES)))
        for each, played in ((context, what), (smaller, request.clip))
    )
    np.testing.assert_allclose(few, full, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("effort", ["fast", "balanced"])
def test_the_search_finds_the_same_keys(seed: int, effort: str) -> None:
    what = _clip()
    context = setting_of(_scene(seed), (what,), bounds=Bounds(BOUND, 0.02), effort=effort)
    (all_nodes,) = search_all(context, [_request(what)], EFFORTS[effort])
    (few,) = search_all(*reduce_context(context, [_request(what)]), EFFORTS[effort])
    assert all_nodes is not None
    assert few is not None
    assert few.actions.tolist() == all_nodes.actions.tolist()
    assert {n: on.tolist() for n, on in few.on.items()} == {n: on.tolist() for n, on in all_nodes.on.items()}
    for n, keys in all_nodes.keys.items():
        np.testing.assert_allclose(few.keys[n].values, keys.values, atol=1e-6)


def test_scenes_that_mostly_move_or_have_morph_targets_stay() -> None:
    small = setting_of(scene(), (waving(),))
    assert reduce_context(small, [_request(waving())])[0] is small
    of = _scene(0)
    face = replace(_mesh(np.random.default_rng(0), "face", 0), targets=np.ones((1, 6, 3)), rest_weights=np.zeros(1))
    of = replace(of, instances=(*of.instances, MeshInstance(30, face, None, np.zeros(1))))
    morphed = setting_of(of, (_clip(),))
    assert reduce_context(morphed, [_request(_clip())])[0] is morphed

"""Searches on the moving nodes alone: the same points, and the same result, as on all nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.measure.error import reduced_skeleton
from anim.model import Clip, MeshInstance, Scene, Skin
from anim.optimization.options import EFFORTS, Bounds
from anim.optimization.search.lockstep import SearchRequest
from anim.optimization.search.long_clips import search_all
from anim.optimization.search.reduced_context import reduce_context
from anim.sampling.pose import sample_pose
from anim.sampling.world import world_by_node
from tests.anim.measure.error.branched_scenes import branches, mesh
from tests.anim.optimization.making import scene, setting_of, turning, waving
from tests.clips import clip, track

NODES = 80
BOUND = 0.01  # m
TIMES = np.linspace(0, 2, 25)  # s


@pytest.fixture(autouse=True)
def _reduce_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reduced_skeleton, "MIN_NODES", 50)


def _scene(seed: int) -> Scene:
    """Branches with rigid meshes on some nodes, and a skin of moving and of static joints."""
    random = np.random.default_rng(seed)
    skeleton = branches(random, NODES)
    skin = Skin(random.permutation(NODES)[:8], np.eye(4)[None, :3] + 0.3 * random.normal(size=(8, 3, 4)))
    rigid = [MeshInstance(i, mesh(random, f"m{i}", 0), None, np.empty(0)) for i in range(2, NODES, 5)]
    return Scene(skeleton, (MeshInstance(1, mesh(random, "body", 8), skin, np.empty(0)), *rigid))


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
    face = mesh(np.random.default_rng(0), "face", 0, targets=1)
    of = replace(of, instances=(*of.instances, MeshInstance(30, face, None, np.zeros(1))))
    morphed = setting_of(of, (_clip(),))
    assert reduce_context(morphed, [_request(_clip())])[0] is morphed

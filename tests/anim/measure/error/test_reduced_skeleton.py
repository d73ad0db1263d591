"""Errors on the moving nodes alone: the same as on all nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.maths import matrix, quaternion
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error import reduced_skeleton
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.point_groups import SkinnedGroups
from anim.measure.error.sample_times import dense_times
from anim.measure.error.statistics import statistics
from anim.model import Clip, MeshInstance, Scene, Skin
from anim.sampling.players import PLAYERS
from tests.anim.measure.error.branched_scenes import branches, mesh
from tests.clips import clip, track

NODES = 60
TIMES = np.array([0.0, 0.4, 1.0])


@pytest.fixture(autouse=True)
def _reduce_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reduced_skeleton, "MIN_NODES", 1)


def _scene(random: np.random.Generator, *, meshes: bool) -> Scene:
    skeleton = branches(random, NODES)
    if not meshes:
        return Scene(skeleton, ())
    skin = Skin(random.permutation(NODES)[:8], np.eye(4)[None, :3] + 0.3 * random.normal(size=(8, 3, 4)))
    rigid = [MeshInstance(i, mesh(random, f"m{i}", 0, 0), None, np.empty(0)) for i in range(2, NODES, 3)]
    return Scene(
        skeleton,
        (
            MeshInstance(1, mesh(random, "body", 8, 0), skin, np.empty(0)),
            MeshInstance(30, mesh(random, "face", 0, 2), None, np.zeros(2)),
            MeshInstance(31, mesh(random, "head", 8, 2), skin, np.array([0.3, 0])),
            *rigid,
        ),
    )


def _clips(random: np.random.Generator) -> tuple[Clip, Clip]:
    """A clip that moves a few nodes, and one with other keys for some of them."""
    start = quaternion.normalize(random.normal(size=(5, 4)))
    turns = [quaternion.normalize(one + 0.4 * random.normal(size=(3, 4))) for one in start]
    old = [track("rotation", TIMES, each, node=node) for node, each in zip((3, 9, 10, 25, 57), turns, strict=True)]
    old.append(track("translation", TIMES, random.normal(size=(3, 3)), node=9))
    old.append(track("weights", TIMES, random.uniform(size=(3, 2)), node=30))
    new = [*old]
    new[1] = track("rotation", TIMES, quaternion.normalize(turns[1] + 0.02), node=9)
    new[4] = track("rotation", TIMES[:2], turns[4][:2], node=57)
    new[6] = track("weights", TIMES, old[6].values + 0.1, node=30)
    return clip(*old), clip(*new)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("meshes", [True, False], ids=["meshes", "nodes"])
@pytest.mark.parametrize("other", ["same", "equal", "rest"])
def test_errors_of_reduced_skeletons(seed: int, meshes: bool, other: str) -> None:
    random = np.random.default_rng(seed)
    scene = _scene(random, meshes=meshes)
    moved = scene.skeleton.translation + np.where(np.arange(NODES) == 40, 0.1, 0)[:, None]
    another = {
        "same": scene,
        "equal": replace(scene, skeleton=replace(scene.skeleton)),
        "rest": replace(scene, skeleton=replace(scene.skeleton, translation=moved)),
    }[other]
    before, after = _clips(random)
    times = dense_times(before, after)
    whole = ErrorMetric(scene, another, shell=0.02)
    less = ErrorMetric(scene, another, shell=0.02, clips=(before, after))
    assert len(less.skeletons[0]) < NODES / 2 < len(whole.skeletons[0])
    for player in PLAYERS:
        expected, found = (each.error_at(before, after, times, player=player) for each in (whole, less))
        assert found.max_error == pytest.approx(expected.max_error, rel=2e-3)
        if other != "rest":  # which moves several by as much at all times
            assert (found.time, found.place, found.vertex) == (expected.time, expected.place, expected.vertex)
    proofs = [
        Prover(each).certified(before, after, times, each.sample_errors(before, after, times)) for each in (whole, less)
    ]
    assert all(proof.bound is not None and proof.bound >= proof.error.max_error for proof in proofs)
    assert (proofs[1].bound or 0) <= 1.02 * proofs[0].error.max_error
    one, two = (statistics(each, before, after) for each in (whole, less))
    assert two.mean == pytest.approx(one.mean, rel=1e-6)
    assert two.p99 == pytest.approx(one.p99, rel=1e-6)
    assert two.speed.size == pytest.approx(one.speed.size, rel=0.02)
    assert two.weight == one.weight
    assert (two.angle.size, two.angle.time) == pytest.approx((one.angle.size, one.angle.time))


def test_static_vertices_are_counted() -> None:
    random = np.random.default_rng(0)
    scene = _scene(random, meshes=True)
    before, after = _clips(random)
    found = ErrorMetric(scene, clips=(before, after))
    groups = sum(len(group) for part in found.parts for group in part.groups)
    assert found.num_static_points > 0
    assert groups + found.num_static_points == scene.vertex_count


@pytest.mark.parametrize("meshes", [True, False], ids=["meshes", "nodes"])
def test_rigid_points_are_moved_at_once(meshes: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not node by node: scenes without meshes have points around thousands."""
    random = np.random.default_rng(1)
    scene = _scene(random, meshes=meshes)
    calls = []
    whole = matrix.apply

    def counted(matrices: Floats, points: Floats) -> Floats:
        calls.append(len(matrices))
        return whole(matrices, points)

    monkeypatch.setattr(matrix, "apply", counted)
    ErrorMetric(scene, clips=_clips(random))
    assert len(calls) <= 3
    assert max(calls) > 5


def test_joints_on_one_moving_node_are_one() -> None:
    """A skin of thousands of joints, of which one moves, is measured at the cost of two."""
    random = np.random.default_rng(2)
    scene = _scene(random, meshes=True)
    before, after = clip(track("translation", TIMES, np.eye(3), node=0)), clip()
    (body,) = (part for part in ErrorMetric(scene, clips=(before, after)).parts if part.name == "body")
    assert isinstance(body, SkinnedGroups)
    assert len(body.surface.nodes) <= 2 < len(scene.instances[0].skin.joints)  # type: ignore[union-attr]


@pytest.mark.parametrize("width", [1, 2, 4])
def test_errors_of_skins_on_one_moving_node(width: int) -> None:
    """Also with one influence per vertex, where the surface is rigid then."""
    random = np.random.default_rng(3)
    weights = random.uniform(size=(5, width)) + 0.1
    body = replace(
        mesh(random, "body", 8, 0),
        joints=random.integers(0, 8, (5, width)),
        weights=weights / weights.sum(axis=1, keepdims=True),
    )
    skin = Skin(np.arange(8), np.eye(4)[None, :3] + 0.3 * random.normal(size=(8, 3, 4)))
    scene = Scene(branches(random, NODES), (MeshInstance(1, body, skin, np.empty(0)),))
    before, after = clip(track("translation", TIMES, np.eye(3), node=0)), clip()
    whole, less = ErrorMetric(scene), ErrorMetric(scene, clips=(before, after))
    for each in (whole, less):
        assert each.error(before, after).max_error == pytest.approx(whole.error(before, after).max_error, rel=1e-9)

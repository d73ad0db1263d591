"""The largest displacement against brute force: every vertex at every time, skinned one matrix at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf import read
from anim.gltf.document import Document
from anim.measure.error import NOISE, SLACK, MotionError, Ruler, check_times
from anim.measure.surface import diagonal
from anim.model import Clip, Instance, Mesh, Pose, Scene, Skin, Track
from anim.ops.resample import resample
from anim.sampling import pose, world_matrices
from tests.clips import STEP, about, clip, skeleton, track
from tests.files import opened_fixture, opened_path

Find = Callable[[str], Path]

NOTHING = np.empty(0)
RNG = np.random.default_rng(3)


# Against brute force


@pytest.fixture(
    params=[
        ("biped", "walk"),
        ("biped", "jump"),
        ("biped", "wave"),
        ("tube", None),
        ("arm", None),
        ("morph_cube", "linear"),
        ("morph_cube", "cubic"),
        ("interpolations", None),
        ("pointer", "weights"),
        ("Fox.glb", "Run"),
        ("BitmojiRun.glb", None),
        ("SimpleMorph.gltf", None),
        ("RiggedSimple.gltf", None),
    ],
    ids=lambda param: f"{param[0]} {param[1]}",
)
def scene_and_clip(request: pytest.FixtureRequest, asset: Find) -> tuple[Scene, Clip]:
    """A scene and one of its clips, by name, or the first."""
    file, name = request.param
    document = opened_path(asset(file)) if "." in file else opened_fixture(file)
    return read.scene(document), _clip(document, name)


@pytest.mark.parametrize("change", ["fewer keys", "noise", "one key", "late"])
def test_nothing_is_understated_and_little_is_overstated(scene_and_clip: tuple[Scene, Clip], change: str) -> None:
    scene, before = scene_and_clip
    after = CHANGES[change](before)
    found = Ruler(scene).error(before, after)
    truth = _brute(scene, before, after, check_times(before, after))
    noise = NOISE * diagonal(scene)
    assert found.max_error >= truth - 1e-12
    assert found.max_error <= SLACK * truth + noise
    assert found.times == len(check_times(before, after))
    here = _brute(scene, before, after, np.array([found.time]))
    assert here >= truth / SLACK - noise  # the time that is named is one of the worst


def test_the_same_clip_is_0_away(scene_and_clip: tuple[Scene, Clip]) -> None:
    scene, before = scene_and_clip
    assert Ruler(scene).error(before, before).max_error <= 1e-12


# By hand


def test_a_key_moved_by_a_millimeter_is_found_where_and_when_it_is() -> None:
    document = opened_fixture("biped")
    scene, walk = read.scene(document), _clip(document, "walk")
    hips = next(i for i, each in enumerate(walk.tracks) if each.path == "translation")
    moved = walk.tracks[hips].values.copy()
    moved[7, 1] += 0.001
    after = _with(walk, hips, replace(walk.tracks[hips], values=moved))
    found = Ruler(scene).error(walk, after)
    assert found.max_error == pytest.approx(0.001, rel=0.02)
    assert found.time == walk.tracks[hips].times[7]


def test_a_joint_turned_by_a_degree_is_named() -> None:
    document = opened_fixture("biped")
    scene, walk = read.scene(document), _clip(document, "walk")
    name = "head"
    number = next(i for i, n in enumerate(scene.skeleton.names) if n.lower() == name)
    index = next(i for i, each in enumerate(walk.tracks) if each.target == (number, "rotation"))
    turned = walk.tracks[index].values.copy()
    turned[3] = _product(walk.tracks[index].values[3], about("x", 1))
    found = Ruler(scene).error(walk, _with(walk, index, replace(walk.tracks[index], values=turned)))
    assert found.time == walk.tracks[index].times[3]
    assert found.joint == scene.skeleton.names[number]
    assert 0.001 < found.max_error < 0.01


def test_a_rigid_mesh_by_hand() -> None:
    """A point at (3, 4, 0) on a node that turns 1° about z: the chord of 5 m under 1°."""
    scene = _points([[3, 4, 0], [1, 0, 0]])
    before = clip(track("rotation", [0, 1], about("z", [0, 0])))
    after = clip(track("rotation", [0, 1], about("z", [0, 1])))
    found = Ruler(scene).error(before, after)
    assert found.max_error == pytest.approx(10 * np.sin(np.radians(0.5)), rel=1e-12)
    assert (found.time, found.joint, found.place) == (1.0, "0", "points")


def test_morph_weights_alone_by_hand() -> None:
    """A target of 2 m, its weight off by a quarter half-way."""
    scene = _points([[0, 0, 0], [1, 0, 0]], targets=[[[0, 0, 0], [0, 2, 0]]])
    before, after = (clip(track("weights", [0, 1, 2], np.array([[0], [w], [0]]))) for w in (0.5, 0.75))
    found = Ruler(scene).error(before, after)
    assert found.max_error == pytest.approx(0.5, rel=0.02)
    assert found.time == 1.0


def test_an_error_between_keys_shows_at_the_middle() -> None:
    scene = _points([[0, 0, 0]])
    before = clip(track("translation", [0, 1, 2], [[0, 0, 0], [0, 1, 0], [0, 0, 0]]))
    after = clip(track("translation", [0, 2], [[0, 0, 0], [0, 0, 0]]))
    assert Ruler(scene).error(before, after).max_error == pytest.approx(1)
    jump = clip(track("translation", [0, 1], [[0, 0, 0], [0, 1, 0]], STEP))
    later = clip(track("translation", [0, 1.5], [[0, 0, 0], [0, 1, 0]], STEP))
    found = Ruler(scene).error(jump, later)
    assert found.max_error == pytest.approx(1)
    assert 1 <= found.time < 1.5


def test_a_scene_without_vertices_is_measured_at_its_nodes() -> None:
    """Two nodes, 1 m apart: each carries a cube of 2 % of that, which shows turns too."""
    scene = Scene(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), ())
    before = clip(track("rotation", [0], about("z", [0]), node=0))
    after = clip(track("rotation", [0], about("z", [1]), node=0))
    found = Ruler(scene).error(before, after)
    assert found.place == "1"
    assert found.max_error == pytest.approx(2 * np.sin(np.radians(0.5)) * np.hypot(1.01, 0.01), rel=1e-6)
    leaf = clip(track("rotation", [0], about("z", [2]), node=1))
    assert Ruler(scene).error(clip(), leaf).max_error == pytest.approx(
        0.02 * np.sqrt(2) * np.sin(np.radians(1)), rel=1e-6
    )


def test_a_scene_of_no_size_and_one_of_nothing() -> None:
    alone = Scene(skeleton([-1]), ())
    moved = clip(track("translation", [0], [[0.001, 0, 0]]))
    assert Ruler(alone).error(clip(), moved).max_error == pytest.approx(0.001)
    assert Ruler(alone).error(clip(), clip()) == MotionError(0.0, 0.0, "", "", 1)
    nothing = Scene(skeleton([]), ())
    assert Ruler(nothing).error(clip(), clip()).max_error == 0
    assert Ruler(nothing).diagonal == 0


def test_a_skin_whose_weights_are_all_zero_moves_nothing() -> None:
    document = opened_fixture("arm")
    scene = read.scene(document)
    (instance,) = scene.instances
    limp = replace(instance.mesh, weights=np.zeros_like(instance.mesh.weights))
    before = read.clips(document)[0]
    nothing = Clip("", ())
    found = Ruler(Scene(scene.skeleton, (replace(instance, mesh=limp),))).error(before, nothing)
    assert found.max_error == 0


def test_weights_that_do_not_sum_to_1_count_as_they_are() -> None:
    document = opened_fixture("arm")
    scene = read.scene(document)
    (instance,) = scene.instances
    heavy = Scene(scene.skeleton, (replace(instance, mesh=replace(instance.mesh, weights=3 * instance.mesh.weights)),))
    before = read.clips(document)[0]
    after = resample(before, fps=3)
    found = Ruler(heavy).error(before, after)
    truth = _brute(heavy, before, after, check_times(before, after))
    assert truth - 1e-12 <= found.max_error <= SLACK * truth + NOISE * diagonal(heavy)


def test_heavy_weights_widen_the_bound_too() -> None:
    """A time whose bound is 1.41 times its truth, then one whose bound is 1.3: neither may hide the other."""
    corners = [[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]]
    mesh = replace(_points(corners).instances[0].mesh, joints=np.zeros((4, 1), np.int64), weights=np.full((4, 1), 3.0))
    skin = Skin(np.array([0]), np.eye(4)[None, :3])
    scene = Scene(skeleton([-1]), (Instance(0, mesh, skin, NOTHING),))
    before = clip(track("rotation", [0, 1], about("z", [0, 0]), STEP), track("translation", [0], [[0, 0, 0]]))
    after = clip(
        track("rotation", [0, 1], about("z", [np.degrees(0.01), 0]), STEP),
        track("translation", [0, 1], np.array([[0, 0, 0], [0.013, 0, 0]]), STEP),
    )
    assert Ruler(scene).error(before, after).max_error == pytest.approx(3 * 0.013, rel=0.02)


def test_times_that_are_looked_at() -> None:
    """All keys of both, and the middle of every gap."""
    a, b = clip(track("scale", [0, 1], np.ones((2, 3)))), clip(track("scale", [0.5, 1], np.ones((2, 3))))
    assert check_times(a, b).tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert check_times(clip()).tolist() == [0]


def test_chosen_times_only() -> None:
    scene = _points([[0, 0, 0]])
    before = clip(track("translation", [0, 1, 2], [[0, 0, 0], [0, 1, 0], [0, 0, 0]]))
    found = Ruler(scene).error_at(before, clip(), np.array([0.25]))
    assert found.max_error == pytest.approx(0.25)
    assert (found.time, found.times) == (0.25, 1)
    assert Ruler(scene).error_at(before, clip(), np.empty(0)).max_error == 0


def test_pointers_are_compared_as_a_share_of_their_range() -> None:
    cutoff, factor = "/materials/0/alphaCutoff", "/materials/0/emissiveFactor"
    before = clip(track(cutoff, [0, 1], [[10], [30]]), track(factor, [0, 1], [[1, 2, 3], [1, 2, 3]]))
    after = clip(track(cutoff, [0, 1], [[10], [31]]), track(factor, [0, 1], np.array([[1, 2, 3.03], [1, 2, 3]])))
    found = Ruler(_points([[0, 0, 0]])).error(before, after)
    assert found.max_error == 0
    assert found.max_pointer_error == pytest.approx(1 / 20)
    assert found.pointer == cutoff
    constant = Ruler(_points([[0, 0, 0]])).error(clip(before.tracks[1]), clip(after.tracks[1]))
    assert constant.max_pointer_error == pytest.approx(0.03 / 3)


def test_the_oracle_can_see() -> None:
    """The brute force itself, by hand: with the upper joint of the arm lifted by 1 m, its own vertices move by 1 m."""
    scene = read.scene(opened_fixture("arm"))
    skin = scene.instances[0].skin
    assert skin is not None
    upper = int(skin.joints[1])
    lifted = track("translation", [0], [scene.skeleton.translation[upper] + [0, 1, 0]], node=upper)
    assert _brute(scene, clip(), clip(lifted), np.zeros(1)) == pytest.approx(1)


def _fewer_keys(before: Clip) -> Clip:
    return resample(before, fps=5)


def _noise(before: Clip) -> Clip:
    return Clip(before.name, tuple(_noisy(each) for each in before.tracks))


def _noisy(made: Track) -> Track:
    values = made.values + 1e-3 * RNG.normal(size=made.values.shape)
    return replace(made, values=values)


def _one_key(before: Clip) -> Clip:
    index = max(range(len(before.tracks)), key=lambda i: len(before.tracks[i].times))
    values = before.tracks[index].values.copy()
    values[len(values) // 2, 0] += 0.01
    return _with(before, index, replace(before.tracks[index], values=values))


def _late(before: Clip) -> Clip:
    return Clip(before.name, tuple(replace(each, times=each.times + 0.02) for each in before.tracks))


CHANGES: dict[str, Callable[[Clip], Clip]] = {
    "fewer keys": _fewer_keys,
    "noise": _noise,
    "one key": _one_key,
    "late": _late,
}


def _with(whole: Clip, index: int, new: Track) -> Clip:
    return Clip(whole.name, tuple(new if i == index else each for i, each in enumerate(whole.tracks)))


def _clip(document: Document, name: str | None) -> Clip:
    clips = read.clips(document)
    return next(each for each in clips if name in (None, each.name))


def _points(points: list[list[float]], *, targets: list[list[list[float]]] | None = None) -> Scene:
    """Points on one node, without a skin."""
    count = len(points)
    moved = np.array(targets, float) if targets else np.empty((0, count, 3))
    faces, joints = np.empty((0, 3), np.int64), np.empty((count, 0), np.int64)
    mesh = Mesh("points", np.array(points, float), faces, joints, np.empty((count, 0)), moved, np.zeros(len(moved)))
    return Scene(skeleton([-1]), (Instance(0, mesh, None, np.zeros(len(moved))),))


def _product(a: Floats, b: Floats) -> Floats:
    av, aw, bv, bw = a[:3], a[3], b[:3], b[3]
    return np.array([*(aw * bv + bw * av + np.cross(av, bv)), aw * bw - av @ bv])


def _brute(scene: Scene, before: Clip, after: Clip, times: Floats) -> float:
    """The largest distance of any vertex, or node where there are none, between two clips at these times."""
    old, new = pose(scene.skeleton, before, times), pose(scene.skeleton, after, times)
    worlds = [_fourth_row(world_matrices(scene.skeleton, each)) for each in (old, new)]
    worst = 0.0
    for instance in scene.instances:
        for frame in range(len(times)):
            a = _vertices(instance, worlds[0][frame], _weights(old, instance, frame))
            b = _vertices(instance, worlds[1][frame], _weights(new, instance, frame))
            worst = max(worst, float(np.linalg.norm(a - b, axis=1).max(initial=0)))
    return worst


def _vertices(instance: Instance, world: Floats, weights: Floats) -> Floats:
    """Vertices (V, 3) in the world: morphed, then by Σ w (world · inverse bind) of the joints, or by the node."""
    mesh = instance.mesh
    points = mesh.positions + sum(w * target for w, target in zip(weights, mesh.targets, strict=True))
    whole = np.column_stack((points, np.ones(len(points))))
    if instance.skin is None:
        return np.asarray((whole @ world[instance.node].T)[:, :3])
    matrices = np.array(
        [world[j] @ b for j, b in zip(instance.skin.joints, _fourth_row(instance.skin.inverse_bind), strict=True)]
    )
    blended = (mesh.weights[:, :, None, None] * matrices[mesh.joints]).sum(axis=1)
    return np.asarray((blended @ whole[:, :, None])[:, :3, 0])


def _fourth_row(matrices: Floats) -> Floats:
    row = np.broadcast_to([0.0, 0, 0, 1], (*matrices.shape[:-2], 1, 4))
    return np.concatenate((matrices, row), axis=-2)


def _weights(at: Pose, instance: Instance, frame: int) -> Floats:
    found = at.weights.get(instance.node)
    return instance.weights if found is None else found[frame]

"""Two scenes under one ruler: what peers do to a file must not count as motion, and motion must not be missed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats, Ints
from anim.gltf.reading import reader
from anim.maths import matrix, quaternion
from anim.measure.error.metric import NOISE, ErrorMetric, dense_times
from anim.model import Clip, Mesh, MeshInstance, Scene, Skeleton, TimeAxis
from tests.anim.measure.error.brute_force import brute
from tests.clips import about, clip, skeleton, track
from tests.files import opened_fixture

NOTHING = np.empty(0)
SHIFT, FACTOR = np.array([3.0, -2.0, 1.0]), 7.0  # of the quantized mesh space: q = 7 p + shift


@pytest.fixture(params=["tube", "arm", "biped"])
def skinned(request: pytest.FixtureRequest) -> tuple[Scene, Clip, Clip]:
    """A skinned scene, one of its clips, and that a little slower."""
    document = opened_fixture(request.param)
    before = reader.clips(document)[0]
    return reader.scene(document), before, _slower(before)


def test_another_mesh_space_changes_nothing(skinned: tuple[Scene, Clip, Clip]) -> None:
    """Quantized vertices, with inverse bind matrices that take them back."""
    scene, before, after = skinned
    _same_as_plain(scene, replace(scene, instances=tuple(map(_quantized, scene.instances))), before, after)


def test_nor_do_reordered_and_dropped_vertices(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    fewer = tuple(_quantized(_fewer(instance)) for instance in scene.instances)
    ruler = _same_as_plain(scene, replace(scene, instances=fewer), before, after)
    assert not ruler.pairs.by_vertex


def test_nor_do_other_numbers_of_nodes(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    other, moved = _renumbered(scene, after)
    times = dense_times(before, after)
    plain = ErrorMetric(scene).error_at(before, after, times)
    assert ErrorMetric(scene, other).error_at(before, moved, times).max_error == pytest.approx(
        plain.max_error, rel=1e-3
    )


def test_names_that_were_stripped_are_found_by_order(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    bare = replace(scene, skeleton=replace(scene.skeleton, names=("",) * len(scene.skeleton)))
    _same_as_plain(scene, bare, before, after)


def test_joints_that_are_gone_show_what_they_did() -> None:
    """Without the arm's upper joint its vertices hang on the lower one, as they are placed at rest."""
    document = opened_fixture("arm")
    scene = reader.scene(document)
    skin = scene.instances[0].skin
    assert skin is not None
    upper = int(skin.joints[1])
    other = replace(scene, skeleton=replace(scene.skeleton, names=_renamed(scene.skeleton, upper)))
    ruler = ErrorMetric(scene, other)
    assert ruler.pairs.nodes[upper] == -1
    assert ruler.error(clip(), clip()).max_error < 1e-6
    turn = clip(track("rotation", [0], about("z", [30]), node=upper))
    assert ruler.error(turn, clip()).max_error == pytest.approx(
        ErrorMetric(scene).error(turn, clip()).max_error, rel=1e-3
    )


def test_joints_that_were_turned_in_their_places_are_bound_anew() -> None:
    """Another exporter's joint axes, with inverse bind matrices that go with them: the skin stays where it is."""
    scene = reader.scene(opened_fixture("arm"))
    (instance,) = scene.instances
    skin = instance.skin
    assert skin is not None
    rotation, bind = scene.skeleton.rotation.copy(), skin.inverse_bind.copy()
    for place, axis in ((0, "x"), (1, "y")):
        turn = about(axis, 70)
        joint = int(skin.joints[place])
        rotation[joint] = quaternion.multiply(rotation[joint], turn)
        back = matrix.from_trs(np.zeros(3), quaternion.conjugate(turn), np.ones(3))
        bind[place] = matrix.multiply(back, bind[place])
        if place == 0:  # what hangs on the first one must not turn with it
            child = int(skin.joints[1])
            rotation[child] = quaternion.multiply(quaternion.conjugate(turn), rotation[child])
            place_of = scene.skeleton.translation.copy()
            place_of[child] = quaternion.rotate(quaternion.conjugate(turn), place_of[child])
    other = Scene(
        replace(scene.skeleton, rotation=rotation, translation=place_of),
        (replace(instance, skin=replace(skin, inverse_bind=bind)),),
    )
    assert ErrorMetric(scene, other).error(clip(), clip()).max_error < 1e-7


def test_a_rest_pose_that_moved_is_motion_unless_a_track_says_so() -> None:
    """`--rebase-rest` puts a constant into the rest pose and drops its track: the same motion."""
    document = opened_fixture("arm")
    scene = reader.scene(document)
    skin = scene.instances[0].skin
    assert skin is not None
    upper = int(skin.joints[1])
    rotation = scene.skeleton.rotation.copy()
    rotation[upper] = about("x", 25)
    rebased = replace(scene, skeleton=replace(scene.skeleton, rotation=rotation))
    constant = clip(track("rotation", [0, 1], about("x", [25, 25]), node=upper))
    ruler = ErrorMetric(scene, rebased)
    assert ruler.error(constant, clip()).max_error == pytest.approx(0, abs=1e-12)
    assert ruler.error(clip(), clip()).max_error > 0.1
    assert ruler.pairs.by_vertex


# Lost skins


@pytest.mark.parametrize("is_quantized", [False, True])
def test_a_mesh_that_lost_its_skin_is_carried_by_its_node(
    skinned: tuple[Scene, Clip, Clip], is_quantized: bool
) -> None:
    """Players then show the mesh as its node places it, quantized or not: by brute force the same distance."""
    scene, before, _ = skinned
    kept = tuple(map(_quantized, scene.instances)) if is_quantized else scene.instances
    bare = replace(scene, instances=tuple(replace(each, skin=None) for each in kept))
    ruler, times = ErrorMetric(scene, bare), dense_times(before)
    expected = brute(scene, before, before, times, other=bare)
    assert expected > 0.1 * ruler.diagonal
    assert ruler.error_at(before, before, times).max_error == pytest.approx(expected, rel=2e-3)
    assert ruler.pairs.unskinned == tuple(each.mesh.name for each in scene.instances)
    assert not ruler.pairs.by_vertex


def test_one_lost_skin_is_not_replaced_by_another_meshs() -> None:
    document = opened_fixture("biped")
    scene, before = reader.scene(document), reader.clips(document)[0]
    (body,) = scene.instances
    node = len(scene.skeleton)
    nodes = _with_root(scene.skeleton, "coat")
    coat = replace(body, node=node, mesh=replace(body.mesh, name="coat"))
    both = Scene(nodes, (body, coat))
    ruler = ErrorMetric(both, Scene(nodes, (body, replace(coat, skin=None))))
    assert ruler.pairs.unskinned == ("coat",)
    assert ruler.error(before, before).place == "coat"


def test_a_mesh_on_a_node_of_the_same_name_lost_its_skin_whatever_its_vertices(
    skinned: tuple[Scene, Clip, Clip],
) -> None:
    scene, before, _ = skinned
    bare = tuple(replace(_fewer(each), skin=None) for each in scene.instances)
    ruler = ErrorMetric(scene, replace(scene, instances=bare))
    assert ruler.pairs.unskinned
    assert ruler.error(before, before).max_error > 0.1 * ruler.diagonal


def test_without_any_mesh_joints_carry_the_first_scenes(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    ruler = _same_as_plain(scene, replace(scene, instances=()), before, after)
    assert not ruler.pairs.has_meshes


# Rigid meshes


def test_a_mesh_node_whose_frame_took_up_the_quantization() -> None:
    """gltf-transform multiplies the dequantization into a node that nothing animates."""
    scene = _box(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), 1)
    other = _box(
        skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0] - SHIFT / FACTOR], scale=[[1] * 3, [1 / FACTOR] * 3]), 1
    )
    (instance,) = other.instances
    other = replace(other, instances=(replace(instance, mesh=_in_space(instance.mesh)),))
    for reordered in (other, replace(other, instances=tuple(map(_backward, other.instances)))):
        ruler = ErrorMetric(scene, reordered)
        turn = clip(track("rotation", [0, 1], about("z", [0, 90]), node=0))
        assert ruler.error(turn, turn).max_error < 1e-12
        late = clip(track("rotation", [0, 1], about("z", [0, 80]), node=0))
        assert ruler.error(turn, late).max_error == pytest.approx(
            ErrorMetric(scene).error(turn, late).max_error, rel=1e-3
        )


def test_a_mesh_that_was_put_on_a_new_child() -> None:
    """gltfpack hangs quantized meshes on nodes of their own below those that move."""
    scene = _box(skeleton([-1]), 0)
    nodes = skeleton([-1, 0], translation=[[0, 0, 0], -SHIFT / FACTOR], scale=[[1] * 3, [1 / FACTOR] * 3])
    (instance,) = _box(nodes, 1).instances
    other = Scene(replace(nodes, names=("0", "")), (replace(instance, mesh=_in_space(_fewer(instance).mesh)),))
    turn = clip(track("rotation", [0, 1], about("z", [0, 90])))
    assert ErrorMetric(scene, other).error(turn, turn).max_error == 0


def test_meshes_that_were_merged_follow_what_they_hung_on() -> None:
    """Two boxes on a hand become one mesh on the first one's node, in a frame of its own."""
    nodes = skeleton([-1, 0, 0], translation=[[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    boxes = (_box(nodes, 1).instances[0], _box(nodes, 2).instances[0])
    scene = Scene(nodes, boxes)
    both = np.concatenate((boxes[0].mesh.positions, boxes[1].mesh.positions + np.array([5, 1, 0])))
    merged = Scene(
        replace(skeleton([-1, 0], translation=[[0, 0, 0], [1, 2, 3]]), names=("0", "1")),
        (replace(boxes[0], mesh=_mesh(both)),),
    )
    turn = clip(track("rotation", [0, 1], about("z", [0, 90]), node=0))
    assert ErrorMetric(scene, merged).error(turn, turn).max_error < 1e-12


def test_scenes_without_meshes_are_matched_by_node() -> None:
    old = Scene(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), ())
    new = Scene(replace(skeleton([1, -1], translation=[[1, 0, 0], [0, 0, 0]]), names=("1", "0")), ())
    one, other = (clip(track("rotation", [0], about("z", [90]), node=n)) for n in (0, 1))
    assert ErrorMetric(old, new).error(one, other).max_error < 1e-12
    assert ErrorMetric(old, new).error(one, one).max_error > 1


def test_morph_weights_are_found_on_the_node_that_has_the_mesh() -> None:
    document = opened_fixture("morph_cube")
    scene, before = reader.scene(document), reader.clips(document)[0]
    other, moved = _renumbered(scene, before)
    ruler = ErrorMetric(scene, other)
    assert ruler.error(before, moved).max_error == 0
    assert ruler.error(before, clip()).max_error > 0.01


def _same_as_plain(scene: Scene, other: Scene, before: Clip, after: Clip) -> ErrorMetric:
    """Nothing against itself, and the same between two clips as on one scene alone."""
    ruler, times = ErrorMetric(scene, other), dense_times(before, after)
    assert ruler.error_at(before, before, times).max_error <= 3 * NOISE * ruler.diagonal
    plain = ErrorMetric(scene).error_at(before, after, times)
    found = ruler.error_at(before, after, times)
    assert found.max_error == pytest.approx(plain.max_error, rel=2e-3)
    assert plain.max_error > 1e-4 * ruler.diagonal
    return ruler


def _slower(before: Clip) -> Clip:
    return Clip(before.name, tuple(replace(each, time_axis=TimeAxis(1.05 * each.times)) for each in before.tracks))


def _quantized(instance: MeshInstance) -> MeshInstance:
    assert instance.skin is not None
    back = np.column_stack((np.eye(3) / FACTOR, -SHIFT / FACTOR))
    bind = matrix.multiply(instance.skin.inverse_bind, back)
    return replace(instance, mesh=_in_space(instance.mesh), skin=replace(instance.skin, inverse_bind=bind))


def _in_space(mesh: Mesh) -> Mesh:
    return replace(mesh, positions=FACTOR * mesh.positions + SHIFT, targets=FACTOR * mesh.targets)


def _fewer(instance: MeshInstance) -> MeshInstance:
    """Every vertex but the first, backward; without faces."""
    return _chosen(instance, np.arange(len(instance.mesh.positions), dtype=np.int64)[:0:-1])


def _backward(instance: MeshInstance) -> MeshInstance:
    return _chosen(instance, np.arange(len(instance.mesh.positions), dtype=np.int64)[::-1])


def _chosen(instance: MeshInstance, kept: Ints) -> MeshInstance:
    mesh = instance.mesh
    chosen = replace(
        mesh,
        positions=mesh.positions[kept],
        faces=np.empty((0, 3), np.int64),
        joints=mesh.joints[kept],
        weights=mesh.weights[kept],
        targets=mesh.targets[:, kept],
    )
    return replace(instance, mesh=chosen)


def _renumbered(scene: Scene, moved: Clip) -> tuple[Scene, Clip]:
    """The same scene and clip with the nodes backward."""
    last = len(scene.skeleton) - 1
    parents = np.array([last - p if p >= 0 else -1 for p in scene.skeleton.parents.tolist()])[::-1]
    parts = [getattr(scene.skeleton, name)[::-1] for name in ("translation", "rotation", "scale")]
    nodes = Skeleton(scene.skeleton.names[::-1], parents, *parts)
    instances = tuple(
        replace(each, node=last - each.node, skin=each.skin and replace(each.skin, joints=last - each.skin.joints))
        for each in scene.instances
    )
    tracks = tuple(replace(each, node=last - each.node) for each in moved.tracks if each.node is not None)
    return Scene(nodes, instances), Clip(moved.name, tracks)


def _with_root(nodes: Skeleton, name: str) -> Skeleton:
    """The nodes and one more, without a parent."""
    return Skeleton(
        (*nodes.names, name),
        np.append(nodes.parents, -1),
        np.vstack((nodes.translation, [[0, 0, 0]])),
        np.vstack((nodes.rotation, [[0, 0, 0, 1]])),
        np.vstack((nodes.scale, [[1, 1, 1]])),
    )


def _renamed(nodes: Skeleton, number: int) -> tuple[str, ...]:
    return tuple("another" if i == number else name for i, name in enumerate(nodes.names))


def _box(nodes: Skeleton, node: int) -> Scene:
    sides = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 2) for z in (0.0, 1)])
    return Scene(nodes, (MeshInstance(node, _mesh(sides), None, NOTHING),))


def _mesh(points: Floats) -> Mesh:
    none = np.empty((len(points), 0))
    faces, targets = np.empty((0, 3), np.int64), np.empty((0, len(points), 3))
    return Mesh("box", points, faces, none.astype(np.int64), none, targets, NOTHING)

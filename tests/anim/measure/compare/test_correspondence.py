"""Two scenes under one ruler: what peers do to a file must not count as motion, and motion must not be missed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.gltf.document import copy_json
from anim.gltf.reading import reader
from anim.maths import matrix, quaternion
from anim.measure.compare.equal_scenes import store_alike
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.model import Clip, Scene
from tests.anim.measure.compare.altered import (
    FACTOR,
    SHIFT,
    backward,
    box,
    in_space,
    mesh,
    quantized,
    reduced,
    renamed,
    renumbered,
    same_as_plain,
    slower,
    with_root,
)
from tests.anim.measure.error.brute_force import brute
from tests.clips import about, clip, skeleton, track
from tests.files import opened_fixture


@pytest.fixture(params=["tube", "arm", "biped"])
def skinned(request: pytest.FixtureRequest) -> tuple[Scene, Clip, Clip]:
    """A skinned scene, one of its clips, and that a little slower."""
    document = opened_fixture(request.param)
    before = reader.clips(document)[0]
    return reader.scene(document), before, slower(before)


def test_another_mesh_space_changes_nothing(skinned: tuple[Scene, Clip, Clip]) -> None:
    """Quantized vertices, with inverse bind matrices that take them back."""
    scene, before, after = skinned
    same_as_plain(scene, replace(scene, instances=tuple(map(quantized, scene.instances))), before, after)


def test_nor_do_reordered_and_dropped_vertices(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    fewer = tuple(quantized(reduced(instance)) for instance in scene.instances)
    ruler = same_as_plain(scene, replace(scene, instances=fewer), before, after)
    assert not ruler.pairs.by_vertex


def test_nor_do_other_numbers_of_nodes(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    other, moved = renumbered(scene, after)
    times = dense_times(before, after)
    plain = ErrorMetric(scene).error_at(before, after, times)
    assert ErrorMetric(scene, other).error_at(before, moved, times).max_error == pytest.approx(
        plain.max_error, rel=1e-3
    )


def test_names_that_were_stripped_are_found_by_order(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    bare = replace(scene, skeleton=replace(scene.skeleton, names=("",) * len(scene.skeleton)))
    same_as_plain(scene, bare, before, after)


def test_joints_that_are_gone_show_what_they_did() -> None:
    """Without the arm's upper joint its vertices hang on the lower one, as they are placed at rest."""
    document = opened_fixture("arm")
    scene = reader.scene(document)
    skin = scene.instances[0].skin
    assert skin is not None
    upper = int(skin.joints[1])
    other = replace(scene, skeleton=replace(scene.skeleton, names=renamed(scene.skeleton, upper)))
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
    kept = tuple(map(quantized, scene.instances)) if is_quantized else scene.instances
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
    nodes = with_root(scene.skeleton, "coat")
    coat = replace(body, node=node, mesh=replace(body.mesh, name="coat"))
    both = Scene(nodes, (body, coat))
    ruler = ErrorMetric(both, Scene(nodes, (body, replace(coat, skin=None))))
    assert ruler.pairs.unskinned == ("coat",)
    assert ruler.error(before, before).place == "coat"


def test_a_mesh_on_a_node_of_the_same_name_lost_its_skin_whatever_its_vertices(
    skinned: tuple[Scene, Clip, Clip],
) -> None:
    scene, before, _ = skinned
    bare = tuple(replace(reduced(each), skin=None) for each in scene.instances)
    ruler = ErrorMetric(scene, replace(scene, instances=bare))
    assert ruler.pairs.unskinned
    assert ruler.error(before, before).max_error > 0.1 * ruler.diagonal


def test_without_any_mesh_joints_carry_the_first_scenes(skinned: tuple[Scene, Clip, Clip]) -> None:
    scene, before, after = skinned
    ruler = same_as_plain(scene, replace(scene, instances=()), before, after)
    assert not ruler.pairs.has_meshes


# Rigid meshes


def test_a_mesh_node_whose_frame_took_up_the_quantization() -> None:
    """gltf-transform multiplies the dequantization into a node that nothing animates."""
    scene = box(skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0]]), 1)
    other = box(
        skeleton([-1, 0], translation=[[0, 0, 0], [1, 0, 0] - SHIFT / FACTOR], scale=[[1] * 3, [1 / FACTOR] * 3]), 1
    )
    (instance,) = other.instances
    other = replace(other, instances=(replace(instance, mesh=in_space(instance.mesh)),))
    for reordered in (other, replace(other, instances=tuple(map(backward, other.instances)))):
        ruler = ErrorMetric(scene, reordered)
        turn = clip(track("rotation", [0, 1], about("z", [0, 90]), node=0))
        assert ruler.error(turn, turn).max_error < 1e-12
        late = clip(track("rotation", [0, 1], about("z", [0, 80]), node=0))
        assert ruler.error(turn, late).max_error == pytest.approx(
            ErrorMetric(scene).error(turn, late).max_error, rel=1e-3
        )


def test_a_mesh_that_was_put_on_a_new_child() -> None:
    """gltfpack hangs quantized meshes on nodes of their own below those that move."""
    scene = box(skeleton([-1]), 0)
    nodes = skeleton([-1, 0], translation=[[0, 0, 0], -SHIFT / FACTOR], scale=[[1] * 3, [1 / FACTOR] * 3])
    (instance,) = box(nodes, 1).instances
    other = Scene(replace(nodes, names=("0", "")), (replace(instance, mesh=in_space(reduced(instance).mesh)),))
    turn = clip(track("rotation", [0, 1], about("z", [0, 90])))
    assert ErrorMetric(scene, other).error(turn, turn).max_error == 0


def test_meshes_that_were_merged_follow_what_they_hung_on() -> None:
    """Two boxes on a hand become one mesh on the first one's node, in a frame of its own."""
    nodes = skeleton([-1, 0, 0], translation=[[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    boxes = (box(nodes, 1).instances[0], box(nodes, 2).instances[0])
    scene = Scene(nodes, boxes)
    both = np.concatenate((boxes[0].mesh.positions, boxes[1].mesh.positions + np.array([5, 1, 0])))
    merged = Scene(
        replace(skeleton([-1, 0], translation=[[0, 0, 0], [1, 2, 3]]), names=("0", "1")),
        (replace(boxes[0], mesh=mesh(both)),),
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
    other, moved = renumbered(scene, before)
    ruler = ErrorMetric(scene, other)
    assert ruler.error(before, moved).max_error == 0
    assert ruler.error(before, clip()).max_error > 0.01


def test_a_primitive_twice_is_the_same_by_one_accessor_and_by_two() -> None:
    document = opened_fixture("tube")
    json = copy_json(document.json)
    (primitive,) = json["meshes"][0]["primitives"]
    json["accessors"].append(json["accessors"][primitive["attributes"]["POSITION"]])
    attributes = {**primitive["attributes"], "POSITION": len(json["accessors"]) - 1}
    twice: list[Scene] = []
    for second in (primitive, {**primitive, "attributes": attributes}):
        json["meshes"][0]["primitives"] = [primitive, second]
        twice.append(reader.scene(replace(document, json=copy_json(json)), repeats=False))
    assert [len(each.instances[0].mesh.positions) * 2 // each.vertex_count for each in twice] == [1, 2]
    for one, other in (twice, twice[::-1], twice[:1] * 2):
        assert ErrorMetric(*store_alike(one, other)).pairs.by_vertex

"""Rest poses of skins where the nodes rest in a dance: meshes in centimeters, several skins, nodes that are placed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray

from anim.arrays import Floats
from anim.exchange.retarget.apply import apply_to_character
from anim.exchange.retarget.bind_pose import bind_pose
from anim.exchange.retarget.retarget import GroundMode
from anim.gltf.reading import reader
from anim.maths import matrix, quaternion
from anim.model import Pose, Scene, Skeleton, Skin
from anim.sampling import rest_pose, rest_world, sample_pose, world_matrices
from tests import many
from tests.anim.exchange.figures import Find, character, recorded
from tests.calls import count_calls
from tests.files import mark_slow, opened

Skins: TypeAlias = list[tuple[int, Skin]]
Rig: TypeAlias = tuple[Skeleton, Skins]
TRANSLATION, ROTATION = np.array((5.0, 3.0, -2.0)), quaternion.from_rotation_vector(np.array((0.4, -0.3, 0.2)))
CENTIMETERS = np.diag((0.01, 0.01, 0.01, 1.0))[:3]
FILE_ERROR = 2e-5  # that nodes and matrices of the files themselves differ by, 1.2e-5 in the worst


def _rig(name: str, asset: Find) -> tuple[Scene, Rig]:
    scene = reader.scene(character(name, asset))
    return scene, (scene.skeleton, [(each.node, each.skin) for each in scene.instances if each.skin is not None])


def _times(skin: Skin, moved: Floats) -> Skin:
    return replace(skin, inverse_bind=matrix.multiply(skin.inverse_bind, moved))


def _half(skin: Skin, chosen: NDArray[np.bool_]) -> Skin:
    return Skin(skin.joints[chosen], skin.inverse_bind[chosen])


def _is_upper(rig: Rig) -> NDArray[np.bool_]:
    """By joint of the first skin, whether it rests above the middle."""
    heights = world_matrices(rig[0], rest_pose(rig[0]))[0, rig[1][0][1].joints, 1, 3]
    return np.asarray(heights > heights.mean())


def in_centimeters(rig: Rig) -> Rig:
    """Vertices × 100, inverse binds · scale(0.01)."""
    return rig[0], [(holder, _times(skin, CENTIMETERS)) for holder, skin in rig[1]]


def with_a_placed_mesh(rig: Rig) -> Rig:
    """Vertices in the space of a mesh node that is moved, turned and twice as large, as Blender exports them."""
    bones = _placed(rig, 2.0)
    world = rest_world(bones)
    return bones, [(holder, _times(skin, world[holder])) for holder, skin in rig[1]]


def with_an_ignored_placement(rig: Rig) -> Rig:
    """A mesh node with a transform, which the format ignores; the vertices are in the world's space."""
    return _placed(rig, 2.0), rig[1]


def with_a_placed_mesh_in_centimeters(rig: Rig) -> Rig:
    """Both: a mesh node that is moved and turned, without the scale that its vertices need."""
    bones = _placed(rig, 1.0)
    world = rest_world(bones)
    return bones, [(h, _times(skin, matrix.multiply(world[h], CENTIMETERS))) for h, skin in rig[1]]


def with_two_skins(rig: Rig) -> Rig:
    """Upper and lower half, no joint in both."""
    ((holder, skin), *more), upper = rig[1], _is_upper(rig)
    return rig[0], [(holder, _half(skin, upper)), (holder, _half(skin, ~upper)), *more]


def with_two_units(rig: Rig) -> Rig:
    """The same, the lower half in centimeters."""
    bones, ((holder, upper), (_, lower), *more) = with_two_skins(rig)
    return bones, [(holder, upper), (holder, _times(lower, CENTIMETERS)), *more]


def with_a_shared_joint_in_two_units(rig: Rig) -> Rig:
    """A whole skin in meters, and a part of it in centimeters."""
    (holder, skin), *more = rig[1]
    return rig[0], [(holder, skin), (holder, _times(_half(skin, _is_upper(rig)), CENTIMETERS)), *more]


def with_repeated_joints(rig: Rig) -> Rig:
    """A third of the joints named again with matrices of another scale, which don't count."""
    (holder, skin), *more = rig[1]
    again = np.arange(len(skin.joints)) % 3 == 0
    wrong = _times(_half(skin, again), np.diag((5.0, 5.0, 5.0, 1.0))[:3])
    joints = np.concatenate((skin.joints, wrong.joints))
    return rig[0], [(holder, Skin(joints, np.concatenate((skin.inverse_bind, wrong.inverse_bind)))), *more]


def under_a_scaled_armature(rig: Rig) -> Rig:
    """Joints in centimeters below a node that makes meters of them, and turns z up to y up."""
    bones, top = rig[0], len(rig[0])
    turn = quaternion.from_rotation_vector(np.array((-np.pi / 2, 0, 0)))
    roots = bones.parents < 0
    back = quaternion.conjugate(turn)
    translation, rotation = bones.translation * 100, bones.rotation.copy()
    translation[roots] = quaternion.rotate(back, translation[roots])
    rotation[roots] = quaternion.multiply(back, rotation[roots])
    armature = Skeleton(
        (*bones.names, "Armature"),
        np.append(np.where(roots, top, bones.parents), -1),
        np.concatenate((translation, [[0, 0, 0]])),
        np.concatenate((rotation, [turn])),
        np.concatenate((bones.scale, [[0.01] * 3])),
    )
    world = rest_world(armature)
    return armature, [
        (holder, replace(skin, inverse_bind=matrix.inverse(world[skin.joints]))) for holder, skin in rig[1]
    ]


RIGS: list[Callable[[Rig], Rig]] = [
    in_centimeters,
    with_a_placed_mesh,
    with_an_ignored_placement,
    with_a_placed_mesh_in_centimeters,
    with_two_skins,
    with_two_units,
    with_a_shared_joint_in_two_units,
    with_repeated_joints,
    under_a_scaled_armature,
]
EACH = pytest.mark.parametrize("build", RIGS, ids=lambda build: build.__name__)
WHO = pytest.mark.parametrize("name", mark_slow(["biped", "Knight.glb"]))


def _placed(rig: Rig, scale: float) -> Skeleton:
    bones = rig[0]
    parts = {path: getattr(bones, path).copy() for path in ("translation", "rotation", "scale")}
    for holder, _ in rig[1]:
        if int(bones.parents[holder]) < 0:
            parts["translation"][holder], parts["rotation"][holder] = TRANSLATION, ROTATION
            parts["scale"][holder] = scale
    return replace(bones, **parts)


def _dancing(bones: Skeleton, clean: Skeleton, dance: Pose) -> Skeleton:
    """The skeleton with nodes that rest turned as in a pose, hips more so."""
    turned = quaternion.multiply(quaternion.conjugate(clean.rotation), dance.rotation[0])
    turned[clean.names.index("hips")] = ROTATION
    rotation = bones.rotation.copy()
    rotation[: len(clean)] = quaternion.multiply(rotation[: len(clean)], turned)
    return replace(bones, rotation=rotation)


@WHO
@EACH
def test_the_skins_rest_is_found(build: Callable[[Rig], Rig], name: str, asset: Find) -> None:
    """Joints stand where they stood before the nodes were posed."""
    scene, rig = _rig(name, asset)
    clip = reader.clips(character(name, asset))[2]
    bones, skins = build(rig)
    dance = sample_pose(scene.skeleton, clip, np.array([clip.end / 2]))
    dancing = _dancing(bones, scene.skeleton, dance)
    assert bind_pose(bones, skins).num_joints == 0
    found = bind_pose(dancing, skins)
    joints = np.unique(np.concatenate([skin.joints for _, skin in skins]))
    assert found.num_joints > 3
    expected, made = (rest_world(each)[joints] for each in (bones, found.skeleton))
    np.testing.assert_allclose(made, expected, atol=FILE_ERROR)


@EACH
def test_a_recording_moves_them_alike(build: Callable[[Rig], Rig], asset: Find) -> None:
    scene, rig = _rig("biped", asset)
    clip = reader.clips(character("biped", asset))[2]
    bones, skins = build(rig)
    dancing = _dancing(bones, scene.skeleton, sample_pose(scene.skeleton, clip, np.array([clip.end / 2])))
    instance = scene.instances[0]
    instances = tuple(replace(instance, node=holder, skin=skin) for holder, skin in skins)
    source = recorded("freebvh.bvh", asset)
    clean, other = (
        apply_to_character(source, Scene(each, instances), aliases={}, nested=True, floor=GroundMode.KEEP).clip
        for each in (bones, dancing)
    )
    joints, times = skins[0][1].joints, clean.tracks[0].times
    one, two = (
        world_matrices(each, sample_pose(each, clip, times))[:, joints]
        for each, clip in ((bones, clean), (dancing, other))
    )
    np.testing.assert_allclose(two, one, atol=1e-4)


def test_joints_are_compared_in_one_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened(many.joints(20))
    counted = count_calls(monkeypatch, matrix, "decompose")
    found = bind_pose(reader.skeleton(document), reader.skins(document))
    assert found.num_joints > 0
    assert len(counted) == 20 + 2

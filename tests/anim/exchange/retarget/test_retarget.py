"""A motion on other characters: joints point the same way, soles stand on the floor."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler.from_euler import ImportedMotion, from_euler
from anim.exchange.euler.motion import Convention, Unit
from anim.exchange.euler.to_bvh_motion import to_bvh
from anim.exchange.formats import bvh_reader
from anim.exchange.retarget.apply import apply_to_character
from anim.exchange.retarget.retarget import GroundMode
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.maths.euler import AxesConvention
from anim.model import Clip, Scene
from anim.sampling import rest_world, sample_pose, world_matrices
from tests.anim.exchange.figures import Find, character, put_on, recorded
from tests.files import opened_fixture

CESIUM = {
    "Hips": "Skeleton_torso_joint_1", "Spine": "Skeleton_torso_joint_2", "Spine1": "torso_joint_3",
    "Neck": "Skeleton_neck_joint_1", "Head": "Skeleton_neck_joint_2",
    "LeftUpLeg": "leg_joint_L_1", "LeftLeg": "leg_joint_L_2", "LeftFoot": "leg_joint_L_3",
    "LeftToeBase": "leg_joint_L_5",
    "RightUpLeg": "leg_joint_R_1", "RightLeg": "leg_joint_R_2", "RightFoot": "leg_joint_R_3",
    "RightToeBase": "leg_joint_R_5", "LeftArm": "Skeleton_arm_joint_L__4_", "LeftForeArm": "Skeleton_arm_joint_L__3_",
    "LeftHand": "Skeleton_arm_joint_L__2_", "RightArm": "Skeleton_arm_joint_R",
    "RightForeArm": "Skeleton_arm_joint_R__2_",
    "RightHand": "Skeleton_arm_joint_R__3_",
}  # fmt: skip
BVH = Convention("ZXY", AxesConvention.INTRINSIC, Unit.DEG)


def _lowest(scene: Scene, clip: Clip, times: Floats) -> tuple[Floats, float]:
    """Height of the lowest vertex at each time by a plain weighted sum, and the height of the figure."""
    world = world_matrices(scene.skeleton, sample_pose(scene.skeleton, clip, times))
    lowest, highest = np.full(len(times), np.inf), -np.inf
    for instance in scene.instances:
        if instance.skin is None:
            continue
        mesh = instance.mesh
        points = np.concatenate((mesh.positions, np.ones((len(mesh.positions), 1))), axis=1)
        for f in range(len(times)):
            heights = np.zeros(len(points))
            for k in range(mesh.joints.shape[1]):
                for j in np.unique(mesh.joints[:, k]):
                    bind = np.vstack((instance.skin.inverse_bind[j], (0, 0, 0, 1)))
                    row = world[f, instance.skin.joints[j], 1] @ bind
                    mine = mesh.joints[:, k] == j
                    heights[mine] += mesh.weights[mine, k] * (points[mine] @ row)
            lowest[f] = min(lowest[f], heights.min())
            highest = max(highest, heights.max() - heights.min()) if f == 0 else highest
    return lowest, highest


CHARACTERS = pytest.mark.parametrize(
    ("name", "aliases", "least"),
    [("biped", {}, 21), ("CesiumMan.glb", CESIUM, 19), ("Knight.glb", {}, 18)],
)


@CHARACTERS
def test_soles_stand_on_the_floor(name: str, aliases: dict[str, str], least: int, asset: Find) -> None:
    """While the recorded feet are down, the lowest vertex is within 2 % of the height of the floor."""
    source, document = recorded("cmu_01_01.bvh", asset), character(name, asset)
    scene = reader.scene(document)
    done = put_on(document, source, aliases)
    assert len(done.matching.pairs) >= least
    times = done.clip.tracks[0].times[120::60]
    theirs = world_matrices(source.skeleton, sample_pose(source.skeleton, source.clip, times))[..., 1, 3].min(axis=1)
    down = theirs - np.percentile(theirs, 5) < 0.01
    assert down.mean() > 0.3
    lowest, height = _lowest(scene, done.clip, times)
    assert np.abs(lowest[down]).max() < 0.02 * height
    assert lowest[~down].max() > 0.02 * height  # it jumps


@CHARACTERS
def test_a_walk_is_on_the_floor_in_every_frame(name: str, aliases: dict[str, str], least: int, asset: Find) -> None:
    source, document = recorded("freebvh.bvh", asset), character(name, asset)
    named = {f"mixamorig:{joint}": node for joint, node in aliases.items()}
    done = put_on(document, source, named)
    assert len(done.matching.pairs) >= least
    lowest, height = _lowest(reader.scene(document), done.clip, done.clip.tracks[0].times)
    assert np.abs(lowest).max() < 0.01 * height


@pytest.mark.parametrize("name", ["biped", "Knight.glb"])
def test_arms_and_legs_point_as_the_recorded_ones(name: str, asset: Find) -> None:
    source, document = recorded("cmu_01_01.bvh", asset), character(name, asset)
    bones = reader.skeleton(document)
    done = put_on(document, source, {})
    times = source.clip.tracks[0].times[::300]
    one = world_matrices(source.skeleton, sample_pose(source.skeleton, source.clip, times))[..., 3]
    two = world_matrices(bones, sample_pose(bones, done.clip, times))[..., 3]
    for side in ("left", "right"):
        for a, b in (
            ("upper_arm", "lower_arm"),
            ("lower_arm", "hand"),
            ("upper_leg", "lower_leg"),
            ("lower_leg", "foot"),
        ):
            ways = []
            for places, roles in ((one, done.matching.source_roles), (two, done.matching.target_roles)):
                way = places[:, roles[f"{side}_{b}"]] - places[:, roles[f"{side}_{a}"]]
                ways.append(way / np.linalg.norm(way, axis=1, keepdims=True))
            np.testing.assert_allclose(ways[0], ways[1], atol=1e-5)


def test_a_frame_can_be_the_rest_pose(asset: Find) -> None:
    """Frame 0 of this recording is the pose of all zeros, but for legs and thumbs: for the others nothing changes."""
    source, document = recorded("cmu_01_01.bvh", asset), character("biped", asset)
    scene = reader.scene(document)
    one, two = (
        apply_to_character(source, scene, aliases={}, nested=True, floor=GroundMode.KEEP, bind_time=at).clip
        for at in (None, 0.0)
    )
    for a, b in zip(one.tracks, two.tracks, strict=True):
        name = scene.skeleton.names[a.node or 0]
        if not name.endswith(("leg", "foot", "toe")):
            np.testing.assert_allclose(b.values, a.values, atol=1e-6, err_msg=name)
    turned = apply_to_character(source, scene, aliases={}, nested=True, floor=GroundMode.KEEP, bind_time=5.0).clip
    bones = scene.skeleton
    hips = bones.names.index("hips")
    at_rest = sample_pose(bones, turned, np.array([5.0])).rotation[0, hips]
    assert quaternion.angle_between(at_rest, bones.rotation[hips]) < 1e-6


def test_feet_that_are_flat_stay_flat(asset: Find) -> None:
    """In CMU's rest pose, frame 0 turned off, the biped stands with its soles down although its foot slopes more."""
    source, document = recorded("cmu_01_01.bvh", asset), character("biped", asset)
    still = ImportedMotion(source.skeleton, Clip("rest", source.clip.tracks[:1]), source.ends)
    done = put_on(document, still, {})
    bones = reader.skeleton(document)
    foot = bones.names.index("left_foot")
    world = world_matrices(bones, sample_pose(bones, done.clip, np.zeros(1)))
    np.testing.assert_allclose(world[0, foot, :, :3], np.eye(3), atol=1e-6)


def test_a_characters_own_motion_comes_back(asset: Find) -> None:
    """walk → BVH → the same figure: every joint where it was."""
    document = opened_fixture("biped")
    bones, walk = reader.skeleton(document), reader.clips(document)[0]
    joints = set(document.json["skins"][0]["joints"])
    text = bvh_reader.write(to_bvh(bones, walk, order="YZX", joints=joints, fps=30), BVH)
    done = put_on(document, from_euler(bvh_reader.read(text), tolerance=1e-3), {}, GroundMode.KEEP)
    assert not done.matching.unmatched
    times = np.arange(int(walk.end * 30)) / 30
    before, after = (world_matrices(bones, sample_pose(bones, clip, times))[..., 3] for clip in (walk, done.clip))
    np.testing.assert_allclose(after, before, atol=2e-5)
    assert done.scale == pytest.approx(1, abs=1e-5)


def test_legs_and_feet_that_hang_elsewhere_stay_in_their_joints(asset: Find) -> None:
    """The robot's legs do not hang on its hips, nor its feet on its legs: they are for inverse kinematics."""
    source, document = recorded("freebvh.bvh", asset), character("Robot.glb", asset)
    bones = reader.skeleton(document)
    done = put_on(document, source, {})
    times = done.clip.tracks[0].times
    moved = [bones.names[track.node or 0] for track in done.clip.tracks if track.path == "translation"]
    assert sorted(moved) == ["Foot.L", "Foot.R", "Hips", "UpperLeg.L", "UpperLeg.R"]  # lower legs hang on upper ones
    still, moving = (
        rest_world(bones),
        world_matrices(bones, sample_pose(bones, done.clip, times)),
    )
    at = {name: bones.names.index(name) for name in ("Hips", "UpperLeg.L", "LowerLeg.L", "Foot.L")}
    for holder, held in (("Hips", "UpperLeg.L"), ("LowerLeg.L", "Foot.L")):
        before, after = (
            np.linalg.solve(
                world[..., at[holder], :, :3], (world[..., at[held], :, 3:] - world[..., at[holder], :, 3:])
            )
            for world in (still, moving)
        )
        np.testing.assert_allclose(after, np.broadcast_to(before, after.shape), atol=1e-4 * np.abs(before).max())


def test_recordings_keep_their_grid(asset: Find) -> None:
    source = recorded("freebvh.bvh", asset)
    times = put_on(character("Knight.glb", asset), source, {}).clip.tracks[0].times
    np.testing.assert_array_equal(times, source.clip.tracks[0].times)

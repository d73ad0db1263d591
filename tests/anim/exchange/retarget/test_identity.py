"""A clip that is written as Euler curves and put back on its own figure is the clip it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.arrays import Floats
from anim.exchange.euler.convention import PartialConvention
from anim.exchange.euler.from_euler import ImportedMotion, from_euler
from anim.exchange.euler.motion import Convention, Unit, scale_motion
from anim.exchange.euler.to_bvh_motion import to_bvh
from anim.exchange.euler.to_euler import to_euler
from anim.exchange.formats import bvh_reader, json_reader
from anim.exchange.retarget.apply import apply_to_character
from anim.exchange.retarget.bind_pose import bind_pose, fill_from_parents
from anim.exchange.retarget.retained_tracks import add_retained_tracks, retained_tracks
from anim.gltf.reading import reader
from anim.maths import matrix, quaternion
from anim.maths.euler import AxesConvention
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip, Scene, Skeleton, Skin, TimeAxis
from anim.sampling import sample_pose, world_matrices
from tests.anim.exchange.figures import Find, character, recorded
from tests.clips import track

CENTIMETERS = 0.01
CONVENTION = Convention("ZXY", AxesConvention.INTRINSIC, Unit.DEG)
TOLERANCE = 1e-3  # rad, of from-euler
MAX_ERROR_M = 1e-5
FPS = {"Knight.glb": 30.0, "Fox.glb": 120.0}  # of grids that all keys lie on, where no clip has a key at each frame
A_FEW = [
    ("biped", "walk"),
    ("Knight.glb", "Death_A"),
    ("Knight.glb", "Jump_Idle"),
    ("Robot.glb", "Robot_Jump"),
    ("Fox.glb", "Walk"),
    ("BitmojiRun.glb", "lbr_run_normal_anm_default"),
    ("CesiumMan.glb", ""),
]
FORMATS = pytest.mark.parametrize("kind", ["bvh", "json"])


def _skins(scene: Scene) -> list[tuple[int, Skin]]:
    return [(each.node, each.skin) for each in scene.instances if each.skin is not None]


def _written(scene: Scene, clip: Clip, kind: str, fps: float | None) -> ImportedMotion:
    """A clip through the bytes of a file."""
    bones = bind_pose(scene.skeleton, _skins(scene)).skeleton
    clip = fill_from_parents(clip, scene.skeleton, bones)
    if kind == "json":
        curves = to_euler(bones, clip, order="ZXY", fps=fps).motion
        motion = json_reader.read(json_reader.write(curves, CONVENTION), PartialConvention())
    else:
        joints = {int(node) for each in scene.instances if each.skin is not None for node in each.skin.joints}
        curves = to_bvh(bones, clip, order="ZXY", fps=fps, joints=joints, meters_per_unit=CENTIMETERS)
        motion = scale_motion(bvh_reader.read(bvh_reader.write(curves, CONVENTION)), CENTIMETERS)
    return from_euler(motion, tolerance=TOLERANCE, name=clip.name)


def _from_zero(clip: Clip) -> Clip:
    """The clip with its first key at 0 s, where a BVH begins."""
    return Clip(clip.name, tuple(replace(each, time_axis=TimeAxis(each.times - clip.start)) for each in clip.tracks))


def _error(scene: Scene, clip: Clip, kind: str, fps: float | None) -> float:
    """How far a vertex of the clip that comes back is from where it was, by the size of what has more than 10 m.

    A BVH has the joints at its frames, and not what other nodes do between frames: those are the times looked at.
    """
    done = apply_to_character(_written(scene, clip, kind, fps), scene, aliases={}, nested=True)
    ruler = ErrorMetric(scene)
    if kind == "bvh":
        times = np.unique(np.concatenate([each.times for each in done.clip.tracks]))
        found = ruler.error_at(_from_zero(clip), done.clip, times)
    else:
        found = ruler.error(clip, done.clip)
    return found.max_error / max(1.0, ruler.diagonal / 10)


@FORMATS
@pytest.mark.parametrize(("name", "clip"), A_FEW)
def test_a_clip_comes_back(name: str, clip: str, kind: str, asset: Find) -> None:
    document = character(name, asset)
    found = next(each for each in reader.clips(document) if each.name == clip)
    assert _error(reader.scene(document), found, kind, FPS.get(name)) < MAX_ERROR_M


@pytest.mark.slow
@FORMATS
@pytest.mark.parametrize("name", ["Knight.glb", "Robot.glb", "Fox.glb"])
def test_all_clips_come_back(name: str, kind: str, asset: Find) -> None:
    document = character(name, asset)
    scene = reader.scene(document)
    errors = {clip.name: _error(scene, clip, kind, FPS.get(name)) for clip in reader.clips(document)}
    assert {name: error for name, error in errors.items() if error >= MAX_ERROR_M} == {}


def _under(bones: Skeleton, translation: Floats, rotation: Floats, scale: float | Floats) -> Skeleton:
    """The skeleton below one node more."""
    parents = np.where(bones.parents < 0, len(bones), bones.parents)
    return Skeleton(
        (*bones.names, "placed"),
        np.append(parents, -1),
        np.concatenate((bones.translation, [translation])),
        np.concatenate((bones.rotation, [rotation])),
        np.concatenate((bones.scale, [np.broadcast_to(scale, 3)])),
    )


ASIDE, TURNED = np.array((5.0, 3.0, -2.0)), quaternion.from_rotation_vector(np.array((0.4, -0.3, 0.2)))


@FORMATS
@pytest.mark.parametrize("name", ["Knight.glb", "Robot.glb"])
def test_a_figure_placed_elsewhere_does_the_same(name: str, kind: str, asset: Find) -> None:
    """Moved, turned, twice as large: the joints' own tracks stay what they were."""
    document = character(name, asset)
    scene, clip = reader.scene(document), reader.clips(document)[3]
    source = _written(scene, clip, kind, FPS.get(name))
    placed = _under(scene.skeleton, ASIDE, TURNED, 2.0)
    done = apply_to_character(source, replace(scene, skeleton=placed), aliases={}, nested=True)
    times = done.clip.tracks[0].times
    expected, found = (world_matrices(placed, sample_pose(placed, each, times)) for each in (clip, done.clip))
    np.testing.assert_allclose(found[..., 3], expected[..., 3], atol=2 * MAX_ERROR_M)
    assert done.scale == pytest.approx(2, abs=1e-6)


@FORMATS
@pytest.mark.parametrize("mirror", [(-1.0, 1, 1), (2, -2, 2), (-1, 1, -1), (-1, -1, -1)])
def test_a_figure_below_a_rotating_mirror_comes_back(mirror: tuple[float, ...], kind: str, asset: Find) -> None:
    """The mirroring node is no joint: its track is retained, and joints get the rotations that BVH has in the world."""
    document = character("biped", asset)
    scene, walk = reader.scene(document), reader.clips(document)[0]
    placed = replace(scene, skeleton=_under(scene.skeleton, ASIDE, TURNED, np.array(mirror)))
    times = walk.tracks[0].times
    angles = np.outer(np.linspace(0, 2, len(times)), (0.3, 1.0, -0.5))
    turning = track("rotation", times, quaternion.from_rotation_vector(angles), node=len(scene.skeleton))
    clip = Clip("turning", (*walk.tracks, turning))
    done = apply_to_character(_written(placed, clip, kind, FPS.get("biped")), placed, aliases={}, nested=True)
    found = add_retained_tracks(done, retained_tracks(clip, done)[0], placed.skeleton)
    assert ErrorMetric(placed).error_at(clip, found, times).max_error < MAX_ERROR_M


@pytest.mark.parametrize("factor", [2.0, 0.01])
def test_a_figure_of_another_size_does_the_same(factor: float, asset: Find) -> None:
    """Lengths in the nodes, not in a scale above them; every joint has another prefix."""
    document = character("Knight.glb", asset)
    scene, clip = reader.scene(document), reader.clips(document)[3]
    bones = scene.skeleton
    other = replace(bones, translation=factor * bones.translation, names=tuple(f"Rig:{n}" for n in bones.names))
    target = Scene(other, tuple(replace(each, skin=_bound(each.skin, factor)) for each in scene.instances))
    done = apply_to_character(_written(scene, clip, "json", 30), target, aliases={}, nested=True)
    assert done.scale == pytest.approx(factor, rel=1e-6)
    times = done.clip.tracks[0].times
    expected = world_matrices(bones, sample_pose(bones, clip, times))
    found = world_matrices(other, sample_pose(other, done.clip, times))
    np.testing.assert_allclose(found[..., 3] / factor, expected[..., 3], atol=MAX_ERROR_M)
    np.testing.assert_allclose(found[..., :3], expected[..., :3], atol=MAX_ERROR_M)


def _bound(skin: Skin | None, factor: float) -> Skin | None:
    if skin is None:
        return None
    bind = matrix.inverse(skin.inverse_bind)
    bind[:, :, 3] *= factor
    return replace(skin, inverse_bind=matrix.inverse(bind))


def test_scales_go_with_the_joints(asset: Find) -> None:
    """Squash and stretch, one axis of it through 0."""
    document = character("biped", asset)
    scene, walk = reader.scene(document), reader.clips(document)[0]
    times = np.array((0.0, 0.5, 1.0))
    joint = scene.skeleton.names.index("left_upper_leg")
    squash = track("scale", times, ((1.0, 1, 1), (1.4, 0.6, 1.4), (0, 1, 1)), node=joint)
    clip = Clip("squash", (*walk.tracks, squash))
    assert _error(scene, clip, "json", None) < MAX_ERROR_M


@pytest.mark.parametrize("name", ["biped", "Knight.glb"])
def test_nodes_that_rest_in_a_dance_are_no_rest(name: str, asset: Find) -> None:
    """The same figure with nodes in the middle of a clip moves as the clean one, whatever the motion."""
    document = character(name, asset)
    scene, clips = reader.scene(document), reader.clips(document)
    dance = sample_pose(scene.skeleton, clips[2], np.array([clips[2].end / 2]))
    dancing = replace(
        scene.skeleton, translation=dance.translation[0], rotation=dance.rotation[0], scale=dance.scale[0]
    )
    assert bind_pose(scene.skeleton, _skins(scene)).num_joints == 0
    assert bind_pose(dancing, _skins(scene)).num_joints > 3
    source = recorded("freebvh.bvh", asset)
    clean, other = (
        apply_to_character(source, replace(scene, skeleton=each), aliases={}, nested=True).clip
        for each in (scene.skeleton, dancing)
    )
    joints = _skins(scene)[0][1].joints
    times = clean.tracks[0].times
    one, two = (
        world_matrices(bones, sample_pose(bones, clip, times))[:, joints]
        for bones, clip in ((scene.skeleton, clean), (dancing, other))
    )
    np.testing.assert_allclose(two, one, atol=1e-4)

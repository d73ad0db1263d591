"""Collapse: indices, volumes and bulges with numbers worked by hand, and the advice that follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from anim.errors import NotFoundError, RangeError
from anim.gltf.reading import reader
from anim.model import Scene
from anim.sampling.times import frame_times
from anim.skinning.analysis.collapse import collapse
from anim.skinning.analysis.enclosed_volume import volumes, watertight_faces
from anim.skinning.analysis.recommendations import twist_joints
from anim.skinning.bake import bake
from fixtures.shapes import cube
from tests.anim.skinning.analysis.tubes import tube, turned
from tests.anim.skinning.methods.test_linear_blend import TIMES, moving
from tests.anim.skinning.scenes import mesh, random_scene, scene, skinning_matrices
from tests.clips import clip, track
from tests.files import opened_fixture


def test_a_twisted_tube() -> None:
    (found,) = collapse(tube(), turned("y", 0, 90), times=np.linspace(0, 1, 4))
    assert found.indices == pytest.approx(np.cos(np.radians([0, 15, 30, 45])), abs=1e-6)
    worst = found.worst
    assert (worst.joint, worst.other, worst.time, worst.twist) == ("lower", "upper", 1.0, True)
    assert (worst.index, worst.angle) == pytest.approx((np.sqrt(0.5), np.pi / 2), abs=1e-6)
    assert worst.vertex // 48 == 48, "the middle ring"
    assert (found.low, found.inverted, found.closed) == (0, 0, 1)
    linear, dual = found.methods
    assert linear.volume is not None
    assert dual.volume is not None
    assert linear.volume == pytest.approx(1 - 2 / 3 * np.sin(np.radians([0, 15, 30, 45])) ** 2, abs=1e-3)
    assert dual.volume == pytest.approx(1, abs=1e-3)
    assert linear.bulge == pytest.approx(1, abs=1e-5)


def test_a_candy_wrapper_and_its_share() -> None:
    """At 180° the index of weight s is |1 − 2s|: below 0.7 for s in 0.15 … 0.85."""
    (found,) = collapse(tube(), turned("y", 0, 90, 180), times=np.array([2.0]))
    assert found.worst.index == pytest.approx(0, abs=1e-3)
    heights = tube().instances[0].mesh.positions[:, 1]
    assert found.low == pytest.approx(((heights > 0.15) & (heights < 0.85)).mean(), abs=0.01)


def test_indices_are_the_determinants_of_the_blend() -> None:
    """Scales and shears divided out, for random joints; scales alone are no collapse."""
    of = random_scene(4, scale_shear=0.5)
    played = moving(of, 1)
    matrices, body = skinning_matrices(of, played, TIMES)[..., :3], of.instances[0].mesh
    blended = np.einsum("vi,fviab->fvab", body.weights, matrices[:, body.joints])
    sizes = np.log(np.abs(np.linalg.det(matrices)))[:, body.joints]
    factors = np.linalg.det(blended) / np.exp((body.weights * sizes).sum(axis=2))
    (found,) = collapse(of, played, times=TIMES)
    wanted = np.sqrt(np.clip(factors, 0, None))
    assert found.indices == pytest.approx(wanted.min(axis=1), abs=2e-3)
    assert found.inverted == pytest.approx((factors.min(axis=0) < 0).mean(), abs=0.02)
    grown = clip(track("scale", [0], [[2, 2, 2]]))
    (found,) = collapse(tube(), grown, times=np.zeros(1))
    assert found.worst.index == pytest.approx(1, abs=1e-6)
    assert found.methods[0].volume == pytest.approx([1], abs=1e-5)


def test_a_bend_is_no_twist_and_bulges() -> None:
    (found,) = collapse(tube(), turned("x", 0, 90), times=np.array([1.0]), methods=("lbs", "dqs", "cor"))
    assert not found.worst.twist
    linear, dual, centers = found.methods
    assert linear.bulge < centers.bulge < dual.bulge
    assert dual.bulging > 0.1


def test_volumes_are_trimeshs() -> None:
    for name in ("tube", "arm"):
        of = reader.scene(opened_fixture(name))
        cache = bake(of, reader.clips(opened_fixture(name))[-1], times=np.array([0.3, 1.0]), method="dqs")
        whole = cache.load_all().positions
        for points, volume in zip(whole, volumes(whole, cache.faces), strict=True):
            assert volume == pytest.approx(trimesh.Trimesh(points, cache.faces, process=False).volume, rel=1e-5)


def test_closed_parts_are_found_among_open_ones() -> None:
    """A cube of 36 corners, another with a face missing, and a third with a face turned inside out."""
    shape = cube(1.0)
    turned = shape.faces.copy()
    turned[0] = turned[0][::-1]
    faces = np.concatenate([shape.faces, shape.faces[1:] + 36, turned + 72])
    points = np.concatenate([shape.positions, shape.positions + 3, shape.positions + 6])
    closed = watertight_faces(points, faces)
    assert closed.tolist() == [True] * 12 + [False] * 23
    assert volumes(points[None], faces[closed]) == pytest.approx([1])
    assert watertight_faces(points, faces[:0]).tolist() == []


def test_an_open_mesh_has_no_volume_but_an_index() -> None:
    of = tube()
    body = of.instances[0].mesh
    of = Scene(of.skeleton, (replace(of.instances[0], mesh=replace(body, faces=body.faces[5:])),))
    (found,) = collapse(of, turned("y", 90), times=np.zeros(1))
    assert (found.closed, found.methods[0].volume) == (0, None)
    assert found.worst.index == pytest.approx(np.sqrt(0.5), abs=1e-6)


def test_flat_joints_do_not_collapse() -> None:
    body = mesh([[1, 0, 0]], [[0, 1]], [[0.5, 0.5]])
    (found,) = collapse(scene(body, [-1, 0], scale=[[1, 1, 1], [0, 0, 0]]), clip(), times=np.zeros(1))
    assert found.worst.index == 1


@pytest.mark.parametrize("angle", [90.0, 170.0])
def test_a_mirrored_character_has_the_numbers_of_the_one_in_the_mirror(angle: float) -> None:
    """One root above all joints mirrors and doubles: nothing collapses that does not without it."""
    plain = tube()
    above = replace(
        plain.skeleton,
        names=(*plain.skeleton.names, "mirror"),
        parents=np.append(np.where(plain.skeleton.parents < 0, len(plain.skeleton), plain.skeleton.parents), -1),
        translation=np.vstack((plain.skeleton.translation, [0, 0, 0])),
        rotation=np.vstack((plain.skeleton.rotation, [0, 0, 0, 1])),
        scale=np.vstack((plain.skeleton.scale, [-2, 2, 2])),
    )
    (wanted,) = collapse(plain, turned("y", 0, angle), times=np.linspace(0, 1, 4))
    (found,) = collapse(replace(plain, skeleton=above), turned("y", 0, angle), times=np.linspace(0, 1, 4))
    assert found.indices == pytest.approx(wanted.indices, abs=1e-5)
    assert (found.low, found.inverted) == (wanted.low, wanted.inverted)
    for one, other in zip(found.methods, wanted.methods, strict=True):
        assert one.volume == pytest.approx(other.volume, abs=1e-4)
        assert one.bulge == pytest.approx(other.bulge, abs=1e-4)


def test_what_a_clip_alone_mirrors_is_inside_out() -> None:
    (found,) = collapse(tube(), clip(track("scale", [0], [[-1, 1, 1]])), times=np.zeros(1))
    assert (found.worst.index, found.inverted) == (0, 1)
    assert found.methods[0].volume == pytest.approx([-1], abs=1e-5)


def test_without_a_skin_there_is_nothing_to_say() -> None:
    of = reader.scene(opened_fixture("morph_cube"))
    with pytest.raises(NotFoundError, match="no skinned mesh"):
        collapse(of, clip(), times=np.zeros(1))


def test_the_clamp_is_that_of_bake() -> None:
    """The bent tube by the two ways: its volume by trimesh from a clamped bake; lbs is never clamped."""
    of, bend, time = tube(), turned("x", 0, 90), np.array([1.0])
    (free,) = collapse(of, bend, times=time)
    (held,) = collapse(of, bend, times=time, bulge_clamp=True)
    whole = bake(of, bend, times=time, method="dqs", bulge_clamp=True).load_all()
    faces = of.instances[0].mesh.faces
    wanted = [
        trimesh.Trimesh(each, faces, process=False).volume
        for each in (whole.positions[0], of.instances[0].mesh.positions)
    ]
    assert held.methods[1].volume == pytest.approx([wanted[0] / wanted[1]], rel=1e-4)
    assert held.methods[1].bulge < free.methods[1].bulge - 0.3
    assert held.methods[0].volume == pytest.approx(free.methods[0].volume)
    with pytest.raises(RangeError, match="`bulge_clamp` requires a method other than lbs"):
        collapse(of, bend, times=time, methods=("lbs",), bulge_clamp=True)


@pytest.mark.parametrize(("degrees", "joints"), [(10, 1), (36, 1), (37, 2), (90, 3), (180, 5)])
def test_twist_joints_leave_95_percent(degrees: float, joints: int) -> None:
    assert twist_joints(np.radians(degrees)) == joints
    assert np.cos(np.radians(degrees) / (2 * joints)) > 0.949


def test_the_biped_in_all_its_clips() -> None:
    document = opened_fixture("biped")
    of = reader.scene(document)
    for played in reader.clips(document):
        for found in collapse(of, played, times=frame_times(played.start, played.end, fps=15)):
            assert 0 <= found.worst.index <= 1 + 1e-6
            assert found.indices.min() == pytest.approx(found.worst.index, abs=1e-6)

"""USD: meshes that move by transforms, skeletons and instances, not by their points."""

from __future__ import annotations

import numpy as np
import pytest

from anim.caches.storage import Memory
from anim.errors import FormatError, UnsupportedError
from anim.model import VertexCache
from tests.anim.caches.making import opened, positions_of

pytest.importorskip("pxr", reason="usd-core is not installed")

TRIANGLE = """def Mesh "mesh" {
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    PRIMVARS
}"""
MOVED = """def Xform "wheel" {
  float xformOp:rotateZ.timeSamples = { 10: 0, 34: 180 }
  uniform token[] xformOpOrder = ["xformOp:rotateZ"]
  CHILD
}"""
SKINNED = """def SkelRoot "root" {
  def Skeleton "skeleton" (prepend apiSchemas = ["SkelBindingAPI"]) {
    uniform token[] joints = ["joint"]
    uniform matrix4d[] bindTransforms = [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))]
    uniform matrix4d[] restTransforms = [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))]
    rel skel:animationSource = </root/skeleton/motion>
    def SkelAnimation "motion" {
      uniform token[] joints = ["joint"]
      float3[] translations.timeSamples = { 0: [(0, 0, 0)], 12: [(0, 3, 0)], 24: [(5, 0, 0)] }
      quatf[] rotations = [(1, 0, 0, 0)]
      half3[] scales = [(1, 1, 1)]
    }
  }
  CHILD
}"""
BOUND = """rel skel:skeleton = </root/skeleton>
    int[] primvars:skel:jointIndices = [0, 0, 0] ( elementSize = 1
      interpolation = "vertex" )
    float[] primvars:skel:jointWeights = [1, 1, 1] ( elementSize = 1
      interpolation = "vertex" )"""


TURNED = SKINNED.replace(
    "translations.timeSamples = { 0: [(0, 0, 0)], 12: [(0, 3, 0)], 24: [(5, 0, 0)] }", "translations = [(0, 0, 0)]"
).replace("rotations = [(1, 0, 0, 0)]", "rotations.timeSamples = { 0: [(1, 0, 0, 0)], 24: [(0, 0, 0, 1)] }")


def stage(content: str, *, primvars: str = "", codes_per_second: float = 24, frames: str = "") -> VertexCache:
    mesh = TRIANGLE.replace("PRIMVARS", primvars)
    if primvars:
        mesh = mesh.replace('"mesh"', '"mesh" (prepend apiSchemas = ["SkelBindingAPI"])')
    head = f"( metersPerUnit = 1\n timeCodesPerSecond = {codes_per_second}\n {frames} )"
    text = f"#usda 1.0\n{head}\n{content.replace('CHILD', mesh)}\n"
    return opened(Memory("a.usda", {"a.usda": text.encode()}))


def test_a_mesh_below_an_animated_transform_moves() -> None:
    cache = stage(MOVED)
    assert cache.times * 24 == pytest.approx(range(10, 35))
    angle = np.linspace(0, np.pi, 25)
    assert positions_of(cache)[:, 1] == pytest.approx(np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1), abs=1e-6)


def test_transforms_have_24_frames_per_second_where_time_codes_are_seconds() -> None:
    cache = stage(MOVED.replace("34", "12"), codes_per_second=1)
    assert cache.times == pytest.approx(np.linspace(10, 12, 49))


def test_a_constant_transform_adds_no_frame() -> None:
    assert stage(MOVED.replace(", 34: 180", "")).times.tolist() == [0]


def test_transforms_over_endless_time_codes_are_refused() -> None:
    with pytest.raises(FormatError, match="animated from time code 10 to 1e\\+12"):
        stage(MOVED.replace("34", "1000000000000"))


def test_a_skeleton_moves_its_mesh() -> None:
    cache = stage(SKINNED, primvars=BOUND)
    assert cache.times * 24 == pytest.approx(range(25))
    assert positions_of(cache)[::12, 1] == pytest.approx(np.array([[1, 0, 0], [1, 3, 0], [6, 0, 0]]))
    assert cache.rest is not None
    assert cache.rest[1] == pytest.approx([1, 0, 0])


@pytest.mark.parametrize("frames", ["", "startTimeCode = 6\n endTimeCode = 7", "endTimeCode = 1e12"])
def test_joints_turn_between_their_samples_whatever_frames_the_file_has(frames: str) -> None:
    cache = stage(TURNED, primvars=BOUND, frames=frames)
    assert cache.times * 24 == pytest.approx(range(25))
    angle = np.linspace(0, np.pi, 25)
    assert positions_of(cache)[:, 1] == pytest.approx(np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1), abs=1e-6)


@pytest.mark.parametrize("codes_per_second", [1, 12.5, 23.976, 60])
def test_joints_and_transforms_have_the_same_frames(codes_per_second: float) -> None:
    """A joint turns by 180° about z from 0 to 24, and its root by 90° about x from 2 to 20.

    Between frames, as at 2 and 20, the skin is on a straight line.
    """
    turn = "float xformOp:rotateX.timeSamples = { 2: 0, 20: 90 }"
    content = TURNED.replace("CHILD", f'{turn}\n uniform token[] xformOpOrder = ["xformOp:rotateX"]\n CHILD')
    cache = stage(content, primvars=BOUND, codes_per_second=codes_per_second)
    codes = cache.times * codes_per_second
    assert np.diff(codes).max() < min(1, codes_per_second / 24) + 1e-6
    angle, tilt = np.pi * codes / 24, np.pi / 2 * np.clip((codes - 2) / 18, 0, 1)
    expected = np.stack([np.cos(angle), np.sin(angle) * np.cos(tilt), np.sin(angle) * np.sin(tilt)], axis=1)
    off = np.abs(positions_of(cache)[:, 1] - expected).max(axis=1)
    assert off.max() < 1e-3
    assert np.count_nonzero(off > 1e-6) <= 2


def test_joints_over_endless_time_codes_are_refused() -> None:
    with pytest.raises(FormatError, match="animated from time code 0 to 1e\\+12"):
        stage(TURNED.replace("24:", "1000000000000:"), primvars=BOUND)


def test_instances_are_read_with_their_own_transforms() -> None:
    prototype = 'class "prototype" {\nCHILD\n}'
    two = "".join(
        f'def Xform "copy{x}" (instanceable = true\n prepend inherits = </prototype>) {{\n double3 xformOp:translate = '
        f'({x}, 0, 0)\n uniform token[] xformOpOrder = ["xformOp:translate"]\n }}\n'
        for x in (5, 9)
    )
    assert positions_of(stage(f"{prototype}\n{two}"))[0, :, 0].tolist() == [5, 6, 5, 9, 10, 9]


def test_a_point_instancer_is_refused() -> None:
    with pytest.raises(UnsupportedError, match="/crowd is a PointInstancer"):
        stage('def PointInstancer "crowd" {\n rel prototypes = </crowd/mesh>\n CHILD\n}')


@pytest.mark.parametrize("orientation", ["rightHanded", "leftHanded"])
@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (-1, -2, 1), (-1, -1, -1)])
def test_faces_are_counter_clockwise_in_world_space(orientation: str, scale: tuple[float, ...]) -> None:
    """By the normal that the file has of the triangle's outer side, moved with it."""
    transform = f'double3 xformOp:scale = {scale}\n uniform token[] xformOpOrder = ["xformOp:scale"]'
    cache = stage(f'def Xform "x" {{\n {transform}\n CHILD\n}}', primvars=f'token orientation = "{orientation}"')
    first, second, third = positions_of(cache)[0][cache.faces[0]]
    outside = np.array([0, 0, 1 if orientation == "rightHanded" else -1]) / scale  # transformed as normals are
    assert np.dot(np.cross(second - first, third - first), outside) > 0

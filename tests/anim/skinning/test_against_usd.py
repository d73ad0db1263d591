"""A second opinion: usd-core's UsdSkel places the same vertices, with the same influences and joint matrices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.reading import reader
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene
from anim.sampling import sample_pose
from anim.sampling.pose import PosedSkeleton
from anim.sampling.times import frame_times
from anim.skinning.bake import prepare_bake
from anim.skinning.bound_mesh import BoundMesh
from tests.anim.skinning.odd_rigs import with_root_without_weight
from tests.files import opened_path

pxr = pytest.importorskip("pxr")
Find = Callable[[str], Path]


@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb", "Knight.glb", "Robot.glb"])
@pytest.mark.parametrize("method", ["lbs", "dqs"])
def test_usd_agrees(name: str, method: str, asset: Find) -> None:
    document = opened_path(asset(name))
    assert _compared(reader.scene(document), reader.clips(document)[::9], method) > 5


@pytest.mark.parametrize("method", ["lbs", "dqs"])
def test_usd_agrees_under_a_joint_without_weight_and_in_another_unit(method: str, asset: Find) -> None:
    document = opened_path(asset("CesiumMan.glb"))
    assert _compared(with_root_without_weight(reader.scene(document)), reader.clips(document), method) > 5


def _compared(of: Scene, clips: Sequence[Clip], method: str) -> int:
    """How many frames were compared of skinned meshes, all of them alike."""
    made = prepare_bake(of, method=method)
    compared = 0
    for played in clips:
        times = frame_times(played.start, played.end, fps=6)
        whole = made.bake(played, times=times).load_all().positions
        local = sample_pose(of.skeleton, played, times)
        frames = PosedSkeleton(of.skeleton, local)
        for layer in made.bind_each():
            if layer.instance.skin is None:
                continue
            found = whole[:, layer.at : layer.at + len(layer.rig.points)]
            wanted = _skinned(layer, layer.matrices(frames, slice(None)), method)
            assert np.abs(found - wanted).max() < 1e-5 * diagonal(of)
            compared += len(times)
    return compared


def _skinned(layer: BoundMesh, matrices: Floats, method: str) -> Floats:
    """Points (F, V, 3) as UsdSkel.SkinPoints has them."""
    from pxr import Gf, UsdSkel, Vt

    mesh = layer.instance.mesh
    kind: Any = UsdSkel.Tokens.classicLinear if method == "lbs" else UsdSkel.Tokens.dualQuaternion
    joints = Vt.IntArray.FromNumpy(mesh.joints.astype(np.int32).ravel())
    weights = Vt.FloatArray.FromNumpy(mesh.weights.astype(np.float32).ravel())
    result = []
    for frame in matrices:
        four = np.tile(np.eye(4), (len(frame), 1, 1))
        four[:, :3] = frame
        moves = Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(four.transpose(0, 2, 1)))
        points = Vt.Vec3fArray.FromNumpy(mesh.positions.astype(np.float32))
        assert UsdSkel.SkinPoints(kind, Gf.Matrix4d(1), moves, joints, weights, mesh.joints.shape[1], points)
        result.append(np.array(points, float))
    return np.stack(result)

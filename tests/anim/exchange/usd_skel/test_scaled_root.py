"""Skinned USD below an animated node with a scale: usd-core and Blender agree with our skinning."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.surface import diagonal
from anim.model import Clip, MeshInstance, Scene, Skin, Track
from anim.skinning.bake import bake
from tests.anim.exchange.usd_skel.test_write import largest_error, written
from tests.anim.skinning.odd_rigs import with_root
from tests.blender import needs_blender, vertices
from tests.clips import about
from tests.files import opened_fixture
from tests.usd import findings

pytest.importorskip("pxr", reason="usd-core is not installed")

MAX_ERROR_PER_DIAGONAL = 2e-6
FLOAT16_ERROR_PER_DIAGONAL = 1e-3  # of animated scales
TIMES = (0.0, 0.5, 1.0)
CASES: dict[str, dict[str, Any]] = {
    "0.01": {"scale": 0.01},
    "2": {"scale": 2.0},
    "100": {"scale": 100.0},
    "2, a joint of the skin": {"scale": 2.0, "in_skin": True},
    "100, at bind time too": {"scale": 100.0, "at_bind": True, "in_skin": True},
    "animated": {"scale": 1.0, "scales": (1.0, 2.0, 0.5)},
    "a joint's own": {"scale": 2.0, "joint": 1.5},
    "a joint's own, animated, and at bind time": {"scale": 1.0, "scales": (0.5, 1.0, 0.25), "joint_at_bind": 0.5},
}


def _wrapped(
    scale: float,
    *,
    in_skin: bool = False,
    at_bind: bool = False,
    scales: tuple[float, ...] = (),
    joint: float = 1.0,
    joint_at_bind: float = 1.0,
) -> tuple[Document, Scene, Clip]:
    """A figure below a node with a scale, which moves and rotates; joint: scale of a joint in the clip.

    scales: of the node; of the joint if that has another scale at bind time.
    """
    document = opened_fixture("arm")
    scene, clip = reader.scene(document, normals=True), reader.clips(document)[0]
    bare = with_root(scene.skeleton, "wrap")
    top = len(bare) - 1
    parents = np.where((bare.parents < 0) & (np.arange(top + 1) < top), top, bare.parents)
    sizes = np.concatenate((bare.scale[:top], [[scale] * 3]))
    size = scale * diagonal(scene)
    tracks = [
        Track(top, "translation", "LINEAR", TIMES, np.array([[0, 0, 0], [1, 0, 0.5], [0, 1, 0]]) * size),
        Track(top, "rotation", "LINEAR", TIMES, about("y", [0, 70, 20])),
    ]
    (skin,) = {instance.skin for instance in scene.instances if instance.skin is not None}
    if scales:
        scaled = top if joint_at_bind == 1 else int(skin.joints[1])
        tracks.append(Track(scaled, "scale", "LINEAR", TIMES, np.tile(scales, (3, 1)).T))
    if joint != 1:
        tracks.append(Track(int(skin.joints[1]), "scale", "LINEAR", TIMES, np.full((3, 3), joint)))
    targets = {track.target for track in tracks}
    kept = (track for track in clip.tracks if track.target not in targets)
    instances = tuple(_rebound(each, top, scale, in_skin=in_skin, at_bind=at_bind) for each in scene.instances)
    if joint_at_bind != 1:
        instances = tuple(_scaled_joint(each, joint_at_bind) for each in instances)
    return (
        document,
        Scene(replace(bare, parents=parents, scale=sizes), instances),
        Clip("c", (*kept, *tracks)),
    )


def _rebound(instance: MeshInstance, top: int, scale: float, *, in_skin: bool, at_bind: bool) -> MeshInstance:
    if instance.skin is None:
        return instance
    joints, binds = instance.skin.joints, instance.skin.inverse_bind
    if in_skin:
        joints, binds = np.append(joints, top), np.concatenate((binds, np.eye(4)[None, :3]))
    if at_bind:
        binds = np.concatenate((binds[..., :3] / scale, binds[..., 3:] / scale), axis=-1)
    return replace(instance, skin=Skin(joints, binds))


def _scaled_joint(instance: MeshInstance, scale: float) -> MeshInstance:
    if instance.skin is None:
        return instance
    binds = instance.skin.inverse_bind.copy()
    binds[1] /= scale
    return replace(instance, skin=Skin(instance.skin.joints, binds))


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_usd_core_agrees(case: dict[str, Any], tmp_path: Path) -> None:
    document, scene, clip = _wrapped(**case)
    path, result = written(document, scene, clip, tmp_path, fps=30)
    limit = FLOAT16_ERROR_PER_DIAGONAL if "scales" in case else MAX_ERROR_PER_DIAGONAL
    size = case["scale"] * diagonal(reader.scene(document))
    assert largest_error(path, scene, clip, result, 30) * diagonal(scene) < limit * size
    assert findings(path) == []


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_bind_transforms_have_no_scale(case: dict[str, Any], tmp_path: Path) -> None:
    """Blender's bones have none."""
    from pxr import Usd, UsdSkel

    document, scene, clip = _wrapped(**case)
    path, _ = written(document, scene, clip, tmp_path, fps=30)
    stage = Usd.Stage.Open(str(path))
    (skeleton,) = [UsdSkel.Skeleton(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton)]
    bind = np.array(skeleton.GetBindTransformsAttr().Get())[:, :3, :3]
    assert np.abs(np.linalg.norm(bind, axis=2) - 1).max() < 1e-6


@pytest.mark.slow
@needs_blender
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_blender_agrees(case: dict[str, Any], tmp_path: Path) -> None:
    document, scene, clip = _wrapped(**case)
    path, _ = written(document, scene, clip, tmp_path, fps=30)
    times = np.arange(0, 31, 5) / 30
    found = np.concatenate(list(vertices(path, times.tolist(), fps=30).values()), axis=1)
    expected = bake(scene, clip, times=times, rigid=True).load_all().positions
    apart = np.linalg.norm(found[:, :, None] - expected[:, None], axis=-1).min(axis=2)
    limit = FLOAT16_ERROR_PER_DIAGONAL if "scales" in case else 1e-5
    assert apart.max() < limit * case["scale"] * diagonal(reader.scene(document))

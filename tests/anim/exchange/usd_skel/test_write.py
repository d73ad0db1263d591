"""Skinned USD: usd-core's own skinning of the file has the vertices of our linear blending."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.caches.options import ReadOptions
from anim.caches.registry import reader_for
from anim.caches.storage import Memory
from anim.errors import NotFoundError, UnsupportedError
from anim.exchange.usd_skel import skeleton_group
from anim.exchange.usd_skel.sample_times import sample_times
from anim.exchange.usd_skel.stage import StageTimes
from anim.exchange.usd_skel.write import UsdSkelResult, write
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.surface import diagonal
from anim.model import Clip, MeshInstance, Scene, Skin, Track
from anim.skinning.bake import prepare_bake
from tests.anim.skinning.odd_rigs import with_root
from tests.files import opened_fixture, opened_path
from tests.usd import findings, opened_stage, skinned_stage, world_points

pytest.importorskip("pxr", reason="usd-core is not installed")

MAX_ERROR_PER_DIAGONAL = 1e-5  # of float32
Find = Callable[[str], Path]
NO_CLIP = Clip("", ())


def written(
    document: Document, scene: Scene, clip: Clip, folder: Path, ending: str = ".usdc", **more: Any
) -> tuple[Path, UsdSkelResult]:
    outputs = Memory(f"out{ending}")
    result = write(document, scene, clip, outputs, ending=ending, **more)
    for name, data in outputs.files.items():
        (folder / name).write_bytes(data)
    return folder / f"out{ending}", result


def largest_error(path: Path, scene: Scene, clip: Clip, result: UsdSkelResult, fps: float | None = None) -> float:
    """Largest distance of usd-core's vertices from ours at all samples, per diagonal."""
    stage, nodes = skinned_stage(path), list(result.paths)
    baker = prepare_bake(scene, rigid=True, nodes=nodes)
    times = sample_times(clip, result.fps, with_keys=fps is None)
    codes = StageTimes(times, result.fps).codes
    whole, worst = baker.bake(clip, times=times).load_all().positions, 0.0
    for code, expected in zip(codes, whole, strict=True):
        found = world_points(stage, code)
        for layer in baker.bind_each():
            rows = found[result.paths[layer.instance.node]]
            worst = max(worst, float(np.abs(rows - expected[layer.at : layer.at + len(rows)]).max()))
    return worst / diagonal(scene)


def compare(document: Document, clip: Clip, folder: Path, scene: Scene | None = None, **more: Any) -> UsdSkelResult:
    """Write, and compare with usd-core's skinning and validators."""
    scene = scene or reader.scene(document, normals=True)
    path, result = written(document, scene, clip, folder, **more)
    assert largest_error(path, scene, clip, result, more.get("fps")) < MAX_ERROR_PER_DIAGONAL
    assert findings(path) == []
    return result


@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb", "Knight.glb", "BitmojiRun.glb"])
def test_real_files(name: str, asset: Find, tmp_path: Path) -> None:
    document = opened_path(asset(name))
    for clip in reader.clips(document)[::40]:
        result = compare(document, clip, tmp_path)
        assert result.error.distance < 3e-3 * diagonal(reader.scene(document))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["Robot.glb", "MorphStressTest.glb", "BoxAnimated.gltf", "BusterDrone/busterDrone.gltf"]
)
def test_more_real_files(name: str, asset: Find, tmp_path: Path) -> None:
    document = opened_path(asset(name))
    for clip in reader.clips(document)[:2]:
        compare(document, clip, tmp_path)


@pytest.mark.parametrize("name", ["accessors", "arm", "interpolations", "morph_cube", "noop", "pointer", "wall"])
def test_fixtures(name: str, tmp_path: Path) -> None:
    document = opened_fixture(name)
    for clip in reader.clips(document) or (NO_CLIP,):
        compare(document, clip, tmp_path)


def test_the_same_bytes_twice(tmp_path: Path) -> None:
    document = opened_fixture("arm")
    scene, clip = reader.scene(document, normals=True), reader.clips(document)[1]
    for ending in (".usdc", ".usda", ".usdz"):
        first = written(document, scene, clip, tmp_path, ending)[0].read_bytes()
        assert written(document, scene, clip, tmp_path, ending)[0].read_bytes() == first


def arm() -> tuple[Document, Scene, Clip]:
    document = opened_fixture("arm")
    return document, reader.scene(document, normals=True), reader.clips(document)[1]


def test_metadata(tmp_path: Path) -> None:
    from pxr import UsdGeom, UsdSkel

    document, scene, clip = arm()
    stage = opened_stage(written(document, scene, clip, tmp_path, ".usdz", fps=25)[0])
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Y", 1)
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (25, 0, 25)
    assert stage.GetDefaultPrim().IsA(UsdSkel.Root)
    (animation,) = [UsdSkel.Animation(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation)]
    assert animation.GetRotationsAttr().GetTimeSamples() == list(range(26))
    assert not animation.GetScalesAttr().GetTimeSamples()
    (skeleton,) = [UsdSkel.Skeleton(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton)]
    joints = list(skeleton.GetJointsAttr().Get())
    assert joints[1].startswith(f"{joints[0]}/")
    assert list(animation.GetJointsAttr().Get()) == joints


def test_the_reader_of_caches_has_the_right_times(tmp_path: Path) -> None:
    """Samples of baked skins were scaled by the rate of the stage over 24."""
    document, scene, clip = arm()
    path, _ = written(document, scene, clip, tmp_path, fps=30)
    cache = reader_for(".usdc")(Memory("a.usdc", {"a.usdc": path.read_bytes()}), ReadOptions())
    assert cache.times[-1] == pytest.approx(1.0)
    truth = prepare_bake(scene, rigid=True).bake(clip, times=cache.times).load_all().positions
    assert cache.load_all().positions == pytest.approx(truth, abs=1e-5)


@pytest.mark.parametrize("scale", [0.01, -1.0, 123.456, 0.7])
def test_scales_that_float16_lacks(scale: float, tmp_path: Path) -> None:
    document, scene, clip = arm()
    (instance,) = scene.instances
    assert instance.skin is not None
    scales = scene.skeleton.scale.copy()
    scales[instance.skin.joints] *= np.where(np.arange(len(instance.skin.joints)) % 2, 1 / scale, scale)[:, None]
    skeleton = replace(scene.skeleton, scale=scales)
    kept = tuple(track for track in clip.tracks if track.path != "scale")
    compare(document, Clip("scaled", kept), tmp_path, Scene(skeleton, scene.instances))


def test_uneven_and_animated_scale_are_within_the_stated_error(tmp_path: Path) -> None:
    document, scene, clip = arm()
    (instance,) = scene.instances
    assert instance.skin is not None
    node = int(instance.skin.joints[-1])
    kept = [track for track in clip.tracks if (track.node, track.path) != (node, "scale")]
    moved = Track(node, "scale", "LINEAR", [0, 1], [[1, 1.2345, 0.9], [1.3333, 0.777, 1.1]])
    played = Clip("scaled", (*kept, moved))
    path, result = written(document, scene, played, tmp_path)
    error = largest_error(path, scene, played, result)
    assert MAX_ERROR_PER_DIAGONAL < error < 1e-3
    assert error * diagonal(scene) < result.error.distance * 1.01


def test_nodes_that_mirror_and_shear(tmp_path: Path) -> None:
    document, scene, clip = arm()
    (instance,) = scene.instances
    assert instance.skin is not None
    nodes, root = scene.skeleton, len(scene.skeleton)
    sheared = np.array([[-1, 0.5, 0, 1], [0, 2, 0, 0], [0.25, 0, 1, 0]])
    top = [i for i, parent in enumerate(nodes.parents.tolist()) if parent < 0]
    parents = np.append(nodes.parents, -1)
    parents[top] = root
    skeleton = replace(
        nodes,
        names=(*nodes.names, "above"),
        parents=parents,
        translation=np.append(nodes.translation, [[0.0, 0, 0]], axis=0),
        rotation=np.append(nodes.rotation, [[0.0, 0, 0, 1]], axis=0),
        scale=np.append(nodes.scale, [[1.0, 1, 1]], axis=0),
        sheared=np.array([root]),
        sheared_local=sheared[None],
    )
    compare(document, clip, tmp_path, Scene(skeleton, scene.instances))


def test_names_are_valid_and_different(tmp_path: Path) -> None:
    document, scene, clip = arm()
    skeleton = replace(
        scene.skeleton, names=tuple(["l'été 1/2", "", "materials", "\ud83d"][i % 4] for i in range(len(scene.skeleton)))
    )
    compare(document, clip, tmp_path, Scene(skeleton, scene.instances))
    skeleton = replace(scene.skeleton, names=("same",) * len(scene.skeleton))
    compare(document, clip, tmp_path, Scene(skeleton, scene.instances))


def with_second_skin(scene: Scene, change: Any) -> Scene:
    (instance,) = scene.instances
    assert instance.skin is not None
    binds = np.tile(np.eye(4), (len(instance.skin.joints), 1, 1))
    binds[:, :3] = instance.skin.inverse_bind
    second = Skin(instance.skin.joints, change(binds)[:, :3])
    return Scene(scene.skeleton, (instance, MeshInstance(instance.node, instance.mesh, second, instance.weights)))


def number_of_skeletons(path: Path) -> int:
    from pxr import UsdSkel

    stage = opened_stage(path)
    return sum(prim.IsA(UsdSkel.Skeleton) for prim in stage.Traverse())


def test_skins_share_a_skeleton_if_their_bind_poses_agree(tmp_path: Path) -> None:
    document, scene, clip = arm()
    (instance,) = scene.instances
    other = len(scene.skeleton)
    skeleton = with_root(scene.skeleton, "other")
    json = {
        **document.json,
        "nodes": [*document.json["nodes"], {"mesh": document.json["nodes"][instance.node]["mesh"]}],
    }
    two = Document(json, document.buffers)
    moved = np.diag([2.0, 2, 2, 1])
    moved[:3, 3] = (1, 2, 3)
    turned = np.linalg.inv(np.diag([0.5, 1, 1, 1]))
    for change, count in ((lambda m: m @ moved, 1), (lambda m: np.concatenate((m[:1] @ turned, m[1:])), 2)):
        pair = with_second_skin(scene, change).instances
        both = Scene(skeleton, (pair[0], replace(pair[1], node=other)))
        compare(two, clip, tmp_path, both)
        assert number_of_skeletons(tmp_path / "out.usdc") == count


@pytest.mark.parametrize("name", ["Knight.glb", "BitmojiRun.glb"])
def test_only_joints_move(name: str, asset: Find, tmp_path: Path) -> None:
    """Meshes below joints are bound to them, and what moves above joints is a joint: three.js plays no other prims."""
    from pxr import UsdGeom

    document = opened_path(asset(name))
    scene, clip = reader.scene(document, normals=True), reader.clips(document)[0]
    stage = opened_stage(written(document, scene, clip, tmp_path)[0])
    prims = [UsdGeom.Xformable(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Xformable)]
    assert not [each.GetPath() for each in prims if each.GetTimeSamples()]


def test_constant_weights_have_a_sample(asset: Find, tmp_path: Path) -> None:
    """Blender reads no default value of them."""
    from pxr import UsdSkel

    document = opened_path(asset("BitmojiRun.glb"))
    scene, clip = reader.scene(document, normals=True), reader.clips(document)[0]
    kept = Clip("still", tuple(track for track in clip.tracks if track.path != "weights"))
    stage = opened_stage(written(document, scene, kept, tmp_path)[0])
    (animation,) = [UsdSkel.Animation(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation)]
    attribute = animation.GetBlendShapeWeightsAttr()
    assert attribute.GetTimeSamples() == [0.0]
    assert np.array(attribute.Get(5.0)) == pytest.approx(np.minimum(scene.instances[0].weights, 1), abs=1e-6)


def test_refusals(tmp_path: Path) -> None:
    document, scene, clip = arm()
    flat = with_second_skin(scene, lambda m: m * 0).instances[1]
    with pytest.raises(UnsupportedError, match="has no inverse"):
        written(document, Scene(scene.skeleton, (flat,)), clip, tmp_path)
    with pytest.raises(NotFoundError, match="no mesh with faces"):
        written(document, Scene(scene.skeleton, ()), clip, tmp_path)


def test_all_joints_have_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document, scene, _ = arm()
    monkeypatch.setattr(skeleton_group, "MAX_JOINTS", 1)
    with pytest.raises(UnsupportedError, match="more than 1 joints in USD"):
        written(document, scene, NO_CLIP, tmp_path)


def test_steps_are_steep(tmp_path: Path) -> None:
    document, scene, _ = arm()
    (instance,) = scene.instances
    assert instance.skin is not None
    node = int(instance.skin.joints[-1])
    turned = np.array([[0, 0, 0, 1], [0, 0, 0.5**0.5, 0.5**0.5], [0, 0, 0, 1]])
    clip = Clip("steps", (Track(node, "rotation", "STEP", [0.25, 0.61, 1.0], turned),))
    _, result = written(document, scene, clip, tmp_path, fps=10)
    assert result.error.distance < 1e-5

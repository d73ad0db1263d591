"""`convert` to skinned USD: one clip, images, the stated error, and refusals."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.gltf.writing import writer
from tests import many
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import help_line, refusal, stated_length
from tests.files import glb_of, opened_path
from tests.textured import looks, textured
from tests.usd import findings, opened_stage

pytest.importorskip("pxr", reason="usd-core is not installed")


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "textured.glb"
    path.write_bytes(textured())
    return path


def test_a_file_per_clip(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    folder = tmp_path / "new"  # made, as for all names that are filled in
    assert call("convert", fixture("arm"), folder / "{clip}.usda", "--fps", "10", "--dry-run").code == 0
    assert not folder.exists()
    run = call("convert", fixture("arm"), folder / "{clip}.usda", "--fps", "10")
    assert run.code == 0
    assert "clip 'twist', 11 frames at 10 fps, max " in run.err
    for name in ("twist", "bend"):
        assert findings(folder / f"{name}.usda") == []
    assert (folder / "twist.usda").read_bytes() != (folder / "bend.usda").read_bytes()


def test_materials_and_images(call: Call, source: Path) -> None:
    from pxr import UsdShade

    images = [each[1] for each in looks(opened_path(source))["images"]]
    run = call("convert", source, source.with_name("a.usdz"), "--clip", "bend")
    assert run.code == 0
    for words in ("cameras are left out", "vertex colors are left out", "meshes of points and lines are left out"):
        assert run.err.count(words) == 1
    assert findings(source.with_name("a.usdz")) == []
    with zipfile.ZipFile(source.with_name("a.usdz")) as package:
        assert package.namelist() == ["scene.usdc", "image0.png", "image1.png", "image1-srgb.png"]
        assert [package.read(name) for name in package.namelist()[1:]] == [*images, images[1]]
    assert call("convert", source, source.with_name("b.usdc"), "--clip", "bend").code == 0
    assert [source.with_name(f"b.usdc-image{i}.png").read_bytes() for i in range(2)] == images
    assert findings(source.with_name("b.usdc")) == []
    stage = opened_stage(source.with_name("b.usdc"))
    bound = [
        str(UsdShade.MaterialBindingAPI(prim).GetDirectBinding().GetMaterialPath())
        for prim in stage.Traverse()
        if prim.GetTypeName() == "GeomSubset"
    ]
    assert bound == ["/root/materials/material0", "/root/materials/material1"]


def test_weights_outside_0_to_1(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    """Blender clamps them, so the targets are scaled; the error is that of usd-core's skinning."""
    from pxr import UsdSkel

    path, out = tmp_path / "a.glb", tmp_path / "a.usda"
    document = opened_path(fixture("morph_cube"))
    clip = reader.clips(document)[0]
    tracks = tuple(
        replace(each, values=3 * each.values - 1) if each.path == "weights" else each for each in clip.tracks
    )
    path.write_bytes(glb_of(writer.replace_clips(document, {0: replace(clip, tracks=tracks)})))
    run = call("convert", path, out, "--clip", "#0")
    assert run.code == 0, run.err
    assert "scaled or split in two, for weights from 0 to 1" in run.err
    assert findings(out) == []
    assert stated_length(run.err) < 1e-5
    stage = opened_stage(out)
    (animation,) = (UsdSkel.Animation(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation))
    attribute = animation.GetBlendShapeWeightsAttr()
    weights = np.array([attribute.Get(code) for code in attribute.GetTimeSamples()])
    assert (weights.min(), weights.max()) == pytest.approx((0, 1), abs=1e-6)
    assert any(name.endswith("_negative") for name in animation.GetBlendShapesAttr().Get())
    assert "scaled or split" not in call("convert", fixture("arm"), out, "--clip", "#0").err


def test_lights_and_cameras_are_noted(call: Call, source: Path) -> None:
    document, out = opened_path(source), source.with_name("a.usda")
    json = document.json
    json["extensionsUsed"].append("KHR_lights_punctual")
    json["extensions"]["KHR_lights_punctual"] = {"lights": [{"type": "point"}]}
    json["nodes"][0]["extensions"] = {"KHR_lights_punctual": {"light": 0}}
    lit = source.with_name("lit.glb")
    lit.write_bytes(glb_of(document))
    for command in ("convert", "bake"):
        assert call(command, lit, out, "--clip", "bend").err.count("note: lights are left out") == 1
        err = call(command, source, out, "--clip", "bend").err
        assert err.count("note: cameras are left out") == 1
        assert "lights are" not in err


def test_a_package_of_moving_points_is_not_for_phones(call: Call, source: Path) -> None:
    words = "Quick Look on phones does not play moving points"
    for command, ending, count in (("bake", "usdz", 1), ("bake", "usdc", 0), ("convert", "usdz", 0)):
        assert call(command, source, source.with_name(f"a.{ending}"), "--clip", "bend").err.count(words) == count


def test_images_beside_a_gltf_are_inside(call: Call, asset: Find, tmp_path: Path) -> None:
    assert call("convert", asset("CesiumMan-gltf/CesiumMan.gltf"), tmp_path / "a.usdz").code == 0
    with zipfile.ZipFile(tmp_path / "a.usdz") as package:
        assert package.read("image0.jpg") == asset("CesiumMan-gltf/CesiumMan_img0.jpg").read_bytes()


@pytest.mark.slow
def test_back_as_a_cache(call: Call, asset: Find, tmp_path: Path) -> None:
    """The vertices of the file, read as a cache, are those of a bake within the stated error."""
    skinned, cache, truth = (tmp_path / name for name in ("a.usdz", "a.npz", "b.npz"))
    assert call("convert", asset("CesiumMan.glb"), skinned, "--fps", "24").code == 0
    assert call("convert-cache", skinned, cache).code == 0
    assert call("bake", asset("CesiumMan.glb"), truth, "--fps", "24").code == 0
    with np.load(cache) as found, np.load(truth) as expected:
        assert found["times"] == pytest.approx(expected["times"], abs=1e-5)
        assert found["positions"] == pytest.approx(expected["positions"], abs=2e-5)
        assert np.array_equal(found["faces"], expected["faces"])


def test_a_note_on_a_visible_error(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("convert", fixture("biped"), tmp_path / "a.usdc", "--clip", "jump", "--fps", "5")
    assert "note: a vertex is " in run.err
    assert "of clip 'jump' (reduce with a higher --fps)" in run.err


def test_refusals(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    arm, out = fixture("arm"), tmp_path / "a.usdz"
    run = call("convert", arm, out)
    assert "2 clips are chosen, but USD holds one" in refusal(run, 2)
    assert "put {clip} into OUT" in help_line(run)
    assert "no clip matches 'bent'" in refusal(call("convert", arm, out, "--clip", "bent"), 5)
    assert "--fps is 0 (expected a number above 0)" in refusal(call("convert", arm, out, "--fps", "0"), 2)
    assert "--embed does not apply to USD" in refusal(call("convert", arm, out, "--embed"), 2)
    assert "--clip applies to USD only" in refusal(call("convert", arm, tmp_path / "a.glb", "--clip", "bend"), 2)
    assert "{mesh} stands for nothing" in refusal(call("convert", arm, tmp_path / "{mesh}.usdz"), 2)
    assert not list(tmp_path.glob("*.usd*"))


def test_a_folder(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    fixture("arm")
    assert call("convert", tmp_path, "-o", f"{tmp_path}/out/{{stem}}.usdz", "--clip", "#0", "--fps", "5").code == 0
    assert findings(tmp_path / "out" / "arm.usdz") == []


def test_a_dry_run_writes_nothing(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("convert", fixture("arm"), tmp_path / "a.usdz", "--clip", "bend", "-n")
    assert run.code == 0
    assert "(dry run: nothing written)" in run.err
    assert not (tmp_path / "a.usdz").exists()


def test_a_deep_hierarchy_is_refused_before_usd_takes_minutes_for_it(call: Call, tmp_path: Path) -> None:
    path, out = tmp_path / "deep.glb", tmp_path / "out.usdc"
    for count, expected in ((1000, 0), (1001, 4), (10_000, 4)):
        path.write_bytes(many.chain_mesh(count))
        run = call("convert", path, out)
        assert run.code == expected
        assert expected == 0 or f"meshes hang on {count} levels of nodes" in run.err


def test_joints_whose_paths_take_too_much_are_refused(call: Call, tmp_path: Path) -> None:
    """In a line of joints they grow with the square of their number."""
    path, out = tmp_path / "deep.glb", tmp_path / "out.usdc"
    for count, expected in ((500, 0), (3000, 4)):
        path.write_bytes(many.joints(count))
        run = call("convert", path, out)
        assert run.code == expected
        assert expected == 0 or "the paths of 3000 joints take more than 10 MB in USD" in run.err

"""`bake` to USD with materials: judged by usd-core's validators, and byte for byte by the images and coordinates."""

from __future__ import annotations

import sys
import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import materials
from anim.gltf.reading.accessors import Accessors
from tests.cli.conftest import Call, Find
from tests.files import glb_of, opened_path
from tests.textured import looks, textured
from tests.usd import findings, opened_stage

pytest.importorskip("pxr", reason="usd-core is not installed")

ASSETS = [
    ("Fox.glb", "Survey"),
    ("CesiumMan.glb", "#0"),
    pytest.param("Knight.glb", "Cheer", marks=pytest.mark.slow),
    ("BitmojiRun.glb", "lbr_run_normal_anm_default"),
]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "textured.glb"
    path.write_bytes(textured())
    return path


@pytest.mark.parametrize("ending", ["usdc", "usda", "usdz"])
@pytest.mark.parametrize("up", ["y", "z"])
def test_usd_cores_validators_find_nothing(call: Call, source: Path, ending: str, up: str) -> None:
    out = source.with_name(f"out.{ending}")
    run = call("bake", source, out, "--clip", "bend", "--rigid", "--up", up)
    assert run.code == 0, run.err
    assert findings(out) == []
    assert "vertex colors are left out" in run.err
    assert "the scale of normal maps is left out" in run.err


@pytest.mark.slow
@pytest.mark.parametrize(("name", "clip"), ASSETS)
def test_real_files(call: Call, asset: Find, tmp_path: Path, name: str, clip: str) -> None:
    out = tmp_path / "out.usdz"
    assert call("bake", asset(name), out, "--clip", clip, "--fps", "8").code == 0
    assert findings(out) == []
    first = out.read_bytes()
    time.sleep(2.1)  # the resolution of a ZIP file's times
    assert call("bake", asset(name), tmp_path / "again.usdz", "--clip", clip, "--fps", "8").code == 0
    assert (tmp_path / "again.usdz").read_bytes() == first
    document = opened_path(asset(name))
    with zipfile.ZipFile(out) as package:
        stored = [package.read(each) for each in package.namelist()[1:]]
    assert set(stored) <= {each[1] for each in looks(document)["images"]}
    assert len(stored) >= (1 if document.json.get("textures") else 0)


def test_images_beside_and_inside(call: Call, source: Path) -> None:
    images = [each[1] for each in looks(opened_path(source))["images"]]
    assert call("bake", source, source.with_name("a.usdz"), "--clip", "bend").code == 0
    with zipfile.ZipFile(source.with_name("a.usdz")) as package:
        assert package.namelist() == ["cache.usdc", "image0.png", "image1.png", "image1-srgb.png"]
        assert [package.read(name) for name in package.namelist()[1:]] == [*images, images[1]]
    run = call("bake", source, source.with_name("a.usda"), "--clip", "bend")
    assert "4 files" in run.err
    assert [source.with_name(f"a.usda-image{i}.png").read_bytes() for i in range(2)] == images
    piped = call("bake", source, "-", "--format", "usdc", "--clip", "bend")
    assert (
        "not written, since the output is a pipe: stdout-image0.png, stdout-image1.png, stdout-image1-srgb.png"
        in piped.err
    )


def test_faces_are_bound_to_their_materials(call: Call, source: Path) -> None:
    from pxr import UsdGeom, UsdShade

    assert call("bake", source, source.with_name("a.usda"), "--clip", "bend", "--rigid").code == 0
    stage = opened_stage(source.with_name("a.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/root/mesh"))
    subsets = UsdGeom.Subset.GetAllGeomSubsets(mesh)
    assert [len(each.GetIndicesAttr().Get()) for each in subsets] == [1, 8, 8]
    bound = [UsdShade.MaterialBindingAPI(each).ComputeBoundMaterial()[0].GetPath() for each in subsets]
    names = ["default_material", "material0", "material1"]  # Blender takes the first one for unbound faces
    assert [str(each) for each in bound] == [f"/root/materials/{name}" for name in names]
    assert UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsetsFamilyType() == "partition"


def surface(stage: Any, number: int) -> Any:
    """The surface shader of a material, while its stage is open."""
    from pxr import UsdShade

    return UsdShade.Shader(stage.GetPrimAtPath(f"/root/materials/material{number}/surface"))


@pytest.mark.parametrize(
    ("material", "threshold", "constant"),
    [
        ({"alphaMode": "MASK"}, 1.0, 1.0),
        ({"alphaMode": "MASK", "alphaCutoff": 0.25}, 0.5, 1.0),
        ({"alphaMode": "MASK", "alphaCutoff": 0.75}, 1.5, 0.0),
        ({"alphaMode": "MASK", "alphaCutoff": 0}, None, None),
        ({"alphaMode": "BLEND"}, None, 0.5),
        ({"alphaMode": "OPAQUE"}, None, None),
    ],
)
def test_opacity(
    call: Call, source: Path, material: dict[str, Any], threshold: float | None, constant: float | None
) -> None:
    """A mask has no factor in its texture, which three.js and Blender ignore; without a texture it is 0 or 1."""
    document, out = opened_path(source), source.with_name("a.usda")
    about = document.json["materials"][1]
    about |= material
    about["pbrMetallicRoughness"]["baseColorFactor"] = [0.25, 0.5, 1, 0.5]
    source.write_bytes(glb_of(document))
    assert call("bake", source, out, "--clip", "bend").code == 0
    assert findings(out) == []
    stage = opened_stage(out)
    shader = surface(stage, 1)
    assert (shader.GetInput("opacityThreshold").Get() if shader.GetInput("opacityThreshold") else None) == threshold
    opacity = shader.GetInput("opacity")
    assert (opacity.Get() if opacity else None) == constant
    if opacity:
        texture, channel, _ = opacity.GetConnectedSource()
        assert channel == "a"
        scale = texture.GetPrim().GetAttribute("inputs:scale").Get()
        assert tuple(scale) == (1, 1, 1, 0.5 if material["alphaMode"] == "BLEND" else 1)


def test_an_image_in_two_color_spaces_is_two_files(call: Call, source: Path) -> None:
    """Blender has one color space for a file: that of a normal map would be wrong as a color."""
    assert call("bake", source, source.with_name("a.usda"), "--clip", "bend").code == 0
    stage, found = opened_stage(source.with_name("a.usda")), {}
    for number, name in ((0, "normal"), (1, "diffuseColor")):
        texture, _, _ = surface(stage, number).GetInput(name).GetConnectedSource()
        prim = texture.GetPrim()
        found[prim.GetAttribute("inputs:file").Get().path] = prim.GetAttribute("inputs:sourceColorSpace").Get()
    assert found == {"./a.usda-image1.png": "raw", "./a.usda-image1-srgb.png": "sRGB"}


def test_texture_coordinates_sample_the_same_texels(call: Call, source: Path) -> None:
    """Coordinates through USD's own formula of the transform are those of glTF, with v from the bottom."""
    from pxr import UsdGeom, UsdShade

    assert call("bake", source, source.with_name("a.usda"), "--clip", "bend").code == 0
    stage = opened_stage(source.with_name("a.usda"))
    document = opened_path(source)
    coordinates = np.array(UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/root/mesh")).GetPrimvar("st1").Get())[18:]
    shader = UsdShade.Shader(stage.GetPrimAtPath("/root/materials/material1/diffuseColor_transform"))
    rotation, scale, translation = (shader.GetInput(name).Get() for name in ("rotation", "scale", "translation"))
    angle = np.radians(rotation)
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = (coordinates * scale) @ turned.T + translation
    texture = materials.read_materials(document)[1].texture
    assert texture is not None
    uv = Accessors(document).floats(document.json["meshes"][0]["primitives"][1]["attributes"]["TEXCOORD_1"])
    expected = uv @ texture.transform[:, :2].T + texture.transform[:, 2]
    assert found == pytest.approx(np.stack((expected[:, 0], 1 - expected[:, 1]), axis=1), abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["usdc", "usdz"])
def test_back_again(call: Call, source: Path, ending: str) -> None:
    out, back, truth = (source.with_name(name) for name in (f"a.{ending}", "back.npz", "truth.npz"))
    assert call("bake", source, out, "--clip", "bend", "--up", "z").code == 0
    assert call("convert-cache", out, back).code == 0
    assert call("convert-cache", "-", source.with_name("b.npz"), stdin=out.read_bytes()).code == 0
    assert call("bake", source, truth, "--clip", "bend", "--up", "z", "--normals").code == 0
    with np.load(back) as found, np.load(truth) as expected:
        assert found["positions"] == pytest.approx(expected["positions"], abs=1e-6)
        assert np.array_equal(found["faces"], expected["faces"])
        assert found["times"] == pytest.approx(expected["times"])


def test_onto_a_source(call: Call, source: Path) -> None:
    cache, baked, onto = (source.with_name(name) for name in ("a.npz", "a.usdz", "b.usdz"))
    assert call("bake", source, cache, "--clip", "bend", "--vertex-tangents").code == 0
    assert call("bake", source, baked, "--clip", "bend").code == 0
    assert call("convert-cache", cache, onto, "--onto", source).code == 0
    assert onto.read_bytes() == baked.read_bytes()


@pytest.mark.skipif(sys.platform != "linux", reason="file names of other systems are text")
def test_an_image_whose_name_is_no_text_is_refused(call: Call, source: Path) -> None:
    run = call("bake", source, source.with_name("\udcff.usda"), "--clip", "#0")
    assert (run.code, "no UTF-8" in run.err) == (4, True)
    assert list(source.parent.iterdir()) == [source]


def test_a_texture_that_usd_cannot_show(call: Call, source: Path) -> None:
    document = opened_path(source)
    document.json["textures"][0] = {"extensions": {"EXT_texture_webp": {"source": 0}}}
    document.json["materials"][1]["extensions"] = {"KHR_materials_unlit": {}}
    source.write_bytes(glb_of(Document(document.json, document.buffers)))
    run = call("bake", source, source.with_name("a.usda"), "--clip", "bend")
    assert "note: a texture of material 0 is left out: is neither PNG nor JPEG" in run.err
    assert findings(source.with_name("a.usda")) == []
    stage = opened_stage(source.with_name("a.usda"))
    surface = stage.GetPrimAtPath("/root/materials/material1/surface")
    assert tuple(surface.GetAttribute("inputs:diffuseColor").Get()) == (0, 0, 0)
    assert surface.GetAttribute("inputs:emissiveColor").GetConnections()

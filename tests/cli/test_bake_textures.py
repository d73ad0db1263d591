"""`bake` to textures with materials: the mesh keeps its texture coordinates, and has the look-up in a free set."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.reading.accessors import Accessors
from tests.cli.conftest import Call, Find
from tests.cli.running import refusal
from tests.files import glb_of, opened_path
from tests.khronos import errors, needs_validator, validate
from tests.textured import looks, textured


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "textured.glb"
    path.write_bytes(textured())
    return path


@needs_validator
def test_the_mesh_keeps_everything_but_the_skin(call: Call, source: Path) -> None:
    out = source.with_name("a.png")
    assert call("bake", source, out, "--clip", "bend", "--fps", "16").code == 0
    mesh = source.with_name("a.png-mesh.glb")
    assert errors(validate(mesh.read_bytes())) == []
    document, before = opened_path(mesh), opened_path(source)
    found, expected = looks(document), looks(before)
    for primitive in found["meshes"][0][2]:
        primitive["attributes"].pop("TEXCOORD_2")
    assert found["meshes"][0] == expected["meshes"][0]
    assert found["images"] == expected["images"]
    assert found["materials"] == expected["materials"]
    assert [node["mesh"] for node in document.json["nodes"] if "mesh" in node] == [0]
    assert not {"skins", "animations"} & document.json.keys()


def test_the_lookup_is_the_pixel_of_the_vertex(call: Call, source: Path) -> None:
    assert call("bake", source, source.with_name("a.png"), "--clip", "bend", "--fps", "16").code == 0
    about = json.loads(source.with_name("a.png.json").read_text())
    assert about["uv_set"] == 2
    document = opened_path(source.with_name("a.png-mesh.glb"))
    accessors = Accessors(document)
    primitives = document.json["meshes"][0]["primitives"]
    rows = np.concatenate([accessors.floats(each["attributes"]["TEXCOORD_2"]) for each in primitives])
    assert rows[:, 0] == pytest.approx((np.arange(36) + 0.5) / 36, abs=1e-6)
    assert rows[:, 1] == pytest.approx(0.5 / about["height"], abs=1e-6)


def test_back_again(call: Call, source: Path) -> None:
    out, back = source.with_name("a.png"), source.with_name("b.npz")
    assert call("bake", source, out, "--clip", "bend", "--fps", "16").code == 0
    assert call("bake", source, source.with_name("c.npz"), "--clip", "bend", "--fps", "16").code == 0
    assert call("convert-cache", out, back).code == 0
    with np.load(back) as found, np.load(source.with_name("c.npz")) as truth:
        assert found["positions"] == pytest.approx(truth["positions"], abs=1e-4)
        assert np.array_equal(found["faces"], truth["faces"])
    assert call("convert-cache", back, source.with_name("d.png"), "--onto", source).code == 0
    assert json.loads(source.with_name("d.png.json").read_text())["uv_set"] == 2


def test_several_meshes(call: Call, asset: Find, tmp_path: Path) -> None:
    out, back, truth = (tmp_path / name for name in ("a.png", "b.npz", "c.npz"))
    assert call("bake", asset("Knight.glb"), out, "--clip", "Idle", "--fps", "4").code == 0
    assert call("bake", asset("Knight.glb"), truth, "--clip", "Idle", "--fps", "4").code == 0
    assert call("convert-cache", out, back).code == 0
    with np.load(back) as found, np.load(truth) as expected:
        assert found["positions"] == pytest.approx(expected["positions"], abs=1e-3)
        assert np.array_equal(found["faces"], expected["faces"])


def test_godot_reads_two_sets(call: Call, source: Path) -> None:
    pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    bake = ("bake", source, source.with_name("a.exr"), "--clip", "bend", "--preset", "godot")
    document = opened_path(source)
    skinned = glb_of(document)
    assert "preset godot: its meshes have 2 sets" in call(*bake).err
    assert call(*bake).code == 4
    for primitive in document.json["meshes"][0]["primitives"]:
        del primitive["attributes"]["TEXCOORD_1"]
    source.write_bytes(glb_of(document))
    run = call(*bake)
    assert run.code == 0
    assert "not Static Lightmaps" in run.err
    assert skinned != source.read_bytes()
    assert "does not apply" in refusal(call("convert-cache", source.with_name("a.exr"), "-", "--onto", source), 2)


def test_a_look_up_in_the_third_set_is_noted_for_unity(call: Call, source: Path) -> None:
    bake = ("bake", source, source.with_name("a.png"), "--clip", "bend", "--preset", "unity")
    words = "note: the look-up is in set 2 (from 0 on)"
    assert words in call(*bake).err
    document = opened_path(source)
    for primitive in document.json["meshes"][0]["primitives"]:
        del primitive["attributes"]["TEXCOORD_1"]
    source.write_bytes(glb_of(document))
    assert words not in call(*bake).err


def test_obj_files_keep_texture_coordinates_and_materials(call: Call, source: Path) -> None:
    document = opened_path(source)
    assert call("bake", source, source.with_name("a.obj"), "--clip", "bend", "--rigid").code == 0
    lines = source.with_name("a_00003.obj").read_text().splitlines()
    assert "mtllib a.obj.mtl" in lines
    rows = np.array([line.split()[1:] for line in lines if line.startswith("vt ")], float)
    uv = Accessors(document).floats(document.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"])
    assert rows[:18] == pytest.approx(np.stack((uv[:, 0], 1 - uv[:, 1]), axis=1), abs=1e-6)
    assert [line for line in lines if line.startswith("usemtl")] == ["usemtl material0", "usemtl material1"]
    library = source.with_name("a.obj.mtl").read_text()
    assert "newmtl material1\nKd 1 1 1\nd 1\nmap_Kd a.obj-image1.png" in library
    images = [each[1] for each in looks(document)["images"]]
    assert [source.with_name(f"a.obj-image{i}.png").read_bytes() for i in range(2)] == images


@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_mesh_files_with_coordinates_are_read(call: Call, source: Path, ending: str) -> None:
    import trimesh

    assert call("bake", source, source.with_name(f"a.{ending}"), "--clip", "bend", "--normals").code == 0
    assert call("bake", source, source.with_name("truth.npz"), "--clip", "bend", "--normals").code == 0
    assert call("convert-cache", source.with_name(f"a.{ending}"), source.with_name("b.npz")).code == 0
    with np.load(source.with_name("b.npz")) as found, np.load(source.with_name("truth.npz")) as truth:
        assert found["positions"] == pytest.approx(truth["positions"], abs=1e-6)
        assert found["normals"] == pytest.approx(truth["normals"], abs=1e-5)
        assert np.array_equal(found["faces"], truth["faces"])
    seen = trimesh.load(source.with_name(f"a_00001.{ending}"), process=False)
    if ending == "obj":
        assert seen is not None
    else:
        assert b"property float s\nproperty float t" in source.with_name("a_00001.ply").read_bytes()[:400]

"""`bake` to .glb: the source file with other vertices, everything else as it was."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.surface import diagonal
from tests.cli.conftest import Call, Find
from tests.cli.running import help_line, refusal, stated_length
from tests.files import glb_of, mark_slow, opened_path
from tests.judge import needs_judge, vertices
from tests.khronos import errors, needs_validator, validate
from tests.textured import UNKNOWN, looks

ASSETS = [
    pytest.param("Fox.glb", "Survey", marks=pytest.mark.slow),
    ("CesiumMan.glb", "#0"),
    pytest.param("Knight.glb", "Cheer", marks=pytest.mark.slow),
    ("BitmojiRun.glb", "lbr_run_normal_anm_default"),
]
FLOAT_ERROR_PER_DIAGONAL = 1e-6  # of sums of targets, which players compute in float32


def baked(call: Call, textured_path: Path, *options: str) -> Document:
    out = textured_path.with_name("out.glb")
    run = call("bake", textured_path, out, *options)
    assert run.code == 0, run.err
    return opened_path(out)


@pytest.mark.parametrize("layout", ["morph", "flip-scale", "flip-visibility"])
@pytest.mark.parametrize("space", ["world", "mesh"])
def test_only_vertices_change(call: Call, textured_path: Path, layout: str, space: str) -> None:
    document = baked(call, textured_path, "--clip", "bend", "--layout", layout, "--space", space)
    before, after = looks(opened_path(textured_path)), looks(document)
    pages = after["meshes"][3:]
    after["meshes"] = after["meshes"][:3]
    assert after == before
    assert all(each == after["meshes"][0] for each in pages)
    assert set(document.json["extensionsUsed"]) >= {"KHR_texture_transform", "KHR_materials_variants", UNKNOWN}
    assert "skins" not in document.json
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    assert set(attributes) == {"POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "_WEAR"}


def test_nodes_keep_their_indices_and_names(call: Call, textured_path: Path) -> None:
    nodes = opened_path(textured_path).json["nodes"]
    json = baked(call, textured_path, "--clip", "bend").json
    assert [each.get("name") for each in json["nodes"]] == [each.get("name") for each in nodes]
    assert json["nodes"][4] == {"name": "body", "mesh": 0, "extras": {"keep": [1]}}
    assert json["nodes"][6] == nodes[6]
    assert json["scenes"] == [{"name": "stage", "nodes": [0, 4]}]


def test_channels_that_move_something_stay(call: Call, textured_path: Path) -> None:
    """The camera is below the joints, so their channels matter; without it they move nothing."""
    targets = [
        each["target"] for each in baked(call, textured_path, "--clip", "bend").json["animations"][0]["channels"]
    ]
    assert targets[0] == {"node": 4, "path": "weights"}
    assert targets[1:] == [{"node": 2, "path": "rotation"}, {"node": 5, "path": "translation"}]
    document = opened_path(textured_path)
    del document.json["nodes"][3]["camera"]
    textured_path.write_bytes(glb_of(document))
    json = baked(call, textured_path, "--clip", "bend").json
    assert [each["target"]["node"] for each in json["animations"][0]["channels"]] == [4, 5]
    assert len(json["animations"]) == 1
    assert json["animations"][0]["name"] == "bend"
    assert json["animations"][0]["extras"] == {"clip": "bend"}
    json = baked(call, textured_path, "--clip", "bend", "--keep-skeleton").json
    assert [each["target"]["node"] for each in json["animations"][0]["channels"]] == [4, 2, 5]
    assert len(json["skins"]) == 1


def test_normals_are_baked_where_a_material_is_lit(call: Call, textured_path: Path) -> None:
    def names(*options: str) -> set[str]:
        primitive = baked(call, textured_path, "--clip", "bend", *options).json["meshes"][0]["primitives"][0]
        return set(primitive["attributes"]) & {"NORMAL", "TANGENT"} | set(primitive["targets"][0])

    assert names() == {"POSITION", "NORMAL", "TANGENT"}
    assert names("--no-normals") == {"POSITION"}
    assert names("--no-vertex-tangents") == {"POSITION", "NORMAL"}
    document = opened_path(textured_path)
    for material in document.json["materials"]:
        material.setdefault("extensions", {})["KHR_materials_unlit"] = {}
    textured_path.write_bytes(glb_of(document))
    assert names() == {"POSITION"}


def test_other_meshes_stay_unless_meshes_are_selected(call: Call, textured_path: Path) -> None:
    def meshes(*options: str) -> list[str]:
        json = baked(call, textured_path, "--clip", "bend", *options).json
        return [json["meshes"][each["mesh"]]["name"] for each in json["nodes"] if "mesh" in each]

    assert meshes() == ["strip", "flag", "dust"]
    assert meshes("--mesh", "strip") == ["strip"]
    assert meshes("--rigid") == ["strip", "flag", "dust"]


@needs_validator
def test_the_data_of_meshes_that_are_left_out_is_gone(call: Call, asset: Find, tmp_path: Path) -> None:
    out = tmp_path / "body.glb"
    assert call("bake", asset("Knight.glb"), out, "--clip", "Cheer", "--mesh", "Knight_Body", "--fps", "4").code == 0
    json = opened_path(out).json
    (mesh,) = json["meshes"]
    assert [node["mesh"] for node in json["nodes"] if "mesh" in node] == [0]
    used = json["accessors"][mesh["primitives"][0]["attributes"]["TEXCOORD_0"]]["count"]
    assert {each["count"] for each in json["accessors"] if each["type"] == "VEC2"} == {used}
    if validate is not None:
        assert errors(validate(out.read_bytes())) == []


def test_meshes_stay_if_an_unknown_extension_may_name_them(call: Call, textured_path: Path) -> None:
    document = opened_path(textured_path)
    document.json["extensions"][UNKNOWN]["mesh"] = 2
    textured_path.write_bytes(glb_of(document))
    assert len(baked(call, textured_path, "--clip", "bend", "--mesh", "strip").json["meshes"]) == 3


def test_a_bake_of_a_range(call: Call, textured_path: Path) -> None:
    out = textured_path.with_name("out.npz")
    assert call("bake", textured_path, out, "--clip", "bend", "--from", "0.2", "--to", "0.75").code == 0
    assert np.load(out)["times"].tolist() == pytest.approx([0.2, 0.25, 0.5, 0.75])
    assert call("bake", textured_path, out, "--clip", "bend", "--from", "0.5", "--fps", "8").code == 0
    assert np.load(out)["times"].tolist() == pytest.approx([0.5, 0.625, 0.75, 0.875, 1])
    assert "the clip goes from 0 s to 1 s" in refusal(
        call("bake", textured_path, textured_path.with_name("x.glb"), "--clip", "bend", "--from", "3"), 2
    )
    document = baked(call, textured_path, "--clip", "bend", "--from", "0.2", "--to", "0.75")
    (clip,) = reader.clips(document)
    assert {(round(float(each.times[0]), 6), round(float(each.times[-1]), 6)) for each in clip.tracks} == {(0.2, 0.75)}


def test_a_range_beyond_the_clip_is_noted(call: Call, textured_path: Path) -> None:
    out = textured_path.with_name("out.npz")
    run = call("bake", textured_path, out, "--clip", "bend", "--from", "-1", "--to", "2")
    assert run.code == 0
    assert "note: --from is -1 s, but clip 'bend' begins at 0 s" in run.err
    assert "note: --to is 2 s, but clip 'bend' ends at 1 s" in run.err
    assert np.load(out)["times"].tolist() == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    many = call("bake", textured_path, textured_path.with_name("{clip}.npz"), "--from", "-1", "--to", "1").err
    assert "clip 'bend' begins at 0 s, and 1 more" in many
    assert "--to" not in many


def test_convert_cache_onto_is_bake(call: Call, textured_path: Path) -> None:
    baked(call, textured_path, "--clip", "bend")
    cache, onto = textured_path.with_name("a.npz"), textured_path.with_name("onto.glb")
    assert call("bake", textured_path, cache, "--clip", "bend", "--vertex-tangents").code == 0
    assert call("convert-cache", cache, onto, "--onto", textured_path, "--clip", "bend").code == 0
    assert onto.read_bytes() == textured_path.with_name("out.glb").read_bytes()
    assert call("bake", textured_path, textured_path.with_name("a.pc2"), "--clip", "bend").code == 0
    assert call("convert-cache", textured_path.with_name("a.pc2"), onto, "--onto", textured_path).code == 0
    assert looks(opened_path(onto)) == looks(opened_path(textured_path))


def test_refusals_of_onto(call: Call, textured_path: Path, fixture: Any) -> None:
    cache, out = textured_path.with_name("a.npz"), textured_path.with_name("x.glb")
    assert call("bake", textured_path, cache, "--clip", "bend").code == 0
    run = call("convert-cache", cache, out, "--onto", fixture("arm"))
    assert "the cache has 36 vertices, the meshes of the source have 530" in refusal(run, 2)
    assert "in the order of the file" in help_line(run)
    assert "--onto does not apply to .npz" in refusal(call("convert-cache", cache, "b.npz", "--onto", textured_path), 2)
    refused = call("convert-cache", cache, out, "--clip", "bend")
    assert "--clip needs --onto FILE: it names the clip of FILE that IN is a bake of" in refusal(refused, 2)
    assert help_line(refused) == "to bake a clip of a glTF file: gltf-anim bake IN OUT --clip GLOB"
    assert "--keep-skeleton does not apply" in refusal(call("bake", textured_path, cache, "--keep-skeleton"), 2)


def test_at_most_256_targets(call: Call, textured_path: Path, tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    cache = tmp_path / "noise.npz"
    assert call("bake", textured_path, cache, "--clip", "bend").code == 0
    with np.load(cache) as file:
        arrays = dict(file)
    arrays["times"] = np.arange(300.0)
    arrays["positions"] = random.normal(size=(300, 200, 3)).astype(np.float32)
    faces = np.zeros((0, 3), arrays["faces"].dtype)
    np.savez(cache, **{key: arrays[key] for key in ("times", "positions")}, faces=faces)
    run = call("convert-cache", cache, tmp_path / "noise.glb", "--max-error", "0.1mm")
    assert "256 morph targets can't keep every vertex within 0.0001 m" in refusal(run, 2)
    assert "WebGL2 promises 256" in help_line(run)
    run = call("convert-cache", cache, tmp_path / "noise.glb", "--max-error", "0.1mm", "--max-targets", "400")
    assert run.code == 0
    assert "299 morph targets" in run.err


@needs_validator
@pytest.mark.parametrize("layout", mark_slow(["morph", "flip-scale", "flip-visibility"], slow=["flip-scale"]))
@pytest.mark.parametrize(
    "options",
    [
        (),
        pytest.param(("--space", "mesh"), marks=pytest.mark.slow),
        ("--rigid",),
        pytest.param(("--keep-skeleton",), marks=pytest.mark.slow),
        pytest.param(("--fps", "0.5"), marks=pytest.mark.slow),
    ],
)
def test_the_validator_finds_nothing_new(
    call: Call, textured_path: Path, layout: str, options: tuple[str, ...]
) -> None:
    assert errors(validate(textured_path.read_bytes())) == []
    baked(call, textured_path, "--clip", "bend", "--layout", layout, *options)
    report = validate(textured_path.with_name("out.glb").read_bytes())
    assert errors(report) == []
    assert report["issues"]["numWarnings"] == 0 or "--rigid" in options  # whose meshes have no tangents


@needs_validator
def test_quantized_targets_in_mesh_space(call: Call, textured_path: Path) -> None:
    document = baked(call, textured_path, "--clip", "bend", "--quantize", "--space", "mesh")
    assert errors(validate(glb_of(document))) == []
    assert "KHR_mesh_quantization" in document.json["extensionsRequired"]


@needs_validator
@pytest.mark.parametrize(("name", "clip"), ASSETS)
def test_real_files_keep_materials_images_and_texture_coordinates(
    call: Call, asset: Find, tmp_path: Path, name: str, clip: str
) -> None:
    out = tmp_path / name
    assert call("bake", asset(name), out, "--clip", clip).code == 0
    before, after = looks(opened_path(asset(name))), looks(opened_path(out))
    assert after == before
    if validate is not None:
        assert errors(validate(out.read_bytes())) == []
    again = tmp_path / "again.glb"
    assert call("bake", asset(name), again, "--clip", clip).code == 0
    assert again.read_bytes() == out.read_bytes()


@pytest.mark.slow
@needs_judge
@pytest.mark.parametrize(("name", "clip"), [*ASSETS, ("", "bend")])
def test_three_shows_the_source_within_the_stated_error(
    call: Call, asset: Find, textured_path: Path, tmp_path: Path, name: str, clip: str
) -> None:
    path, out = asset(name) if name else textured_path, tmp_path / "out.glb"
    run = call("bake", path, out, "--clip", clip, "--rigid", "--max-error", "0.01%")
    assert run.code == 0
    document = opened_path(path)
    clips = reader.clips(document)
    number = next((i for i, each in enumerate(clips) if each.name == clip), 0)
    keys = clips[number].key_times
    size = diagonal(reader.scene(document))
    stated = stated_length(run.err)
    for time in (keys[1], keys[len(keys) // 2], keys[-2]):
        truth, found = vertices(path, clip=number, time=float(time)), vertices(out, clip=0, time=float(time))
        assert found.shape == truth.shape
        worst = np.linalg.norm(found - truth, axis=1).max()
        assert worst <= stated + FLOAT_ERROR_PER_DIAGONAL * size


def test_images_beside_a_gltf_are_inside(call: Call, asset: Find, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    assert call("bake", asset("CesiumMan-gltf/CesiumMan.gltf"), out).code == 0
    (image,) = looks(opened_path(out))["images"]
    assert image[1] == asset("CesiumMan-gltf/CesiumMan_img0.jpg").read_bytes()


def test_render_reads_a_flip_book_with_materials(call: Call, textured_path: Path) -> None:
    baked(call, textured_path, "--clip", "bend", "--layout", "flip-visibility")
    book, cache = textured_path.with_name("out.glb"), textured_path.with_name("a.npz")
    assert call("convert-cache", book, cache).code == 0
    assert call("bake", textured_path, textured_path.with_name("b.npz"), "--clip", "bend").code == 0
    found, truth = (np.load(each)["positions"] for each in (cache, textured_path.with_name("b.npz")))
    assert found == pytest.approx(truth, abs=1e-6)
    assert call("render", book, textured_path.with_name("a.png"), "--frames", "2").code == 0

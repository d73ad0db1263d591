"""Files packed for the page: one GLB without any other file, the same motion in three.js, and notes about the rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.errors import AnimError, FormatError, UnsupportedError
from anim.files import resolver
from anim.gltf.document import Document, copy_json
from anim.gltf.io import json_text
from anim.gltf.reading import reader
from anim.gltf.writing import draco_decoding, writer
from anim.operations.resample import resample
from anim.show.page import embedding, sticks
from anim.show.page.embedding import embed
from anim.skinning.bake import bake
from tests import draco, many
from tests.anim.show.page.embedded import MARKUP, content_of, edited
from tests.files import opened, opened_fixture, opened_path
from tests.judge import judge, needs_judge, vertices
from tests.khronos import errors, needs_validator, validate_many

Find = Callable[[str], Path]
LOADED_BY_THREE = (
    "AnimationPointer/24_animation_pointer.gltf",
    "BitmojiRun.glb",
    "BusterDrone/busterDrone.gltf",
    "CesiumMan-gltf/CesiumMan.gltf",
    "InterpolationTest.gltf",
)


def test_a_mesh_with_and_without_a_skin_becomes_two() -> None:
    """three.js makes all nodes with it skinned, and fails on those without a skin."""
    json = opened_fixture("biped").json
    statues = [{"mesh": 0, "name": f"statue {i}"} for i in range(2)]
    document = replace(opened_fixture("biped"), json={**json, "nodes": [*json["nodes"], *statues]})
    embedded = opened(embed(document).glb).json
    body, *others = (node["mesh"] for node in embedded["nodes"] if "mesh" in node)
    assert others == [len(json["meshes"])] * 2
    assert embedded["meshes"][others[0]]["primitives"] == embedded["meshes"][body]["primitives"]


@needs_judge
@pytest.mark.slow
@pytest.mark.parametrize("name", LOADED_BY_THREE)
def test_three_plays_the_same_motion(name: str, asset: Find, tmp_path: Path) -> None:
    path = asset(name)
    found = embed(opened_path(path), resolver.CompanionFiles(path.parent).open)
    (tmp_path / "page.glb").write_bytes(found.glb)
    verdict = judge(path, tmp_path / "page.glb", rate=10)
    assert verdict.clips
    if "Pointer" not in name:
        assert verdict.max_error == 0
        assert not verdict.missing


@needs_judge
@pytest.mark.parametrize("extension", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_three_plays_meshopt_from_one_buffer(extension: str, tmp_path: Path) -> None:
    document = opened_fixture("biped")
    clips = {i: resample(clip, fps=60) for i, clip in enumerate(reader.clips(document))}
    document, squeezed = (writer.replace_clips(document, clips, extension=each) for each in ("", extension))
    for name, each in (("plain", document), ("squeezed", squeezed)):
        (tmp_path / f"{name}.glb").write_bytes(embed(each).glb)
    assert extension in content_of((tmp_path / "squeezed.glb").read_bytes())["extensionsUsed"]
    assert judge(tmp_path / "plain.glb", tmp_path / "squeezed.glb").max_error < 1e-6


@needs_judge
def test_pointers_at_nodes_and_meshes_play_in_three(tmp_path: Path) -> None:
    document = opened_fixture("pointer")
    nodes = [{key: node[key] for key in node if key != "weights"} for node in document.json["nodes"]]
    animations = copy_json(document.json)["animations"]
    weights = next(each for each in animations if each["name"] == "weights")
    weights["channels"][0]["target"]["extensions"]["KHR_animation_pointer"]["pointer"] = "/meshes/0/weights"
    document = replace(document, json={**document.json, "nodes": nodes, "animations": animations})
    found = embed(document)
    (tmp_path / "page.glb").write_bytes(found.glb)
    rest = replace(document, json={**document.json, "animations": []})
    (tmp_path / "rest.glb").write_bytes(embed(rest).glb)
    moved = {clip.name: clip.max_error for clip in judge(tmp_path / "page.glb", tmp_path / "rest.glb").clips}
    assert moved["weights"] == pytest.approx(np.hypot(0.25, 0.125), rel=1e-6)  # of deltas up to 0.25 m, both nodes
    assert moved["turn"] > 0.5
    assert moved["color"] == 0
    plain = {each["name"]: [c["target"] for c in each["channels"]] for each in content_of(found.glb)["animations"]}
    assert plain["weights"] == [{"node": 0, "path": "weights"}, {"node": 1, "path": "weights"}]
    assert plain["turn"] == [{"node": 0, "path": "rotation"}]
    assert found.notes[0].startswith("3 tracks not shown: /materials/0/pbrMetallicRoughness/baseColorFactor, /nodes/1")
    assert moved["one_weight"] == pytest.approx(0.125, rel=1e-6)
    assert plain["one_weight"] == [{"node": 1, "path": "weights"}]


def test_weights_of_a_mesh_stay_a_pointer_where_a_node_has_its_own() -> None:
    document = edited("pointer")
    target = next(each for each in document.json["animations"] if each["name"] == "weights")["channels"][0]["target"]
    target["extensions"]["KHR_animation_pointer"]["pointer"] = "/meshes/0/weights"
    found = embed(document)
    assert found.notes[0].startswith("4 tracks not shown")
    assert found.notes[0].endswith(" and 1 more")


def test_pointers_become_plain_channels() -> None:
    found = embed(opened_fixture("pointer"))
    targets = [c["target"] for clip in content_of(found.glb)["animations"] for c in clip["channels"]]
    assert {"node": 0, "path": "rotation"} in targets
    assert {"node": 0, "path": "weights"} in targets
    assert len(reader.clips(opened(found.glb))) == len(reader.clips(opened_fixture("pointer")))


@pytest.mark.parametrize("name", ["gltf_external", "gltf_embedded", "biped", "accessors"])
def test_one_buffer_holds_everything(name: str) -> None:
    document = opened_fixture(name)
    before = json_text.dump(document.json)
    found = embed(document)
    assert found == embed(opened_fixture(name)), "the same bytes twice"
    assert json_text.dump(document.json) == before, "the document given is unchanged"
    content = content_of(found.glb)
    assert [set(each) for each in content["buffers"]] == [{"byteLength"}]
    assert not found.notes
    for old, new in zip(reader.clips(document), reader.clips(opened(found.glb)), strict=True):
        for a, b in zip(old.tracks, new.tracks, strict=True):
            assert np.array_equal(a.values, b.values)
            assert np.array_equal(a.times, b.times)


@needs_validator
def test_the_validator_finds_no_error() -> None:
    files = [embed(opened_fixture(name)).glb for name in ("gltf_external", "accessors", "pointer", "morph_cube")]
    assert not [each for report in validate_many(files) for each in errors(report)]


def test_draco_is_decoded_or_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    document = draco.compressed(opened_fixture("biped"))
    found = embed(document)
    content = content_of(found.glb)
    assert not found.notes
    assert "KHR_draco_mesh_compression" not in str(content)

    def refuse(*_: object) -> Document:
        raise UnsupportedError("Draco needs the package DracoPy")

    monkeypatch.setattr(embedding, "decode_draco", refuse)
    found = embed(document)
    assert found.notes == ["1 mesh not drawn: Draco needs the package DracoPy"]
    assert not any("mesh" in node for node in content_of(found.glb)["nodes"])
    assert draco_decoding.decode_draco is not refuse


def test_a_file_without_scenes_gets_one() -> None:
    document = edited("biped")
    for key in ("scenes", "scene"):
        document.json.pop(key, None)
    content = content_of(embed(document).glb)
    assert content["scenes"][content["scene"]]["nodes"]


def test_tracks_outside_the_scene_have_no_target() -> None:
    document = edited("morph_cube")
    document.json["nodes"].append({"name": "elsewhere"})
    document.json["scenes"].append({"nodes": [len(document.json["nodes"]) - 1]})
    document.json["scene"] = len(document.json["scenes"]) - 1
    found = embed(document)
    tracks = sum(len(clip["channels"]) for clip in document.json["animations"])
    assert found.notes == [
        "1 mesh not shown: outside the default scene",
        f"{tracks} track{'s' * (tracks != 1)} not shown: of nodes outside the default scene",
    ]
    assert not any("node" in c["target"] for clip in content_of(found.glb)["animations"] for c in clip["channels"])


def test_a_path_that_gltf_does_not_know_has_no_target() -> None:
    document = edited("morph_cube")
    document.json["animations"][0]["channels"].append({"sampler": 0, "target": {"node": 0, "path": "color"}})
    found = embed(document)
    assert not found.notes
    assert content_of(found.glb)["animations"][0]["channels"][-1]["target"] == {"path": "color"}


def test_extensions_that_three_does_not_know_are_not_required() -> None:
    document = edited(
        "morph_cube",
        extensionsUsed=["ACME_light", "KHR_mesh_quantization"],
        extensionsRequired=["ACME_light", "KHR_mesh_quantization"],
    )
    found = embed(document)
    assert found.notes == ["shown without ACME_light, which the file requires"]
    assert content_of(found.glb)["extensionsRequired"] == ["KHR_mesh_quantization"]


def test_names_with_markup_stay() -> None:
    document = edited("biped")
    for each in (*document.json["nodes"], *document.json["animations"], *document.json["meshes"]):
        each["name"] = MARKUP
    content = content_of(embed(document).glb)
    assert {each["name"] for key in ("nodes", "animations", "meshes") for each in content[key]} == {MARKUP}


def test_a_file_that_cannot_be_read_is_refused(asset: Find) -> None:
    path = asset("CesiumMan-gltf/CesiumMan.gltf")

    def absent(address: str) -> bytes:
        raise FormatError(f"'{address}' is not beside the file")

    document = opened(path.read_bytes(), {})
    with pytest.raises(AnimError, match="not beside the file"):
        embed(document, absent)


def test_a_document_without_buffers_is_a_glb() -> None:
    document = opened(b'{"asset": {"version": "2.0"}, "buffers": []}')
    assert content_of(embed(document).glb) == {"asset": {"version": "2.0"}, "scenes": [{}], "scene": 0}


@needs_judge
@pytest.mark.parametrize("names", [("ab", "ab", "ab_1"), ("constructor", "toString"), ("a.b", "ab", "[a]b", "ab_2")])
def test_nodes_that_three_takes_for_one_move_on_their_own(names: tuple[str, ...], tmp_path: Path) -> None:
    document = edited("biped")
    for i, node in enumerate(document.json["nodes"]):
        node["name"] = names[i % len(names)]
    found = embed(document)
    assert "names changed" in found.notes[0]
    (tmp_path / "page.glb").write_bytes(found.glb)
    scene, clip = reader.scene(document), reader.clips(document)[0]
    expected = bake(scene, clip, times=np.array([0.3])).load_all().positions[0]
    assert np.abs(vertices(tmp_path / "page.glb", clip=0, time=0.3) - expected).max() < 1e-5


def test_equal_names_alone_stay() -> None:
    document = edited("biped")
    for node in document.json["nodes"]:
        node["name"] = "joint.001"
    found = embed(document)
    assert not found.notes
    assert {node["name"] for node in content_of(found.glb)["nodes"]} == {"joint.001"}


@needs_judge
def test_nodes_that_share_a_mesh_of_several_primitives_morph_on_their_own(tmp_path: Path) -> None:
    document = edited("morph_cube")
    json = document.json
    json["meshes"][0]["primitives"].append(dict(json["meshes"][0]["primitives"][0]))
    json["nodes"].append({"mesh": 0, "name": "second", "translation": [5, 0, 0]})
    json["scenes"][0]["nodes"].append(1)
    for clip in json["animations"]:
        clip["channels"][0]["target"]["node"] = 1
    (tmp_path / "page.glb").write_bytes(embed(document).glb)
    scene, clip = reader.scene(document), reader.clips(document)[0]
    expected = bake(scene, clip, times=np.array([0.4]), rigid=True).load_all().positions[0]
    assert np.abs(vertices(tmp_path / "page.glb", clip=0, time=0.4) - expected).max() < 1e-5


def test_what_three_fails_on_is_left_out() -> None:
    document = edited("morph_cube", cameras=[{}], materials=[{"extensions": {"KHR_materials_unlit": {}}}, 3])
    json = document.json
    json["extensions"] = {
        "KHR_lights_punctual": {"lights": [{"type": "lamp", "name": 7}, 5, {"type": "spot", "spot": 1}]}
    }
    json["nodes"][0] |= {"camera": 0}
    json["nodes"] += [{"extensions": {"KHR_lights_punctual": {"light": i}}} for i in (0, 1, 2, 3, "x")]
    json["meshes"][0]["primitives"][0]["material"] = 1
    json["scenes"][0]["name"] = 5
    content = content_of(embed(document).glb)
    assert embed(document).notes == ["6 references to missing materials or lights left out"]
    assert [node.get("extensions") for node in content["nodes"][1:]].count({}) == 5
    assert "cameras" not in content
    assert "name" not in content["scenes"][0]
    assert "material" not in content["meshes"][0]["primitives"][0]
    assert content["extensionsUsed"] == ["KHR_materials_unlit"]


def test_many_trees_without_a_mesh_become_few_meshes() -> None:
    found = content_of(embed(opened(many.side(250))).glb)
    assert len(found["meshes"]) == 84  # of three nodes each
    assert sorted(joint for skin in found["skins"] for joint in skin["joints"]) == list(range(250))


@needs_judge
def test_three_skins_meshes_on_several_trees(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Skins whose joints have no common root, which glTF does not allow."""
    made = []
    for count in (2, 10):
        monkeypatch.setattr(sticks, "MAX_MESHES", count)
        path = tmp_path / f"{count}.glb"
        path.write_bytes(embed(opened(many.side_moving(10))).glb)
        assert len(content_of(path.read_bytes())["meshes"]) == count
        made.append(vertices(path, clip=0, time=0.25))
    np.testing.assert_allclose(made[0], made[1], rtol=0, atol=1e-7)
    assert len(made[0]) == 10 * 24

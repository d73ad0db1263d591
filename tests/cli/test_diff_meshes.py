"""`diff` where the second file's meshes would be shown otherwise although its clips are the same."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from anim.gltf.document import Json
from tests.cli.conftest import Call
from tests.files import glb_of, opened_fixture

Pair = Callable[[Callable[[Json], object]], tuple[Path, Path]]


@pytest.fixture
def pair(tmp_path: Path) -> Pair:
    """Write the biped and a version of it whose JSON a function changed."""

    def written(change: Callable[[Json], object], name: str = "biped") -> tuple[Path, Path]:
        document = opened_fixture(name)
        json = copy.deepcopy(dict(document.json))
        change(json)
        paths = tmp_path / "a.glb", tmp_path / "b.glb"
        for path, each in zip(paths, (document, replace(document, json=json)), strict=True):
            path.write_bytes(glb_of(each))
        return paths

    return written


def _without_skins(json: Json) -> None:
    del json["skins"]
    for node in json["nodes"]:
        node.pop("skin", None)


def test_a_lost_skin_fails_the_check_and_is_named(pair: Pair, call: Call) -> None:
    paths = pair(_without_skins)
    run = call("diff", *paths, "--fail-above", "1cm", "--format", "json")
    assert run.code == 6
    assert run.json["max_error_m"] > 0.1
    (warning,) = run.json["warnings"]
    assert (
        warning == f"{paths[1]}: mesh 'body' has no skin in the second file: measured as the node of the mesh moves it"
    )
    assert f"warning: {warning}\n" in run.err


def test_a_file_without_meshes_is_measured_by_joints_with_a_warning(pair: Pair, call: Call) -> None:
    def change(json: Json) -> None:
        for node in json["nodes"]:
            node.pop("mesh", None)
            node.pop("skin", None)

    run = call("diff", *pair(change), "--format", "json", "--fail-above", "1mm")
    assert run.code == 0
    assert "the second file has no vertices" in run.json["warnings"][0]
    assert not run.json["meshes_agree_by_vertex"]


def test_a_default_scene_that_shows_nothing_is_said(pair: Pair, call: Call) -> None:
    def change(json: Json) -> None:
        json["scenes"].append({"nodes": []})
        json["scene"] = len(json["scenes"]) - 1

    paths = pair(change)
    found = call("diff", *paths, "--format", "json").json
    assert found["warnings"] == [f"{paths[1]}: the default scene has no mesh, most players show nothing"]


def test_other_weights_are_said(pair: Pair, call: Call) -> None:
    """Every influence by the skin's first joint: accessors without bytes are zeros."""

    def change(json: Json) -> None:
        for primitive in json["meshes"][0]["primitives"]:
            joints = json["accessors"][primitive["attributes"]["JOINTS_0"]]
            joints.pop("bufferView", None)
            joints.pop("byteOffset", None)

    found = call("diff", *pair(change), "--format", "json").json
    assert not found["meshes_agree_by_vertex"]
    assert "mesh 'body' has other joints, weights or morph targets" in found["warnings"][0]


def test_a_clip_that_ends_at_another_time_is_said(pair: Pair, call: Call) -> None:
    paths = pair(lambda json: None)
    assert call("trim", paths[0], paths[1], "--clip", "wave", "--to", "0.5").code == 0
    (warning,) = call("diff", *paths, "--format", "json").json["warnings"]
    assert "clip 'wave' ends at 0.5 s instead of " in warning


def test_a_skin_in_the_second_file_only_is_named(pair: Pair, call: Call) -> None:
    skinned, bare = pair(_without_skins)
    run = call("diff", bare, skinned, "--format", "json")
    (warning,) = run.json["warnings"]
    assert warning == (
        f"{skinned}: mesh 'body' has a skin in the second file only: measured as the node of the mesh moves it"
    )
    assert f"warning: {warning}\n" in run.err


def test_meshes_in_the_second_file_only_are_named(pair: Pair, call: Call) -> None:
    def change(json: Json) -> None:
        for node in json["nodes"]:
            node.pop("mesh", None)
            node.pop("skin", None)

    whole, bare = pair(change)
    (warning,) = call("diff", bare, whole, "--format", "json").json["warnings"]
    assert warning == f"{whole}: the first file has no vertices: nodes are measured, not the meshes of the second file"
    assert call("diff", bare, bare, "--format", "json").json["warnings"] == []


def test_a_lost_primitive_is_named(pair: Pair, call: Call) -> None:
    """The first file has every primitive twice."""

    def change(json: Json) -> None:
        for mesh in json["meshes"]:
            mesh["primitives"] += copy.deepcopy(mesh["primitives"])

    once, twice = pair(change)
    (warning,) = call("diff", twice, once, "--format", "json").json["warnings"]
    assert warning == f"{once}: mesh 'body' has fewer primitives in the second file: the first one's are measured"
    assert call("diff", once, twice, "--format", "json").json["warnings"] == []


def test_a_lost_mesh_is_named(pair: Pair, call: Call) -> None:
    """The first file has a second mesh, on a node of its own."""

    def change(json: Json) -> None:
        json["nodes"].append({"name": "prop", "mesh": len(json["meshes"])})
        json["scenes"][0]["nodes"].append(len(json["nodes"]) - 1)
        attributes = {"POSITION": json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]}
        json["meshes"].append({"name": "prop", "primitives": [{"attributes": attributes}]})

    once, twice = pair(change)
    (warning,) = call("diff", twice, once, "--format", "json").json["warnings"]
    assert warning == f"{once}: mesh 'prop' has no counterpart in the second file: the first one's are measured"
    assert call("diff", once, twice, "--format", "json").json["warnings"] == []

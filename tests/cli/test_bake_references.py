"""Bakes into a glTF keep what extensions say of meshes that are elsewhere now, or tell where they can't."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.caches.source_document.bake_source import BakeSource
from anim.caches.source_document.instanced_nodes import check_copies
from anim.errors import UnsupportedError
from anim.gltf.document import Document, Json, copy_json
from anim.gltf.reading.accessors import Accessors
from anim.gltf.validation import hierarchy
from anim.gltf.writing.append import append_accessors
from tests.cli.conftest import Call
from tests.files import glb_of, opened_fixture, opened_path
from tests.khronos import errors, needs_validator, validate

VISIBILITY, POINTER, COPIES = "KHR_node_visibility", "KHR_animation_pointer", "EXT_mesh_gpu_instancing"
LAYOUTS = pytest.mark.parametrize("layout", ["morph", "flip-scale", "flip-visibility"])


def cube_of(json: Json) -> int:
    return next(i for i, node in enumerate(json["nodes"]) if "mesh" in node)


def written(path: Path, document: Document, json: Json, *used: str) -> Path:
    """Write the document with this JSON, which uses more extensions."""
    names = [*json.get("extensionsUsed", []), *used]
    path.write_bytes(glb_of(replace(document, json={**json, "extensionsUsed": [*dict.fromkeys(names)]})))
    return path


def baked(call: Call, source: Path, *options: str) -> Document:
    out = source.with_name("out.glb")
    run = call("bake", source, out, "--clip", "#0", "--fps", "4", *options)
    assert run.code == 0, run.err
    return opened_path(out)


def below_hidden(path: Path, *, has_children: bool) -> Path:
    """A cube below a node that a clip shows, and that one below a hidden one."""
    document = opened_fixture("morph_cube")
    json = copy_json(document.json)
    cube, count = cube_of(json), len(json["nodes"])
    if has_children:
        json["nodes"][cube]["children"] = [count + 2]
    switch = {VISIBILITY: {"visible": False}}
    json["nodes"] += [{"name": "inner", "children": [cube], "extensions": switch}]
    json["nodes"] += [{"name": "outer", "children": [count], "extensions": {VISIBILITY: {"visible": True}}}]
    json["nodes"] += [{"name": "socket"}] if has_children else []
    json["scenes"] = [{"nodes": [count + 1]}]
    pointer = {"pointer": f"/nodes/{count}/extensions/{VISIBILITY}/visible"}
    clip = json["animations"][0]
    clip["channels"].append({"sampler": len(clip["samplers"]), "target": {"path": "pointer"}})
    clip["channels"][-1]["target"]["extensions"] = {POINTER: pointer}
    times = clip["samplers"][0]["input"]
    shown = len(json["accessors"])
    count_keys = json["accessors"][times]["count"]
    json["accessors"].append({"componentType": 5121, "type": "SCALAR", "count": count_keys})  # hidden at all keys
    clip["samplers"].append({"input": times, "output": shown, "interpolation": "STEP"})
    return written(path, document, json, VISIBILITY, POINTER)


def switches(json: Json, node: int) -> set[int]:
    """The nodes above a node, and itself, that can hide it."""
    parents, found = hierarchy.parents(json), set()
    while node >= 0:
        if VISIBILITY in json["nodes"][node].get("extensions", {}):
            found.add(node)
        node = parents[node]
    return found


@needs_validator
@LAYOUTS
@pytest.mark.parametrize("space", ["world", "mesh"])
@pytest.mark.parametrize("has_children", [False, True])
def test_a_mesh_below_a_hidden_node_stays_hidden(
    call: Call, tmp_path: Path, layout: str, space: str, has_children: bool
) -> None:
    """In world space it is no longer below it; what switches the node in the clip switches the mesh."""
    source = below_hidden(tmp_path / "a.glb", has_children=has_children)
    document = baked(call, source, "--layout", layout, "--space", space)
    json = document.json
    meshes = [i for i, node in enumerate(json["nodes"]) if "mesh" in node]
    hidden = {i for i, node in enumerate(json["nodes"]) if node.get("extensions") == {VISIBILITY: {"visible": False}}}
    pages = set(meshes)
    clip = json["animations"][0]
    switched = {
        int(channel["target"]["extensions"][POINTER]["pointer"].split("/")[2]): clip["samplers"][channel["sampler"]]
        for channel in clip["channels"]
        if channel["target"]["path"] == "pointer"
    }
    for mesh in meshes:
        above = switches(json, mesh) - pages
        assert len(above) == 2
        (inner,) = above & hidden
        assert not Accessors(document).raw(switched[inner]["output"]).any()
    assert not errors(validate((tmp_path / "out.glb").read_bytes()))


def test_meshes_below_the_same_nodes_share_groups(call: Call, tmp_path: Path) -> None:
    document = opened_path(below_hidden(tmp_path / "a.glb", has_children=False))
    json = copy_json(document.json)
    cube = cube_of(json)
    json["nodes"].append({"mesh": json["nodes"][cube]["mesh"]})
    next(node for node in json["nodes"] if node.get("name") == "inner")["children"].append(len(json["nodes"]) - 1)
    found = baked(call, written(tmp_path / "b.glb", document, json)).json
    (root,) = set(found["scenes"][0]["nodes"]) - set(json["scenes"][0]["nodes"])
    (inner,) = found["nodes"][root]["children"]
    assert ["mesh" in found["nodes"][i] for i in found["nodes"][inner]["children"]] == [True, True]


def in_copies(path: Path, offset: list[float], node: Json, *, above: Json | None = None) -> Path:
    """A cube with a copy at an offset, on a node with these properties, below a node with those of `above`."""
    document, (offsets,) = append_accessors(opened_fixture("morph_cube"), [(np.array([offset], "<f4"), None)])
    json = copy_json(document.json)
    cube = cube_of(json)
    json["nodes"][cube] |= node | {"extensions": {COPIES: {"attributes": {"TRANSLATION": offsets}}}}
    json["nodes"].append({"children": [cube], **(above or {})})
    json["scenes"] = [{"nodes": [len(json["nodes"]) - 1]}]
    return written(path, document, json, COPIES)


def placed_copy(document: Document) -> Floats:
    """The vertices (V, 3) of the copy at rest, in world space: moved by the copy, then by the nodes, as players do."""
    json = document.json
    node, parents = cube_of(json), hierarchy.parents(json)
    mesh = json["meshes"][json["nodes"][node]["mesh"]]
    vertices, attributes = Accessors(document), mesh["primitives"][0]["attributes"]
    found = vertices.floats(attributes["POSITION"])
    weights = json["nodes"][node].get("weights", mesh["weights"])
    for weight, target in zip(weights, mesh["primitives"][0]["targets"], strict=True):
        found = found + weight * vertices.floats(target["POSITION"])
    found = found + vertices.floats(json["nodes"][node]["extensions"][COPIES]["attributes"]["TRANSLATION"])
    while node >= 0:
        found = found @ Rotation.from_quat(json["nodes"][node].get("rotation", [0, 0, 0, 1])).as_matrix().T
        found = found * json["nodes"][node].get("scale", [1, 1, 1]) + json["nodes"][node].get("translation", [0, 0, 0])
        node = parents[node]
    return found


TURNED = {"rotation": [0.0, 0.0, 0.7071067811865476, 0.7071067811865476]}  # 90° about z


@pytest.mark.parametrize(
    ("node", "above", "options"),
    [
        (TURNED, {}, ()),
        ({}, TURNED, ()),
        ({}, {}, ("--layout", "flip-scale")),
        (TURNED, {}, ("--space", "mesh", "--layout", "flip-scale")),
    ],
)
def test_copies_that_would_move_or_vanish_are_refused(
    call: Call, tmp_path: Path, node: Json, above: Json, options: tuple[str, ...]
) -> None:
    """The copy at x = 3 m of a node turned by 90° is at y = 3 m; of one in world space it would be at x = 3 m."""
    source = in_copies(tmp_path / "a.glb", [3, 0, 0], node, above=above)
    run = call("bake", source, tmp_path / "out.glb", "--clip", "#0", *options)
    assert run.code == 4
    assert f"has copies of its mesh by {COPIES}, which would be lost or elsewhere" in run.err
    assert not (tmp_path / "out.glb").exists()


def test_a_scale_of_quantized_vertices_would_move_copies() -> None:
    """Targets of more than 1 m have one, which would scale the offsets of the copies too."""
    node = {"mesh": 0, "extensions": {COPIES: {}}}
    source = BakeSource(Document({"nodes": [node]}, ()), in_mesh_space=True)
    check_copies(source, {"nodes": [node]}, {0})
    with pytest.raises(UnsupportedError, match="node 0 has copies"):
        check_copies(source, {"nodes": [{**node, "scale": [2, 2, 2]}]}, {0})


@pytest.mark.parametrize(
    ("node", "above", "options"),
    [(TURNED, {}, ("--space", "mesh")), ({}, TURNED, ("--space", "mesh")), ({}, {}, ())],
)
def test_copies_stay_where_they_are(
    call: Call, tmp_path: Path, node: Json, above: Json, options: tuple[str, ...]
) -> None:
    source = in_copies(tmp_path / "a.glb", [3, 0, 0], node, above=above)
    expected = placed_copy(opened_path(source))  # its node's weights are those at the clip's start
    assert placed_copy(baked(call, source, *options)) == pytest.approx(expected, abs=2e-3)


@LAYOUTS
@pytest.mark.parametrize("has_children", [False, True])
@pytest.mark.parametrize("version", [0, 1])
def test_first_person_annotations_name_the_meshes_of_a_bake(
    call: Call, tmp_path: Path, layout: str, has_children: bool, version: int
) -> None:
    """Of VRM 1.0 by their node, of VRM 0.x by themselves; each page of a flip-book has one."""
    document = opened_fixture("morph_cube")
    json = copy_json(document.json)
    json["nodes"][0]["children"] = [1] if has_children else []
    if not has_children:
        del json["nodes"][0]["children"]
    json["nodes"].append({"name": "other", "mesh": 1})
    json["meshes"].append({"primitives": [{**json["meshes"][0]["primitives"][0], "targets": []}]})
    del json["meshes"][1]["primitives"][0]["targets"]
    json["scenes"] = [{"nodes": [0] if has_children else [0, 1]}]
    if version:
        annotations = [{"node": 0, "type": "thirdPersonOnly"}, {"node": 1, "type": "both"}]
        json["extensions"] = {"VRMC_vrm": {"specVersion": "1.0", "firstPerson": {"meshAnnotations": annotations}}}
    else:
        flags = [{"mesh": 0, "firstPersonFlag": "ThirdPersonOnly"}, {"mesh": 1, "firstPersonFlag": "Both"}]
        json["extensions"] = {"VRM": {"specVersion": "0.0", "firstPerson": {"meshAnnotations": flags}}}
    found = baked(call, written(tmp_path / "a.glb", document, json, *json["extensions"]), "--layout", layout).json
    (extension,) = found["extensions"].values()
    told = {each["node" if version else "mesh"]: each for each in extension["firstPerson"]["meshAnnotations"]}
    shown = [i for i, node in enumerate(found["nodes"]) if "mesh" in node]
    for node in shown:
        flag = told[node if version else found["nodes"][node]["mesh"]]["type" if version else "firstPersonFlag"]
        assert flag.lower() == ("both" if node == 1 else "thirdpersononly")
    assert len(told) == len(shown)


def test_annotations_of_meshes_that_are_left_out_are_removed(call: Call, tmp_path: Path) -> None:
    document = opened_fixture("morph_cube")
    json = copy_json(document.json)
    json["nodes"].append({"name": "other", "mesh": 0})
    json["scenes"][0]["nodes"].append(1)
    annotations = [{"node": 1, "type": "both"}, {"node": 0, "type": "auto"}, {"node": "?"}, 3]
    json["extensions"] = {"VRMC_vrm": {"firstPerson": {"meshAnnotations": annotations}}}
    source = written(tmp_path / "a.glb", document, json, "VRMC_vrm")
    found = baked(call, source, "--mesh", "other").json
    told = found["extensions"]["VRMC_vrm"]["firstPerson"]["meshAnnotations"]
    assert told == [{"node": 1, "type": "both"}, {"node": "?"}, 3]


START = {"graphs": [{"declarations": [{"op": "animation/start"}], "nodes": [{"value": [1]}]}]}


@pytest.mark.parametrize(
    ("extension", "options", "is_named"),
    [
        ({"KHR_interactivity": START}, ("--space", "mesh"), True),  # clip 1 is clip 0 now
        ({"ACME_paths": {"target": "/nodes/0/weights/1"}}, ("--layout", "flip-scale"), True),
        ({"ACME_paths": {"target": "/nodes/0/weights/1"}}, (), False),  # the cube is on its node
        ({"ACME_colors": {"color": [0.5, 0.25]}}, ("--layout", "flip-scale"), False),
    ],
)
def test_extensions_that_may_name_what_changes_are_a_note(
    call: Call, tmp_path: Path, extension: Json, options: tuple[str, ...], is_named: bool
) -> None:
    document = opened_fixture("morph_cube")
    source = written(tmp_path / "a.glb", document, {**document.json, "extensions": extension}, *extension)
    run = call("bake", source, tmp_path / "out.glb", "--clip", "#1", *options)
    assert run.code == 0
    note = f"by the index of another one now: /extensions/{next(iter(extension))}"
    assert (note in run.err) == is_named
    assert opened_path(tmp_path / "out.glb").json["extensions"] == extension


@pytest.mark.parametrize("is_left", [False, True])
def test_levels_of_detail_that_a_mesh_leaves_are_a_note(call: Call, tmp_path: Path, is_left: bool) -> None:
    """A mesh in world space is no longer below the node that shows one level at a time."""
    document = opened_fixture("morph_cube")
    json = copy_json(document.json)
    levels = {"extensions": {"MSFT_lod": {"ids": [2]}}}
    json["nodes"] += [{"children": [0], **levels}, {"name": "far"}]
    json["scenes"] = [{"nodes": [1, 2]}]
    source = written(tmp_path / "a.glb", document, json, "MSFT_lod")
    run = call("bake", source, tmp_path / "out.glb", "--clip", "#0", "--space", "world" if is_left else "mesh")
    assert ("another one now: /nodes/1/extensions/MSFT_lod" in run.err) == is_left


def test_clips_that_an_extension_may_name_are_not_removed(call: Call, tmp_path: Path) -> None:
    """The fix of GA005 would change the index of the clips after them."""
    document = opened_fixture("morph_cube")
    json = {**document.json, "scenes": [{"nodes": [1]}], "nodes": [*document.json["nodes"], {"name": "shown"}]}
    for extension, count in (({}, None), ({"KHR_interactivity": START}, 2)):
        source = written(tmp_path / "a.glb", document, {**json, "extensions": extension}, *extension)
        run = call("check", source, "--unsafe-fixes", "--select", "GA005")
        left = opened_path(source).json.get("animations")
        assert (left and len(left)) == count, run.err

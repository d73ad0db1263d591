"""`check --fix`: files are fixed in place, or stay as they are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from anim.check import fixing
from anim.errors import UnsupportedError
from tests.cli.checking import codes
from tests.cli.conftest import Call
from tests.cli.running import built
from tests.files import glb_of, opened


def test_safe_fixes_change_the_file_in_place_once(folder: Path, call: Call) -> None:
    path = folder / "noop.glb"
    before = path.read_bytes()
    dry = call("check", "noop.glb", "--fix", "--dry-run")
    assert path.read_bytes() == before
    assert "(dry run: nothing written)" in dry.err
    run = call("check", "noop.glb", "--fix", "--format", "json")
    assert not {"GA101", "GA103", "GA104", "GA105"} & codes(run.json)
    assert "fixed" in run.err
    fixed = path.read_bytes()
    assert fixed != before
    (folder / "before.glb").write_bytes(before)
    assert call("diff", "before.glb", "noop.glb", "--fail-above", "0.0001%").code == 0
    again = call("check", "noop.glb", "--fix")
    assert (path.read_bytes(), again.err) == (fixed, "")


def test_unsafe_fixes_need_their_option(folder: Path, call: Call) -> None:
    rename(folder / "noop.glb", ["", "walk", "walk"])
    assert codes(call("check", "noop.glb", "--fix", "--select", "GA0", "--format", "json").json) == {"GA001", "GA002"}
    run = call("check", "noop.glb", "--unsafe-fixes", "--select", "GA0", "--format", "json")
    assert codes(run.json) == set()
    clips = call("inspect", "noop.glb", "--format", "json").json["files"][0]["clips"]
    assert [clip["name"] for clip in clips][:3] == ["animation_0", "walk", "walk_2"]


def rename(path: Path, names: list[str]) -> None:
    document = opened(path.read_bytes())
    for animation, name in zip(document.json["animations"], names, strict=False):
        animation["name"] = name
    path.write_bytes(glb_of(document))


def test_broken_files_and_stdin_are_not_fixed(folder: Path, call: Call) -> None:
    (folder / "bad.glb").write_bytes(b"no glTF")
    assert call("check", "bad.glb", "--fix").code == 3
    assert (folder / "bad.glb").read_bytes() == b"no glTF"
    assert call("check", "-", "--fix", stdin=built("noop")).code == 2


def test_a_file_that_cannot_be_fixed_stays_and_the_others_are_fixed(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*args: object, **options: object) -> None:
        raise UnsupportedError("has an extension that names its keys")

    monkeypatch.setattr(fixing, "fix_all", refuse)
    before = (folder / "noop.glb").read_bytes()
    run = call("check", "noop.glb", "--fix", "-q")
    assert (run.code, run.err) == (0, "warning: noop.glb is not fixed: has an extension that names its keys\n")
    assert (folder / "noop.glb").read_bytes() == before


@pytest.mark.parametrize("options", [(), ("-q",)])
def test_a_buffer_that_a_fix_leaves_unused_is_a_warning(options: tuple[str, ...], folder: Path, call: Call) -> None:
    """Readers of the old file need the old buffer, so the new one has another name."""
    assert call("convert", "noop.glb", "noop.gltf").code == 0
    (folder / "noop.bin").rename(folder / "noop_data.bin")
    text = (folder / "noop.gltf").read_text()
    assert '"noop.bin"' in text
    (folder / "noop.gltf").write_text(text.replace('"noop.bin"', '"noop_data.bin"'))
    run = call("check", "noop.gltf", "--fix", *options)
    problem = "'noop_data.bin' is not used by noop.gltf any more; delete it if nothing else needs it"
    assert f"warning: {problem}\n" in run.err


VRM = {
    "VRMC_vrm": {"expressions": {"preset": {"happy": {"morphTargetBinds": [{"node": 0, "index": 0, "weight": 1.0}]}}}}
}


@pytest.mark.parametrize(
    ("extensions", "is_moved"),
    [
        ({}, True),
        (VRM, False),
        ({"VRMC_vrm": {"firstPerson": {"meshAnnotations": [{"node": 0, "type": "auto"}]}}}, False),
        ({"ACME_faces": {"face": 0}}, False),
        ({"ACME_faces": {"face": "/nodes/0"}}, False),
        ({"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 1}}}}}, True),
    ],
)
def test_a_mesh_stays_on_its_node_if_an_extension_names_it(
    folder: Path, call: Call, extensions: dict[str, Any], is_moved: bool
) -> None:
    """VRM's expressions name the node of a mesh: on another node it would have no expressions."""
    document = opened(built("tube"))
    nodes = document.json["nodes"]
    number = next(i for i, node in enumerate(nodes) if "skin" in node)
    nodes[number] |= {"translation": [0.0, 1.0, 0.0], "children": [len(nodes)]}
    nodes.append({"name": "socket"})
    document.json["extensions"] = json.loads(json.dumps(extensions).replace('"node": 0', f'"node": {number}'))
    if "ACME_faces" in extensions:
        face = extensions["ACME_faces"]["face"]
        document.json["extensions"]["ACME_faces"]["face"] = number if face == 0 else f"/nodes/{number}"
    (folder / "a.glb").write_bytes(glb_of(document))
    run = call("check", "a.glb", "--fix", "--select", "GA207", "--format", "json")
    new = opened((folder / "a.glb").read_bytes()).json["nodes"]
    assert ("mesh" in new[number], "GA207" in codes(run.json)) == (not is_moved, not is_moved)

"""Images of a file from elsewhere: no file of another kind comes with them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built
from tests.fixtures.reading import split

PNG = b"\x89PNG\r\n\x1a\n" + bytes(20)

# Files that other programs read as settings or code where they lie, as images of a file from elsewhere
PLANTED = {
    "gltf-anim.toml": b"[check]\n",
    "pyproject.toml": PNG,
    ".bash_login": b"echo hi\n",
    ".gltf-anim-cache/outputs.json": b"{}",
    ".config/skin.png": PNG,
    ".skin.png": PNG,
    "code.png": b"#!/bin/sh\n",
    "scene.glb": PNG,
}


@pytest.mark.parametrize(
    "line", [["convert", "scene.glb"], ["convert", "a.gltf"], ["bake", "a.gltf", "--clip=bend", "--fps=2"]]
)
def test_only_images_are_copied(line: list[str], call: Call, tmp_path: Path) -> None:
    path, names = planted(tmp_path / "in", call), [*PLANTED, "ok.png"]
    (tmp_path / "out").mkdir()
    run = call(line[0], path, tmp_path / "out" / line[1], *line[2:])
    run.product()
    there = {each.relative_to(tmp_path / "out").as_posix() for each in (tmp_path / "out").rglob("*") if each.is_file()}
    assert there - {"a.bin"} == {line[1], "ok.png"}
    written = tmp_path / "out" / line[1]
    assert [each["uri"] for each in document(written)["images"]] == names
    assert "note: 1 image copied beside the output (ok.png)\n" in run.err
    assert "note: 8 images are left out, since name or first bytes of the file are those of no image (" in run.err


def test_only_images_are_embedded(call: Call, tmp_path: Path) -> None:
    run = call("convert", planted(tmp_path / "in", call), "--embed")
    images = split(run.product())[0]["images"]
    assert [each["uri"][:9] for each in images] == [*(name[:9] for name in PLANTED), "data:imag"]
    assert "note: 8 images are left out" in run.err


def planted(folder: Path, call: Call) -> Path:
    folder.mkdir()
    (folder / "arm.glb").write_bytes(built("arm"))
    call("convert", folder / "arm.glb", folder / "a.gltf").product()
    scene = document(folder / "a.gltf")
    scene["images"] = [{"uri": name} for name in (*PLANTED, "ok.png")]
    for name, data in {**PLANTED, "ok.png": PNG}.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    (folder / "a.gltf").write_text(json.dumps(scene))
    return folder / "a.gltf"


def document(path: Path) -> Any:
    return json.loads(path.read_text()) if path.suffix == ".gltf" else split(path.read_bytes())[0]

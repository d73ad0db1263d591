"""Files that glTF files refer to, wherever they are."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from anim.errors import FormatError
from anim.gltf.io.file_references import find_referenced, find_references_around, place_of


def write(path: Path, *addresses: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    images = [{"uri": each} for each in addresses]
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "images": [*images, {"bufferView": 0}]}))
    return path


def test_addresses_out_of_the_folder_count(tmp_path: Path) -> None:
    file = write(tmp_path / "a/b.gltf", "../c/d%20e.png", "f.png", "data:image/png;base64,AAAA", "%00.png")
    assert find_referenced([file]) == {place_of(tmp_path / "c/d e.png"), place_of(tmp_path / "a/f.png")}


def test_near_files_count_by_content_and_far_ones_by_name(tmp_path: Path) -> None:
    place = place_of(tmp_path / "a/b/c/skin.png")
    for name, address in {
        "a/b/c/x.bak": "1.png",
        "a/b/y.gltf.old": "2.png",
        "z.gltf": "3.png",
        "far.bak": "4.png",
    }.items():
        write(tmp_path / name, address)
    (tmp_path / "a/b/c/link").symlink_to("5.png")
    (tmp_path / "a/b/c/other.json").write_text("{1}")
    names = ("a/b/c/1.png", "a/b/2.png", "3.png", "a/b/c/5.png")
    assert {place_of(tmp_path / name) for name in names} <= find_references_around([place])
    assert place_of(tmp_path / "4.png") not in find_references_around([place])


def test_a_near_file_that_is_broken_is_an_error(tmp_path: Path) -> None:
    write(tmp_path / "a/b.gltf").write_text("{")
    with pytest.raises(FormatError):
        find_references_around([place_of(tmp_path / "a/skin.png")])

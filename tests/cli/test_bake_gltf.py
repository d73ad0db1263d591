"""`bake` to .gltf: text, a .bin, and images where the source has them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call, Find, Fixture
from tests.files import opened_path
from tests.khronos import errors, needs_validator, validate
from tests.textured import looks, textured


@pytest.mark.parametrize("layout", ["morph", "flip-scale"])
def test_it_is_the_glb(call: Call, tmp_path: Path, layout: str) -> None:
    source = tmp_path / "source.glb"
    source.write_bytes(textured())
    for name in ("a.gltf", "b.glb"):
        assert call("bake", source, tmp_path / name, "--clip", "bend", "--layout", layout).code == 0
    text, binary = opened_path(tmp_path / "a.gltf"), opened_path(tmp_path / "b.glb")
    assert {**text.json, "buffers": 0} == {**binary.json, "buffers": 0}
    assert text.json["buffers"][0]["uri"] == "a.bin"
    assert np.array_equal(text.buffers[0].data, binary.buffers[0].data)
    assert looks(text) == looks(binary)


def test_images_are_copied_beside_it(call: Call, asset: Find, tmp_path: Path) -> None:
    source, out = asset("CesiumMan-gltf/CesiumMan.gltf"), tmp_path / "a.gltf"
    assert call("bake", source, out, "--fps", "4", "-n").code == 0
    assert not list(tmp_path.iterdir())
    assert call("bake", source, out, "--fps", "4").code == 0
    assert json.loads(out.read_text())["images"] == json.loads(source.read_text())["images"]
    assert (tmp_path / "CesiumMan_img0.jpg").read_bytes() == source.with_name("CesiumMan_img0.jpg").read_bytes()


def test_in_the_folder_of_the_source(call: Call, fixture: Fixture) -> None:
    """The source's own files stay as they are."""
    source = fixture("gltf_external")
    before = {path.name: path.read_bytes() for path in source.parent.iterdir()}
    assert call("bake", source, source.with_name("walk data.gltf"), "--fps", "4", "--rigid").code == 0
    after = {path.name: path.read_bytes() for path in source.parent.iterdir()}
    assert before.items() <= after.items()
    assert call("convert-cache", source.with_name("walk data.gltf"), source.with_name("a.npz")).code == 0


@needs_validator
def test_the_validator_finds_nothing(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    assert call("bake", fixture("arm"), tmp_path / "a.gltf", "--clip", "bend").code == 0
    assert call("convert", tmp_path / "a.gltf", tmp_path / "a.glb").code == 0
    assert errors(validate((tmp_path / "a.glb").read_bytes())) == []

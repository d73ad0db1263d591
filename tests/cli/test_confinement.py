"""Only files that the user names are read, and those beside them that a file names."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, refusal


@pytest.fixture
def texture(call: Call, tmp_path: Path) -> Path:
    """A texture with its JSON and its mesh, in a folder of its own."""
    folder = tmp_path / "texture"
    folder.mkdir()
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    call("bake", tmp_path / "arm.glb", folder / "a.png", "--clip", "bend", "--fps", "4").product()
    os.mkfifo(folder / "pipe")
    (folder / "link").symlink_to(tmp_path / "arm.glb")
    return folder / "a.png"


@pytest.mark.parametrize("key", ["mesh", "position"])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("/etc/passwd", "leads out of the file's folder"),
        ("../arm.glb", "leads out of the file's folder"),
        ("link", "leads out of the file's folder"),
        ("/dev/zero", "leads out of the file's folder"),
        ("pipe", "is no file"),
        (".", "leads out"),
        ("none.glb", "is not beside the file"),
        ("a\0b", "can't be looked up"),
        ("\ud800", "can't be looked up"),
        ("x" * 5000, "can't be looked up"),
    ],
)
def test_a_texture_names_only_files_beside_it(key: str, name: str, words: str, texture: Path, call: Call) -> None:
    path = texture.with_name("a.png.json")
    about = json.loads(path.read_text())
    if key == "mesh":
        about["mesh"] = name
    else:
        about["position"]["file"] = name
    path.write_text(json.dumps(about))
    before = sorted(texture.parent.iterdir())
    assert words in refusal(call("convert-cache", texture, texture.with_name("out.npz")), 3)
    assert sorted(texture.parent.iterdir()) == before


SECRET = """#usda 1.0
def Mesh "s" {
point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
int[] faceVertexCounts = [3]
int[] faceVertexIndices = [0, 1, 2]
}
"""
CLIPS = 'def Mesh "s" ( clips = { dictionary default = { asset[] assetPaths = [@SECRET@] } } ) {'


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "#usda 1.0\n( subLayers = [@SECRET@] )\n",
        '#usda 1.0\ndef "x" ( references = @SECRET@</s> ) {}\n',
        '#usda 1.0\ndef "x" ( payload = @SECRET@</s> ) {}\n',
        '#usda 1.0\ndef "x" ( add variantSets = "v"\nvariants = { string v = "a" } ) {\n'
        'variantSet "v" = { "a" ( references = @SECRET@</s> ) { } }\n}\n',
        SECRET.replace('def Mesh "s" {', CLIPS),
    ],
    ids=["sublayer", "reference", "payload", "variant", "clips"],
)
def test_usd_is_one_layer(text: str, call: Call, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    (tmp_path / "secret.usda").write_text(SECRET)
    (tmp_path / "a.usda").write_text(text.replace("SECRET", str(tmp_path / "secret.usda")))
    said = refusal(call("convert-cache", tmp_path / "a.usda", tmp_path / "out.npz"), 3)
    assert "refers to other files" in said
    call("convert-cache", tmp_path / "secret.usda", tmp_path / "out.npz").product()

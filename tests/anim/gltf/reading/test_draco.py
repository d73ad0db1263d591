"""Draco meshes: read as they were before, refused where broken or without the package, and written bit for bit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Buffer, Bytes, Document
from anim.gltf.io.json_text import dump
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Mesh
from anim.operations.resample import resample
from tests.draco import BITS, EXTENSION, compressed
from tests.files import glb_of, opened, opened_fixture, opened_path
from tests.khronos import errors, needs_validator, validate

Find = Callable[[str], Path]
FIXTURES = ("arm", "biped")


def mesh_of(document: Document) -> Mesh:
    return reader.scene(document).instances[0].mesh


def changed(document: Document, **extension: Any) -> Document:
    """The document with other things in the extension of its first primitive."""
    content = json.loads(dump(document.json))
    content["meshes"][0]["primitives"][0]["extensions"][EXTENSION] |= extension
    return replace(document, json=content)


@pytest.mark.parametrize("name", FIXTURES)
def test_vertices_come_back(name: str) -> None:
    plain, packed = mesh_of(opened_fixture(name)), mesh_of(opened(glb_of(compressed(opened_fixture(name)))))
    step = np.ptp(plain.positions, axis=0).max() / 2**BITS
    np.testing.assert_allclose(packed.positions, plain.positions, atol=step)
    np.testing.assert_array_equal(packed.faces, plain.faces)
    np.testing.assert_array_equal(packed.joints, plain.joints)
    np.testing.assert_allclose(packed.weights, plain.weights, atol=1e-7)


@needs_validator
def test_the_written_file_keeps_the_draco_bytes() -> None:
    document = opened(glb_of(compressed(opened_fixture("biped"))))
    clips = reader.clips(document)
    out = opened(glb_of(writer.replace_clips(document, {i: resample(clip, fps=4) for i, clip in enumerate(clips)})))
    views = [d.json["meshes"][0]["primitives"][0]["extensions"][EXTENSION]["bufferView"] for d in (document, out)]
    stored = [d.json["bufferViews"][view]["buffer"] for d, view in zip((document, out), views, strict=True)]
    np.testing.assert_array_equal(document.buffers[stored[0]].data, out.buffers[stored[1]].data)
    assert len(out.buffers[0].data) < len(document.buffers[0].data)
    assert errors(validate(glb_of(out))) == []


def test_without_the_package_the_install_line_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    document = compressed(opened_fixture("arm"))
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(UnsupportedError, match="needs the package DracoPy") as caught:
        reader.scene(document)
    assert caught.value.help == "pip install 'gltf-anim[draco]'"


@pytest.mark.parametrize(
    ("extension", "message"),
    [
        ({"bufferView": 99}, "bufferView is 99"),
        ({"bufferView": "0"}, "bufferView is '0'"),
        ({"attributes": []}, "attributes don't name numbers"),
        ({"attributes": {"POSITION": None}}, "attributes don't name numbers"),
        ({"attributes": {"POSITION": 77}}, r"has no attribute 77 \(POSITION\)"),
        ({"attributes": {"POSITION": 0}}, "× 4 numbers for POSITION"),
        ({"bufferView": 0}, "can't be decoded"),
    ],
)
def test_faults_are_named(extension: dict[str, Any], message: str) -> None:
    with pytest.raises(FormatError, match=message):
        reader.scene(changed(compressed(opened_fixture("arm")), **extension))


def test_a_count_that_is_not_the_data_s_is_refused() -> None:
    document = compressed(opened_fixture("arm"))
    content = json.loads(dump(document.json))
    content["accessors"][content["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]["count"] += 1
    with pytest.raises(FormatError, match="numbers for POSITION"):
        reader.scene(replace(document, json=content))


def test_broken_data_is_an_error_and_no_crash() -> None:
    """Cut off anywhere, and with bytes changed: refused, or read as something else that fits."""
    document = compressed(opened_fixture("arm"))
    data = document.buffers[-1].data
    rng = np.random.default_rng(5)
    for i in range(60):
        bad = np.array(data)
        bad[rng.integers(0, len(bad), 3)] = rng.integers(0, 256, 3)
        bad = bad[: rng.integers(1, len(bad))] if i % 2 else bad
        try:
            reader.scene(_with_last(document, bad))
        except FormatError:
            continue


def _with_last(document: Document, data: Bytes) -> Document:
    content = json.loads(dump(document.json))
    content["buffers"][-1]["byteLength"] = content["bufferViews"][-1]["byteLength"] = len(data)
    buffer = Buffer(len(data), None, lambda: data)
    return replace(document, json=content, buffers=(*document.buffers[:-1], buffer))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb"])
def test_another_tool_decodes_the_same(name: str, asset: Find, tmp_path: Path) -> None:
    """glTF-Transform compresses with Google's encoder, and decodes with its decoder in WebAssembly."""
    packed, plain = tmp_path / "packed.glb", tmp_path / "plain.glb"
    for verb, source, target in (("draco", asset(name), packed), ("copy", packed, plain)):
        subprocess.run([_transform(), verb, str(source), str(target)], check=True, capture_output=True)
    ours, theirs = mesh_of(opened_path(packed)), mesh_of(opened_path(plain))
    np.testing.assert_array_equal(ours.positions, theirs.positions)
    np.testing.assert_array_equal(ours.faces, theirs.faces)
    np.testing.assert_array_equal(ours.joints, theirs.joints)
    np.testing.assert_array_equal(ours.weights, theirs.weights)


def _transform() -> str:
    """The command of glTF-Transform; skips the test where it is not installed."""
    root = Path(os.environ.get("GLTF_VALIDATOR_DIR", "."))
    folders = [str(root / ".bin"), str(root / "node_modules" / ".bin"), os.environ["PATH"]]
    found = shutil.which("gltf-transform", path=os.pathsep.join(folders))
    if found is None:
        pytest.skip("gltf-transform is not installed (npm install @gltf-transform/cli)")
    return found

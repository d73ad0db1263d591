"""Headers of arrays and pictures that lie, and odd numbers in their metadata."""

from __future__ import annotations

import io
import json
import math
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, refusal

GOOD = {
    "positions": np.zeros((2, 3, 3), "<f4"),
    "times": np.array([0.0, 1.0]),
    "faces": np.array([[0, 1, 2]], "<i4"),
}


def archive(folder: Path, name: str, shape: tuple[int, ...], size: int, kind: str = "<i4") -> Path:
    """A cache in which one array is `size` zeros under a header of its own."""
    path = folder / "a.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for each, values in {name: np.zeros(0), **GOOD}.items():
            member = io.BytesIO()
            if each == name:
                about = {"descr": kind, "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(member, about)
                member.write(bytes(size))
            else:
                np.save(member, values)
            file.writestr(f"{each}.npy", member.getvalue())
    return path


@pytest.mark.parametrize(
    ("name", "shape", "kind", "size", "words"),
    [
        ("faces", (1, 3), "<i4", 10**6, "bytes for shape (1, 3)"),
        ("faces", (2**40, 3), "<i4", 100, "bytes for shape"),
        ("positions", (2, 2**40, 3), "<f4", 100, "bytes for shape"),
        ("positions", (2, 3, 3), "<U1", 72, "of numbers"),
        ("positions", (-2, 3, 3), "<f4", 72, "shape (-2, 3, 3)"),
        ("times", (), "<f8", 8, "don't fit together"),
        ("times", (2, 2), "<f8", 32, "don't fit together"),
        ("times", (2,), "<U1", 8, "expected numbers"),
        ("faces", (1, 3), "<U1", 12, "expected integers"),
        ("faces", (1, 3), "<f4", 12, "expected integers"),
        ("rest", (3, 3), "<U1", 36, "expected numbers"),
    ],
)
def test_headers_of_arrays_that_lie(
    name: str, shape: tuple[int, ...], kind: str, size: int, words: str, call: Call, tmp_path: Path
) -> None:
    path = archive(tmp_path, name, shape, size, kind)
    assert words in refusal(call("convert-cache", path, tmp_path / "out.pc2"), 3)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "shape", "kind", "figure"),
    [("faces", (10**6, 3), "<i4", "0.036 GB"), ("positions", (2, 10**6, 3), "<f4", "0.024 GB")],
)
def test_arrays_of_zeros_count_unpacked(
    name: str, shape: tuple[int, ...], kind: str, figure: str, call: Call, tmp_path: Path
) -> None:
    """All faces, and a frame of positions."""
    path = archive(tmp_path, name, shape, 4 * math.prod(shape), kind)
    run = call("convert-cache", path, tmp_path / "out.pc2", "--memory-limit", "20MB")
    assert f"would take {figure}" in refusal(run, 4)


@pytest.mark.parametrize("value", ["1e999", "Infinity", "[" * 100_000])
def test_odd_numbers_in_the_meta_of_an_npz(value: str, call: Call, tmp_path: Path) -> None:
    meta = f'{{"parts": [{{"name": "a", "vertices": [0, {value}], "faces": [0, 1], "node": 0, "material": 0}}]}}'
    path = tmp_path / "a.npz"
    arrays: dict[str, Any] = {**GOOD, "meta": np.array(meta)}
    np.savez(path, **arrays)
    refusal(call("convert-cache", path, tmp_path / "out.pc2"), 3)


def texture(folder: Path, call: Call) -> tuple[Path, dict[str, Any]]:
    (folder / "arm.glb").write_bytes(built("arm"))
    call("bake", folder / "arm.glb", folder / "a.png", "--clip", "bend", "--fps", "4").product()
    return folder / "a.png", json.loads((folder / "a.png.json").read_text())


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def test_a_png_that_unpacks_to_more_than_its_pixels(call: Call, tmp_path: Path) -> None:
    path, about = texture(tmp_path, call)
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", about["width"], about["height"], 16, 2, 0, 0, 0))
    bomb = chunk(b"IDAT", zlib.compress(bytes(10**7)))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + header + bomb + chunk(b"IEND", b""))
    assert "unpacks to more than" in refusal(call("convert-cache", path, tmp_path / "out.npz"), 3)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"", "it has no header"),
        (chunk(b"IHDR", b"\0"), "it has no header"),
        (chunk(b"IHDR", struct.pack(">IIBBBBB", 0, 0, 16, 2, 0, 0, 0)), "0 × 0 pixels"),
        (chunk(b"IHDR", struct.pack(">IIBBBBB", 2**31 - 1, 2**31 - 1, 16, 2, 0, 0, 0)), "pixels (expected"),
    ],
)
def test_headers_of_png_that_lie(head: bytes, words: str, call: Call, tmp_path: Path) -> None:
    path, _ = texture(tmp_path, call)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b""))
    assert words in refusal(call("convert-cache", path, tmp_path / "out.npz"), 3)


def test_the_size_of_an_exr_is_that_of_its_json(call: Call, tmp_path: Path) -> None:
    package = pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    path = tmp_path / "a.exr"
    call("bake", tmp_path / "arm.glb", path, "--clip", "bend", "--fps", "4").product()
    header = {"compression": package.ZIP_COMPRESSION, "type": package.scanlineimage}
    package.File(header, {"RGB": np.zeros((700, 900, 3), np.float32)}).write(str(path))
    assert "EXR has 900 × 700 pixels" in refusal(call("convert-cache", path, tmp_path / "out.npz"), 3)


@pytest.mark.parametrize(
    ("key", "value"),
    [("width", 1e999), ("vertices", float("inf")), ("rows_per_frame", -1), ("times_s", [0, float("nan")])],
)
def test_odd_numbers_in_the_json_of_a_texture(key: str, value: object, call: Call, tmp_path: Path) -> None:
    path, about = texture(tmp_path, call)
    (tmp_path / "a.png.json").write_text(json.dumps({**about, key: value}))
    refusal(call("convert-cache", path, tmp_path / "out.npz"), 3)

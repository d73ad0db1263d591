"""Textures: pixels by hand, by Pillow and by OpenEXR, and the way back for every engine."""

from __future__ import annotations

import io
import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from anim.caches.formats import png
from anim.caches.options import WriteOptions
from anim.caches.storage import Memory
from anim.caches.vat.presets import PRESETS
from anim.errors import FormatError, RangeError, UnsupportedError
from anim.model.vertex_cache import from_arrays
from tests.anim.caches.making import FACES, cache, normals_of, off, opened, positions_of, written
from tests.khronos import errors, needs_validator, validate_many

WAYS = [
    (name, ending, depth)
    for name, preset in PRESETS.items()
    for ending in preset.endings
    for depth in (("float", "half") if ending == ".exr" else ("float",))
]


def wide() -> Any:
    """Three frames of 5000 vertices: two rows a frame."""
    positions = np.random.default_rng(3).normal(size=(3, 5000, 3)).astype(np.float32)
    return from_arrays(np.arange(3) / 24, positions, FACES)


@pytest.mark.parametrize(("preset", "ending", "depth"), WAYS)
def test_back_again(preset: str, ending: str, depth: str) -> None:
    source = cache()
    files, said = written(source, f"a{ending}", WriteOptions(preset=preset, depth=depth))
    back = opened(files)
    assert back.times == pytest.approx(source.times)
    assert (back.faces == FACES).all()
    assert said.max_error is not None
    limit = {".png": 2e-4, "float": 5e-6, "half": 4e-3}[ending if ending == ".png" else depth]
    assert said.max_error < limit
    assert off(back, source) < said.max_error + 2e-6  # and what float32 rounds
    assert normals_of(back) == pytest.approx(normals_of(source), abs=1e-3)


@pytest.mark.parametrize("ending", [".png", ".exr"])
def test_frames_of_several_rows(ending: str) -> None:
    source = wide()
    files, _ = written(source, f"a{ending}")
    about = json.loads(files.files[f"a{ending}.json"])
    assert (about["width"], about["height"], about["rows_per_frame"], about["vertices"]) == (2500, 6, 2, 5000)
    assert off(opened(files), source) < 2e-4


def test_a_png_by_hand() -> None:
    pixels = np.array([[[0, 1, 2], [65535, 256, 3]], [[1, 1, 1], [0, 0, 0]]], np.uint16)
    out = io.BytesIO()
    png.write([pixels[:1], pixels[1:]], out, width=2, height=2)
    data = out.getvalue()
    assert (
        data[:33] == b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sIIBBBBB", 13, b"IHDR", 2, 2, 16, 2, 0, 0, 0) + data[29:33]
    )
    assert (png.read(data, width=pixels.shape[1], height=pixels.shape[0]) == pixels).all()


@pytest.mark.parametrize("row_filter", range(5))
def test_pngs_of_other_programs(row_filter: int) -> None:
    """Each row 0001 0002 0003, 0001 0002 0003, … of bytes less what its filter predicts (PNG specification, 9.2)."""
    row = bytes.fromhex("0001 0002 0003" * 2)
    predicted = {
        0: (bytes(12), bytes(12)),
        1: (bytes(6) + row[:6],) * 2,
        2: (bytes(12), row),
        3: (bytes(6) + bytes(each // 2 for each in row[:6]), bytes(each // 2 for each in row[:6]) + row[:6]),
        4: (bytes(6) + row[:6], row),
    }[row_filter]
    lines = b"".join(
        bytes([row_filter]) + bytes((a - b) % 256 for a, b in zip(row, each, strict=True)) for each in predicted
    )
    parts = ((b"IHDR", struct.pack(">IIBBBBB", 2, 2, 16, 2, 0, 0, 0)), (b"IDAT", zlib.compress(lines)), (b"IEND", b""))
    chunks = [
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in parts
    ]
    assert png.read(b"\x89PNG\r\n\x1a\n" + b"".join(chunks), width=2, height=2).tolist() == [[[1, 2, 3]] * 2] * 2


def test_pillow_sees_the_high_bytes() -> None:
    pixels = np.random.default_rng(2).integers(0, 65536, (40, 30, 3)).astype(np.uint16)
    out = io.BytesIO()
    png.write([pixels[:7], pixels[7:]], out, width=30, height=40)
    seen = np.asarray(Image.open(io.BytesIO(out.getvalue())).convert("RGB"))  # Pillow keeps 8 bits of 16
    assert np.abs(seen.astype(int) - pixels // 256).max() <= 1


def test_a_png_means_what_its_json_says() -> None:
    source = cache()
    files, _ = written(source, "a.png", WriteOptions(preset="unreal"))
    about = json.loads(files.files["a.png.json"])
    pixels = png.read(files.files["a.png"], width=about["width"], height=about["height"]).reshape(7, 9, 3) / 65535
    moved = np.array(about["position"]["offset"]) + np.array(about["position"]["scale"]) * pixels
    assert source.rest is not None
    x, y, z = np.moveaxis(positions_of(source) - source.rest, -1, 0)
    assert about["position"]["encoding"] == "offset"
    assert moved == pytest.approx(100 * np.stack((x, z, y), axis=-1), abs=0.02)  # cm, Z up, left-handed
    assert about["fps"] == 30
    assert about["times_s"] == pytest.approx(source.times)


@pytest.mark.parametrize(("depth", "dtype"), [("float", np.float32), ("half", np.float16)])
def test_openexr_reads_it(depth: str, dtype: type, tmp_path: Path) -> None:
    package = pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    source = cache()
    files, _ = written(source, "a.exr", WriteOptions(preset="unity", depth=depth))
    (tmp_path / "a.exr").write_bytes(files.files["a.exr"])
    with package.File(str(tmp_path / "a.exr")) as file:
        pixels = np.array(file.channels()["RGB"].pixels)
    assert pixels.dtype == dtype
    assert source.rest is not None
    expected = positions_of(source) - (source.rest if depth == "half" else 0)
    assert pixels == pytest.approx(expected * [-1, 1, 1], abs=2e-3 if depth == "half" else 1e-7)
    about = json.loads(files.files["a.exr.json"])
    assert (about["position"]["format"], about["origin"], about["uv_v"]) == (depth, "top left", "top")


@needs_validator
def test_the_mesh_beside_finds_its_pixels() -> None:
    from pygltflib import GLTF2

    every = []
    for preset in ("godot", "three"):
        files, _ = written(wide(), "a.exr", WriteOptions(preset=preset))
        every.append(files.files["a.exr-mesh.glb"])
        gltf: Any = GLTF2().load_from_bytes(every[-1])
        accessor = gltf.accessors[gltf.meshes[0].primitives[0].attributes.TEXCOORD_1]
        view = gltf.bufferViews[accessor.bufferView]
        uv = np.frombuffer(gltf.binary_blob(), "<f4", 10000, view.byteOffset).reshape(-1, 2)
        v = 1 - uv[:, 1] if preset == "three" else uv[:, 1]
        assert (np.floor(uv[:, 0] * 2500) == np.arange(5000) % 2500).all()
        assert (np.floor(v * 6) == np.arange(5000) // 2500).all()
    for report in validate_many(every):
        assert errors(report) == []


@pytest.mark.parametrize("ending", [".png", ".exr"])
def test_the_same_cache_gives_the_same_bytes(ending: str) -> None:
    assert written(cache(step=2), f"a{ending}")[0].files == written(cache(), f"a{ending}")[0].files


@pytest.mark.parametrize("preset", ["godot", "three"])
def test_engines_that_cut_png_are_refused(preset: str) -> None:
    with pytest.raises(RangeError, match="cuts 16-bit PNG"):
        written(cache(), "a.png", WriteOptions(preset=preset))


def test_too_many_frames_are_refused() -> None:
    positions = np.zeros((5000, 4097, 1), np.float32)
    many = from_arrays(np.arange(5000.0), np.broadcast_to(positions, (5000, 4097, 3)), FACES)
    with pytest.raises(RangeError, match="at most 4096"):
        written(many, "a.png")


@pytest.mark.parametrize("name", ["a.png", "a.png.json", "a.png-mesh.glb", "a.png-normal.png"])
@pytest.mark.parametrize("cut", [0, 30, -2, None])
def test_damaged_or_missing_files_are_refused(name: str, cut: int | None) -> None:
    files, _ = written(cache(), "a.png")
    if cut is None:
        del files.files[name]
    else:
        files.files[name] = files.files[name][: cut if name != "a.png.json" or cut != -2 else -4]
    with pytest.raises(FormatError):
        opened(files).load_all()


@pytest.mark.parametrize(
    ("path", "value", "problem"),
    [
        ("frames", 10**9, "frames is 1000000000 (expected 7, by times_s and rows_per_frame)"),
        ("height", 10**9, "height is 1000000000 (expected 7, by times_s and rows_per_frame)"),
        ("vertices", 99, "vertices is 99 (expected 9 or fewer, by width and rows_per_frame)"),
        ("fps", "x", "fps is 'x' (expected a number above 0)"),
        ("fps", -1, "fps is -1 (expected a number above 0)"),
        ("width", "4", "width is '4' (expected a whole number, 1 or more)"),
        ("width", True, "width is True (expected a whole number, 1 or more)"),
        ("rows_per_frame", 1.5, "rows_per_frame is 1.5 (expected a whole number, 1 or more)"),
        ("uv_set", [1], "uv_set is [1] (expected a whole number, 0 or more)"),
        ("uv_v", "left", "uv_v is 'left' (expected 'top' or 'bottom')"),
        ("up", "x", "up is 'x' (expected 'y' or 'z')"),
        ("origin", "bottom left", "origin is 'bottom left' (expected 'top left')"),
        ("schema", 2, "schema is 2 (expected 1)"),
        ("preset", "blender", "preset is 'blender' (expected 'plain' or 'three' or "),
        ("mesh", 5, "mesh is 5 (expected text)"),
        ("times_s", 5, "times_s is 5 (expected one or more numbers)"),
        ("times_s", [0, "1"], "times_s[1] is '1' (expected a number)"),
        ("times_s", [0, float("nan")], "times_s[1] is nan (expected a number)"),
        ("position", None, "position is None (expected an object)"),
        ("position.format", "int8", "position.format is 'int8' (expected 'float' or 'half' or 'unorm16')"),
        ("position.encoding", "delta", "position.encoding is 'delta' (expected 'absolute' or 'offset')"),
        ("position.scale", [1, 2], "position.scale is [1, 2] (expected 3 numbers)"),
        ("position.offset", [1, 10**400, 1], "position.offset[1] is 1000000000"),
        ("normal.format", "half", "normal.format is 'half' (expected 'unorm16')"),
        ("normal.file", 1, "normal.file is 1 (expected text)"),
        ("engine.axes", "x z y", "engine.axes is 'x z y' (expected 'x y z')"),
        ("engine.signs", [-1, 1, 1], "engine.signs is (-1.0, 1.0, 1.0) (expected (1, 1, 1), as preset plain has)"),
        ("engine.units_per_meter", 100, "engine.units_per_meter is 100.0 (expected 1.0, as preset plain has)"),
    ],
)
def test_members_of_the_json_are_checked(path: str, value: object, problem: str) -> None:
    files, _ = written(cache(), "a.png")
    content = json.loads(files.files["a.png.json"])
    *parents, key = path.split(".")
    place = content[parents[0]] if parents else content
    place[key] = value
    files.files["a.png.json"] = json.dumps(content).encode()
    with pytest.raises(FormatError) as caught:
        opened(files)
    assert problem in str(caught.value)


@pytest.mark.parametrize("name", ["vertices", "width", "times_s", "position", "mesh", "up", "preset"])
def test_members_that_are_not_there_are_named(name: str) -> None:
    files, _ = written(cache(), "a.png")
    content = json.loads(files.files["a.png.json"])
    del content[name]
    files.files["a.png.json"] = json.dumps(content).encode()
    with pytest.raises(FormatError, match=f"has no member '{name}'"):
        opened(files)


def test_companions_are_those_that_the_json_names() -> None:
    """Earlier versions called them a-mesh.glb and a-normal.png."""
    files, _ = written(cache(), "a.png")
    for ending in ("mesh.glb", "normal.png"):
        files.files[f"a-{ending}"] = files.files.pop(f"a.png-{ending}")
        files.files["a.png.json"] = files.files["a.png.json"].replace(
            f"a.png-{ending}".encode(), f"a-{ending}".encode()
        )
    back = opened(files)
    assert (back.faces == FACES).all()
    assert normals_of(back) == pytest.approx(normals_of(cache()), abs=1e-3)


def test_other_pngs_are_refused() -> None:
    out = io.BytesIO()
    Image.new("RGB", (9, 7)).save(out, "PNG")
    files, _ = written(cache(), "a.png")
    with pytest.raises(UnsupportedError, match="8 bits"):
        opened(Memory("a.png", {**files.files, "a.png": out.getvalue()}))

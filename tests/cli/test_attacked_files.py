"""Small files that once ended in a traceback, in silence: each is done or refused."""

from __future__ import annotations

import io
import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.files import atomic
from fixtures.broken.pieces import animated, buffered, text
from tests.cli.conftest import Call
from tests.cli.running import built, refusal
from tests.fixtures.reading import split
from tests.fuzz.simulation_seeds import pack

ODD: list[Any] = [None, [], 5]
MATERIALS: list[dict[str, Any]] = [
    *({"pbrMetallicRoughness": each} for each in ODD),
    *({"pbrMetallicRoughness": {"baseColorFactor": each}} for each in (1, [1], ["x"])),
]


@pytest.mark.parametrize("index", [0, 7, "x"])
@pytest.mark.parametrize("material", MATERIALS, ids=str)
def test_odd_materials_are_drawn_or_refused(
    material: dict[str, Any], index: int | str, call: Call, tmp_path: Path
) -> None:
    document, blob = split(built("morph_cube"))
    document["materials"] = [material]
    document["meshes"][0]["primitives"][0]["material"] = index
    (tmp_path / "in.glb").write_bytes(pack(document, blob))
    run = call("render", tmp_path / "in.glb", tmp_path / "out.png", "--frames", "1", "--clip", "#0")
    assert run.code in (0, 3), run.err
    assert "Traceback" not in run.err
    for name in ("out.usda", "out.glb"):
        run = call("bake", tmp_path / "in.glb", tmp_path / name, "--fps", "4", "--clip", "#0")
        assert run.code in (0, 3), run.err


def test_faces_of_fractions_are_refused(call: Call, tmp_path: Path) -> None:
    data = io.BytesIO()
    np.savez(data, positions=np.zeros((1, 3, 3), np.float32), times=np.zeros(1), faces=np.array([[0, 1, 1.5]]))
    (tmp_path / "in.npz").write_bytes(data.getvalue())
    assert "faces" in refusal(call("convert-cache", tmp_path / "in.npz", tmp_path / "out.mdd"), 3)


@pytest.mark.parametrize("name", ["in.gltf", "in.json"])
def test_json_a_million_deep_is_named(name: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / name).write_text('{"a": ' + "[" * 10**6)
    line = ("inspect",) if name == "in.gltf" else ("from-euler",)
    assert name in refusal(call(*line, tmp_path / name, *([tmp_path / "out.glb"] * (name == "in.json"))), 3)


def of_three_clips(tmp_path: Path) -> Path:
    """A mesh whose second clip enlarges it beyond float32."""
    sizes = np.ones((2, 3)), np.array([[1, 1, 1], [3e38] * 3])
    arrays = buffered(
        ("SCALAR", 5126, [0, 1]), ("VEC3", 5126, 2 * np.eye(3)), *(("VEC3", 5126, each) for each in sizes)
    )
    target = {"sampler": 0, "target": {"node": 0, "path": "scale"}}
    clips = [
        {"name": name, "samplers": [{"input": 0, "output": output}], "channels": [target]}
        for name, output in (("sound", 2), ("huge", 3), ("last", 2))
    ]
    meshes = [{"primitives": [{"attributes": {"POSITION": 1}}]}]
    scene = {"scenes": [{"nodes": [0]}], "nodes": [{"name": "n", "mesh": 0}], "meshes": meshes}
    path = tmp_path / "in.gltf"
    path.write_bytes(text({**scene, **arrays, "animations": clips}))
    return path


@pytest.mark.parametrize("ending", ["npz", "pc2", "mdd", "ply", "glb", "gltf", "png"])
def test_a_later_clip_that_fails_is_named_with_what_was_written(ending: str, call: Call, tmp_path: Path) -> None:
    path = of_three_clips(tmp_path)
    options = ("--rigid", "--fps", "4", "--format", ending)
    call("bake", path, tmp_path / f"alone-sound.{ending}", "--clip", "sound", *options).product()
    alone = {name.name.removeprefix("alone-") for name in tmp_path.glob("alone-*")}
    run = call("bake", path, tmp_path / f"{{clip}}.{ending}", *options)
    assert run.code == 3
    first, second = run.err.splitlines()[-2:]
    assert first == f"note: 1 file written before: {tmp_path / f'sound.{ending}'}"
    assert second.startswith(f"gltf-anim: {path}: clip 'huge', frame ")
    assert second.endswith("is beyond float32 (got [inf, 0.0, 0.0])")
    assert {each.name for each in tmp_path.iterdir()} - {"in.gltf"} == {*alone, *(f"alone-{name}" for name in alone)}


def test_a_dry_run_of_a_clip_that_fails_names_no_files(call: Call, tmp_path: Path) -> None:
    path = of_three_clips(tmp_path)
    run = call("bake", path, tmp_path / "{clip}.npz", "--rigid", "--fps", "4", "--dry-run")
    assert "clip 'huge', frame " in refusal(run, 3)
    assert list(tmp_path.iterdir()) == [path]


BINARY = b"\xff\xfe\x80solid x\n"
ASCII_STL = """solid Würfel
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid
""".encode("latin-1")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"solid x\nfacet normal 0 0 1\n" + BINARY, "has no vertices"),
        (bytes(range(256)) * 2, "has no vertices"),
        (ASCII_STL.replace(b"vertex 0 1 0\n", b""), "is no .stl that can be read"),
        (b"endsolid solid" + BINARY, "is no .stl that can be read: damaged"),
        (bytes(80) + b"\xff\xff\xff\xff" + bytes(50), "has no vertices"),
    ],
)
def test_stl_that_is_no_text_in_utf_8_is_refused_by_its_fault(
    data: bytes, words: str, call: Call, tmp_path: Path
) -> None:
    """And not by the package that would guess its encoding, which is not installed."""
    (tmp_path / "in.stl").write_bytes(data)
    assert words in refusal(call("convert-cache", tmp_path / "in.stl", tmp_path / "out.npz"), 3)


def test_stl_of_text_in_latin_1_is_read(call: Call, tmp_path: Path) -> None:
    (tmp_path / "in.stl").write_bytes(ASCII_STL)
    call("convert-cache", tmp_path / "in.stl", tmp_path / "out.npz").product()
    assert np.load(tmp_path / "out.npz")["positions"].shape == (1, 3, 3)


@pytest.mark.parametrize("scale", ["1e300", "1e16", "0"])
def test_a_scale_beyond_all_lengths_is_wrong_usage(scale: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / "in.csv").write_text("time,a.rx\n0,0\n1,1\n")
    said = refusal(call("from-euler", tmp_path / "in.csv", tmp_path / "out.glb", "--scale", scale), 2)
    assert said.endswith("(expected 1e-12 to 1e+15)")


def test_an_array_header_that_does_not_end_is_refused(call: Call, tmp_path: Path) -> None:
    data = io.BytesIO()
    np.save(data, np.zeros((1, 3, 3), np.float32))
    odd = data.getvalue().replace(b"), }", b"), ((", 1)
    with zipfile.ZipFile(tmp_path / "in.npz", "w") as archive:
        archive.writestr("positions.npy", odd)
    assert "is damaged" in refusal(call("convert-cache", tmp_path / "in.npz", tmp_path / "out.pc2"), 3)


LONG = "x" * 10**5


@pytest.mark.parametrize(
    "change",
    [
        {"schema": LONG},
        {"order": LONG},
        {"unit": LONG},
        {LONG: 1},
        {"nodes": [{"name": "a", "parent": LONG, "curves": {}}]},
        {"nodes": [{"name": "a", "curves": {LONG: {"times": [0], "values": [0]}}}]},
        {"nodes": [{"name": "a", "curves": {"rotation.x": {"times": [0], "values": [0], "interpolation": LONG}}}]},
        {"nodes": [{"name": LONG, "curves": {}}] * 2},
    ],
    ids=lambda change: str(change).replace(LONG, "LONG"),
)
def test_what_curves_say_is_cut_in_messages(change: dict[str, Any], call: Call, tmp_path: Path) -> None:
    about = {"schema": "euler-curves/1", "order": "XYZ", "frame": "extrinsic", "unit": "deg", "nodes": []}
    (tmp_path / "in.json").write_text(json.dumps({**about, **change}))
    run = call("from-euler", tmp_path / "in.json", tmp_path / "out.glb")
    refusal(run, 3)
    assert max(map(len, run.err.splitlines())) < 800


def test_a_buffer_of_another_file_is_not_overwritten(call: Call, tmp_path: Path) -> None:
    """b.bin belongs to a.gltf; a new b.gltf takes a buffer of another name."""
    document, blob = split(built("arm"))
    (tmp_path / "b.bin").write_bytes(blob)
    document["buffers"] = [{"byteLength": len(blob), "uri": "b.bin"}]
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    (tmp_path / "in.glb").write_bytes(built("biped"))
    before = call("convert", tmp_path / "a.gltf", "-").product()
    call("convert", tmp_path / "in.glb", tmp_path / "b.gltf").product()
    assert call("convert", tmp_path / "a.gltf", "-").product() == before
    assert (tmp_path / "b.bin").read_bytes() == blob
    assert call("inspect", tmp_path / "b.gltf").code == 0


@pytest.mark.parametrize(
    "line", ["convert in.glb out.glb", "resample in.glb out.glb --fps 4", "convert-cache in.npz out.pc2"]
)
def test_an_input_that_is_cut_short_while_it_is_copied(
    line: str, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A document was read whole before; a cache, which is read by frames, is refused as the input's fault."""
    monkeypatch.chdir(tmp_path)
    Path("in.glb").write_bytes(built("arm"))
    call("bake", "in.glb", "in.npz", "--clip", "bend", "--fps", "4").product()
    call(*line.replace(" out.", " whole.").split()).product()
    name, out = (word for word in line.split() if "." in word)
    create = atomic.create_temporary

    def cut(*arguments: Any) -> tuple[int, Path]:
        os.truncate(name, 500)
        return create(*arguments)

    monkeypatch.setattr(atomic, "create_temporary", cut)
    run = call(*line.split())
    if name == "in.npz":
        assert "in.npz: " in refusal(run, 3)
        assert not Path(out).exists()
    else:
        run.product()
        assert Path(out).read_bytes() == Path(f"whole{Path(out).suffix}").read_bytes()


TIMES = {
    "down": [1, 0],
    "equal": [1, 1],
    "negative": [-1, 0],
    "NaN": [0, np.nan],
    "infinite": [0, np.inf],
    "none": None,
}


@pytest.mark.parametrize("times", TIMES)
@pytest.mark.parametrize(
    "line", ["convert-cache in.npz out.pc2", "convert-cache in.npz o.npz --fps 9", "diff in.npz in.npz"]
)
def test_times_of_an_npz_are_its_own_fault(
    times: str, line: str, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    arrays: dict[str, Any] = {"positions": np.zeros((2, 3, 3), np.float32), "faces": np.array([[0, 1, 2]])}
    np.savez("in.npz", **arrays if TIMES[times] is None else {**arrays, "times": np.array(TIMES[times], float)})
    assert "times" in refusal(call(*line.split()), 3)


@pytest.mark.parametrize("times", TIMES)
def test_times_of_a_texture_are_its_own_fault(times: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    call("bake", tmp_path / "arm.glb", tmp_path / "a.png", "--clip", "bend", "--fps", "1").product()
    about = json.loads((tmp_path / "a.png.json").read_text())
    assert len(about["times_s"]) == 2
    (tmp_path / "a.png.json").write_text(json.dumps({**about, "times_s": TIMES[times]}))
    refusal(call("convert-cache", tmp_path / "a.png", tmp_path / "out.npz"), 3)
    assert not (tmp_path / "out.npz").exists()


def test_a_compressed_view_without_its_object_is_refused(call: Call, tmp_path: Path) -> None:
    document = animated()
    document["bufferViews"][1]["extensions"] = {"EXT_meshopt_compression": None}
    (tmp_path / "in.gltf").write_bytes(text(document))
    run = call("resample", tmp_path / "in.gltf", tmp_path / "out.glb", "--fps", "4")
    assert "bufferViews[1].extensions.meshopt: is no object" in refusal(run, 3)


@pytest.mark.parametrize("ending", ["obj", "ply", "usda"])
def test_texture_coordinates_of_three_components_are_refused(ending: str, call: Call, tmp_path: Path) -> None:
    document, blob = split(built("morph_cube"))
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = attributes["POSITION"]
    (tmp_path / "in.glb").write_bytes(pack(document, blob))
    run = call("bake", tmp_path / "in.glb", tmp_path / f"out.{ending}", "--rigid", "--fps", "1", "--clip", "#0")
    assert "TEXCOORD_0 has shape" in refusal(run, 3)


def test_an_obj_without_faces_has_no_line_of_one(call: Call, tmp_path: Path) -> None:
    none = np.zeros((0, 3), np.int64)
    np.savez(tmp_path / "in.npz", positions=np.zeros((1, 3, 3), np.float32), times=np.zeros(1), faces=none)
    call("convert-cache", tmp_path / "in.npz", tmp_path / "out.obj").product()
    assert not [line for line in (tmp_path / "out.obj").read_text().splitlines() if line.startswith("f")]


def test_caches_of_other_numbers_of_vertices_are_not_compared(call: Call, tmp_path: Path) -> None:
    for count in (0, 3, 4):
        faces = np.arange(3 if count else 0).reshape(-1, 3)
        positions = np.zeros((1, count, 3), np.float32)
        np.savez(tmp_path / f"{count}.npz", positions=positions, times=np.zeros(1), faces=faces)
    said = refusal(call("diff", tmp_path / "3.npz", tmp_path / "4.npz"), 2)
    assert "have 3 vertices and 4 (expected the same)" in said
    assert "has no vertices" in refusal(call("diff", tmp_path / "0.npz", tmp_path / "3.npz"), 3)
    assert "has no vertices" in refusal(call("convert-cache", tmp_path / "0.npz", tmp_path / "out.glb"), 3)

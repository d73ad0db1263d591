"""Only finite numbers leave: values that float32 can't hold are an error with the frame and the vertex."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from anim.errors import FormatError
from anim.model import FrameChunk
from cli.reports import json_report
from fixtures.broken.pieces import animated, buffered, text
from tests.cli.conftest import Call, Find
from tests.cli.running import built, refusal
from tests.files import opened_path

CACHES = ("npz", "pc2", "mdd", "ply", "obj", "stl", "png", "exr", "glb", "usda")


@pytest.fixture
def huge(asset: Find, tmp_path: Path) -> Path:
    """A skinned mesh whose joints are scaled by 1e30, one below the other."""
    document = json.loads(asset("SimpleSkin.gltf").read_text())
    for node in document["skins"][0]["joints"]:
        document["nodes"][node]["scale"] = [1e30, 1e30, 1e30]
    path = tmp_path / "huge.gltf"
    path.write_text(json.dumps(document))
    return path


@pytest.fixture
def infinite(tmp_path: Path) -> Path:
    """A node below nine others that are scaled by 1e38: its motion is beyond float64."""
    document = animated()
    above = [{"scale": [1e38] * 3, "children": [i + 1]} for i in range(1, 10)]
    document["nodes"] += [*above, {}]
    document["scenes"] = [{"nodes": [0, 1]}]
    document["animations"][0]["channels"][0]["target"]["node"] = 10
    path = tmp_path / "infinite.gltf"
    path.write_bytes(text(document))
    return path


@pytest.mark.parametrize("ending", CACHES)
def test_a_bake_beyond_float32_is_refused(ending: str, huge: Path, call: Call, tmp_path: Path) -> None:
    pytest.importorskip({"exr": "OpenEXR", "usda": "pxr"}.get(ending, "numpy"))
    run = call("bake", huge, tmp_path / f"out.{ending}", "--fps", "4")
    assert "vertex 2 is beyond float32" in refusal(run, 3)
    assert list(tmp_path.iterdir()) == [huge]


@pytest.mark.parametrize("line", [["render", "out.png"], ["collapse", "--format", "json"]])
def test_frames_beyond_float32_are_refused(line: list[str], huge: Path, call: Call, tmp_path: Path) -> None:
    command, *others = (str(tmp_path / each) if each == "out.png" else each for each in line)
    assert "frame 0: vertex 2 is beyond float32" in refusal(call(command, huge, *others), 3)


@pytest.mark.parametrize("line", ["inspect", "inspect --continuity --tracks", "loop", "loop --find", "check"])
def test_values_near_the_end_of_float32_are_reported(line: str, call: Call, tmp_path: Path) -> None:
    """Their squares are far beyond it."""
    path = tmp_path / "a.gltf"
    path.write_bytes(text(animated(values=((0, 0, 0), (3.4e38, -3.4e38, 3.4e38)))))
    command, *options = line.split()
    report = call(command, path, "--format", "json", *options).json
    if command == "inspect":
        (clip,) = report["files"][0]["clips"]
        assert clip["seam_m"] == pytest.approx(3.4e38 * np.sqrt(3))
        assert clip["seam_speed_m_per_s"] < 1e-9 * clip["seam_m"]


def test_a_report_of_infinity_is_refused(infinite: Path, call: Call) -> None:
    said = refusal(call("loop", infinite, "--format", "json"), 3)
    assert "no report of it is possible" in said


def test_infinity_in_one_file_does_not_cost_the_entries_of_others(infinite: Path, asset: Find, call: Call) -> None:
    plain = asset("SimpleSkin.gltf")
    run = call("inspect", infinite, plain, "--format", "json", "--continuity")
    bad, good = json.loads(run.out)["files"]
    assert run.code == 3
    assert f"{infinite}: clips[0].seam_m is nan: no report of it is possible" in run.err
    assert "clips[0].seam_m is nan" in bad["error"]
    assert good == json.loads(call("inspect", plain, "--format", "json", "--continuity").product())["files"][0]


def test_the_first_number_that_json_cannot_hold_is_named() -> None:
    with pytest.raises(FormatError, match=r"clips\[1\]\.error is nan"):
        json_report.dump({"clips": [{"error": 1.0}, {"error": float("nan")}]})


@pytest.mark.parametrize("ending", ["pc2", "mdd", "npz", "png", "glb"])
@pytest.mark.parametrize("line", ["v 0 0 1e300", "v nan 0 1"])
def test_a_mesh_beyond_float32_is_refused(line: str, ending: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text(f"{line}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    refusal(call("convert-cache", path, tmp_path / f"out.{ending}"), 3)
    assert list(tmp_path.iterdir()) == [path]


WEIGHTS = {"sampler": 0, "target": {"node": 0, "path": "weights"}}


def of_morph_targets(largest: float) -> bytes:
    """A triangle of two targets, which move a vertex by `largest`, the first alone and then both."""
    moves = largest * np.array([[1, -1, 1], [0, 0, 0], [0, 0, 0]])
    arrays = buffered(
        ("SCALAR", 5126, [0, 1]), ("SCALAR", 5126, [1, 0, 1, 1]), ("VEC3", 5126, np.eye(3)), ("VEC3", 5126, moves)
    )
    meshes = [{"primitives": [{"attributes": {"POSITION": 2}, "targets": [{"POSITION": 3}] * 2}]}]
    clip = {"samplers": [{"input": 0, "output": 1}], "channels": [WEIGHTS]}
    return text({"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": meshes, "animations": [clip], **arrays})


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_morph_targets_near_the_end_of_float32_write_numbers_or_nothing(
    ending: str, call: Call, tmp_path: Path
) -> None:
    path, out = tmp_path / "a.gltf", tmp_path / f"out.{ending}"
    path.write_bytes(of_morph_targets(3e38))
    assert "is beyond float32" in refusal(call("bake", path, out, "--rigid", "--fps", "4"), 3)
    assert list(tmp_path.iterdir()) == [path]
    path.write_bytes(of_morph_targets(1e38))
    call("bake", path, out, "--rigid", "--fps", "4").product()
    json.dumps(opened_path(out).json, allow_nan=False)


@pytest.mark.parametrize("ending", ["pc2", "npz"])
def test_a_texture_scaled_beyond_float32_is_refused(ending: str, call: Call, tmp_path: Path) -> None:
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    call("bake", tmp_path / "arm.glb", tmp_path / "a.png", "--clip", "bend", "--fps", "4").product()
    about = json.loads((tmp_path / "a.png.json").read_text())
    about["position"]["scale"] = [1e308, 1e308, 1e308]
    (tmp_path / "a.png.json").write_text(json.dumps(about))
    assert "is beyond float32" in refusal(call("convert-cache", tmp_path / "a.png", tmp_path / f"o.{ending}"), 3)
    assert not (tmp_path / f"o.{ending}").exists()


@pytest.mark.parametrize(
    ("settings", "samples", "words"),
    [
        ("metersPerUnit = nan", "0", "m per unit"),
        ("metersPerUnit = inf", "0", "m per unit"),
        ("metersPerUnit = 0", "0", "m per unit"),
        ("metersPerUnit = -1", "0", "m per unit"),
        ("timeCodesPerSecond = -24", "0", "time codes per second"),
        ("timeCodesPerSecond = inf", "0", "inf time codes per second"),  # took all time with a skeleton or points
        ("", "1e308", "the last frame is at"),
    ],
)
def test_usd_in_impossible_units_is_refused(
    settings: str, samples: str, words: str, call: Call, tmp_path: Path
) -> None:
    pytest.importorskip("pxr")
    points = "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]"
    text = f'#usda 1.0\n(\n{settings}\n)\ndef Mesh "a" {{\npoint3f[] points.timeSamples = {{ {samples}: {points} }}\n'
    (tmp_path / "a.usda").write_text(f"{text}int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n}}\n")
    assert words in refusal(call("convert-cache", tmp_path / "a.usda", tmp_path / "out.mdd"), 3)


@pytest.mark.parametrize("name", ["positions", "normals", "tangents"])
def test_a_chunk_names_frame_and_vertex(name: str) -> None:
    arrays = {each: np.zeros((2, 3, 3), np.float32) for each in ("positions", "normals", "tangents")}
    assert FrameChunk(5, **arrays).check_finite()
    arrays[name][1, 2, 0] = np.inf
    with pytest.raises(FormatError, match=r"frame 6: vertex 2 .*beyond float32"):
        FrameChunk(5, **arrays).check_finite()

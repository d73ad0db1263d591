"""Notes, warnings and progress of `bake`."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.writing import writer
from cli.progress import Progress
from fixtures.broken.pieces import buffered, text
from tests.anim.skinning.analysis.test_method_deviation import torn
from tests.cli.conftest import Call, Find, Fixture
from tests.clips import clip, track
from tests.files import glb_of, opened_fixture


def test_notes_say_which_file_they_are_about(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("bake", fixture("biped"), tmp_path / "{clip}.glb", "--fps", 12)
    assert run.code == 0
    assert re.search(r"^note: \w+\.glb(, \w+\.glb)*: \d+ morph targets? \(", run.err, re.MULTILINE)
    assert "1 morph targets" not in run.err
    one = call("bake", fixture("tube"), tmp_path / "one.glb", "--fps", 12, "--clip", "bend90")
    assert re.search(r"^note: \d+ morph target", one.err, re.MULTILINE)


def test_how_many_files_a_sequence_has_is_said(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("bake", fixture("arm"), tmp_path / "walk.ply", "--clip", "twist", "--fps", "2")
    assert "3 frames of" in run.err
    assert ", 3 files, " in run.err
    assert ", 1 file" not in call("bake", fixture("arm"), tmp_path / "a.npz", "--clip", "twist").err


def test_bad_sums_are_said(call: Call, tmp_path: Path) -> None:
    weights = np.array([[0.5, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]])
    content = buffered(("VEC3", 5126, np.eye(3)), ("VEC4", 5121, np.zeros((3, 4))), ("VEC4", 5126, weights))
    content |= {
        "nodes": [{"mesh": 0, "skin": 0}, {}],
        "skins": [{"joints": [1, 0]}],
        "meshes": [{"name": "flag", "primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}]}],
    }
    (tmp_path / "flag.gltf").write_bytes(text(content))
    run = call("bake", tmp_path / "flag.gltf", tmp_path / "flag.npz")
    start = f"warning: {tmp_path / 'flag.gltf'}: mesh 'flag': skin weights of 1 vertex"
    assert f"{start} don't add up to 1 (0.5); they are divided by their sum, as players do\n" in run.err
    assert f"{start} are all 0; they follow the first joint listed, as in three.js\n" in run.err


def test_rotation_keys_that_are_normalized_are_counted_once(call: Call, tmp_path: Path) -> None:
    """In the words of `resample`; a clip in the files of two meshes is one, and clips that aren't baked are none."""
    content = buffered(
        ("VEC3", 5126, np.eye(3)),
        ("SCALAR", 5126, [0, 1]),
        ("VEC4", 5126, np.array([[0, 0, 0, 1], [0, 0, 0.8, 1]])),
        ("VEC4", 5126, np.array([[0, 0, 0, 1], [0, 0, 0.6, 0.8]])),
    )
    content |= {
        "nodes": [{"mesh": 0}, {"mesh": 1}],
        "meshes": [{"name": name, "primitives": [{"attributes": {"POSITION": 0}}]} for name in ("one", "two")],
        "animations": [
            {
                "name": name,
                "samplers": [{"input": 1, "output": output}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
            }
            for name, output in (("long", 2), ("unit", 3))
        ],
    }
    path = tmp_path / "two.gltf"
    path.write_bytes(text(content))
    words = "1 rotation key of clip 'long' is not a unit quaternion; "
    run = call("bake", path, tmp_path / "{clip}-{mesh}.npz", "--rigid")
    assert len(list(tmp_path.glob("*.npz"))) == 4
    assert run.err.count(f"note: {words}the bake normalizes rotations, as most players do\n") == 1
    assert f"warning: {words}" in call("resample", path, "-", "--fps", "30").err
    assert "quaternion" not in call("bake", path, tmp_path / "unit.npz", "--rigid", "--clip", "unit").err
    assert "quaternion" not in call("bake", path, tmp_path / "long.npz", "--rigid", "--clip", "long", "-q").err


def test_a_method_that_loses_the_model_is_told_however_quiet(call: Call, tmp_path: Path) -> None:
    _, played = torn()
    (tmp_path / "torn.glb").write_bytes(glb_of(writer.replace_clips(opened_fixture("tube"), {0: played})))
    bake = ("bake", tmp_path / "torn.glb", tmp_path / "torn.npz", "--clip", "torn", "--fps", "8", "-q")
    assert call(*bake).err == ""
    run = call(*bake, "--method", "dqs")
    assert run.code == 0
    assert run.err.startswith("warning: dqs can't be used: a vertex is 19.7 m from where linear blending")
    assert "model's size of 1.04 m, at 1 s of clip 'torn'\n" in run.err
    report = call("collapse", tmp_path / "torn.glb", "--clip", "torn", "--samples-per-second", "8").text
    assert "dqs can't be used" in report
    assert "--method dqs" not in report


def test_joints_that_scale_unevenly_are_named_for_methods_that_turn(call: Call, tmp_path: Path) -> None:
    grown = clip(track("scale", [0, 1], [[1, 1, 1], [1, 1, 2]], node=1), name="grown")
    (tmp_path / "grown.glb").write_bytes(glb_of(writer.replace_clips(opened_fixture("tube"), {0: grown})))
    bake = ("bake", tmp_path / "grown.glb", tmp_path / "grown.npz", "--clip", "grown")
    name = opened_fixture("tube").json["nodes"][1]["name"]
    assert (
        f"note: '{name}': non-uniform scale, for which tools define dqs differently"
        in call(*bake, "--method", "dqs").err
    )
    assert "non-uniform scale" not in call(*bake).err


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_for_people_and_long_jobs(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([0.0, 0.5, 2.0, 2.05, 3.0])
    monkeypatch.setattr("time.monotonic", lambda: next(now))
    monkeypatch.setattr("sys.stderr", Terminal())
    import sys

    progress = Progress("walk.npz", 100)
    progress(10)  # after half a second: nothing yet
    assert sys.stderr.getvalue() == ""  # type: ignore[union-attr]
    progress(50)
    assert sys.stderr.getvalue() == "\rwalk.npz " + "█" * 15 + "░" * 15 + "  50 %, 2 s left"  # type: ignore[union-attr]
    progress(51)  # too soon after the last
    progress(100)
    progress.close()
    assert sys.stderr.getvalue().endswith(" \r")  # type: ignore[union-attr]
    monkeypatch.setattr("sys.stderr", io.StringIO())
    monkeypatch.setattr("time.monotonic", lambda: 1e9)
    Progress("walk.npz", 100)(50)
    assert sys.stderr.getvalue() == ""  # type: ignore[union-attr]


def test_what_lies_between_keys_is_said_where_it_can_be_seen(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    out = tmp_path / "tube.npz"
    words = "linear interpolation between frames: error of "
    run = call("bake", fixture("tube"), out, "--clip", "twist180")
    assert words in run.err
    assert "of clip 'twist180' (reduce with --fps)" in run.err
    assert words not in call("bake", fixture("tube"), out, "--clip", "twist180", "--fps", 30).err
    several = call("bake", fixture("tube"), tmp_path / "{clip}.npz").err
    assert several.count(words) == 1
    assert "clips are affected" in several


def test_meshes_that_are_left_out_are_counted(call: Call, asset: Find, tmp_path: Path) -> None:
    out = tmp_path / "a.npz"
    run = call("bake", asset("Knight.glb"), out, "--clip", "Idle")
    assert "warning: skipped 3308 vertices of unskinned meshes (include with --rigid)" in run.err
    assert "left out" not in call("bake", asset("Knight.glb"), out, "--clip", "Idle", "--rigid").err
    assert "left out" not in call("bake", asset("Fox.glb"), out, "--clip", "Run").err


def test_meshes_of_other_scenes_are_said(call: Call, tmp_path: Path) -> None:
    """Players show the default scene; caches and pictures have the meshes of all, which was said nowhere."""
    document = opened_fixture("tube")
    nodes = document.json["nodes"]
    skinned = next(i for i, node in enumerate(nodes) if "mesh" in node)
    nodes.append({**nodes[skinned], "name": "spare"})
    document.json["scenes"].append({"nodes": [len(nodes) - 1]})
    data = glb_of(document)
    expected = "'spare' is outside the default scene, which players show; its mesh is included (--mesh GLOB selects)"
    bake = call("bake", "-", tmp_path / "a.npz", "--clip", "twist90", "--fps", "2", "-q", stdin=data)
    assert bake.err.strip().endswith(expected)
    render = call("render", "-", tmp_path / "a.png", "--clip", "twist90", "--frames", "1", "-q", stdin=data)
    assert render.err.strip().endswith(expected)
    assert expected not in call("render", "-", tmp_path / "a.png", "--frames", "1", "--hide", "spare", stdin=data).err


@pytest.mark.parametrize("ending", ["glb", "npz"])
def test_the_error_between_frames_is_reported_at_any_rate(ending: str, call: Call, asset: Find, tmp_path: Path) -> None:
    """Also where keys are as dense as 24 per second; `diff` finds the same."""
    bake = ("bake", asset("Fox.glb"), tmp_path / f"fox.{ending}", "--clip", "Walk")
    assert re.search(r"^warning: linear interpolation between frames: error of 1\.3\d m", call(*bake).err, re.MULTILINE)
    slow = call(*bake, "--fps", "8").err
    assert re.search(r"^note: linear interpolation between frames: .* higher --fps\)$", slow, re.MULTILINE)
    assert call(*bake, "--fps", "8", "-q").err == ""

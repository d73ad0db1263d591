"""`gltf-anim simulate rigid` as a user runs it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import anim
from tests.anim.simulation.rigid_bodies.cases import BOX_AND_FLOOR, needs_rapier
from tests.cli.conftest import Call, Fixture
from tests.khronos import errors, needs_validator, validate

BRICKS = ("--body", "brick*", "--shape", "box", "--floor", "0", "--duration", "0.5")


@needs_rapier
def test_a_wall_is_written_with_a_report(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out, report = tmp_path / "out.glb", tmp_path / "report.json"
    ball = ("--body", "ball", "--velocity", "ball=0,0,-9")
    run = call("simulate", "rigid", fixture("wall"), out, *BRICKS, *ball, "--report", report)
    assert run.code == 0, run.err
    assert "31 bodies" in run.err
    found = json.loads(report.read_text())
    assert (found["kind"], found["bodies"], found["static"], found["step_s"]) == ("rigid", 31, 1, 1 / 240)
    assert found["impacts"] > 0
    assert found["energy_j"]["end"] < found["energy_j"]["start"]
    clip = anim.load(out).clips["rigid"]
    assert (len(clip.tracks), clip.end) == (62, 0.5)
    again = tmp_path / "again.glb"
    call("simulate", "rigid", fixture("wall"), again, *BRICKS, *ball).product()
    assert again.read_bytes() == out.read_bytes()


@needs_rapier
@needs_validator
@pytest.mark.parametrize("options", [(), ("--max-error", "1mm"), ("--warm-up", "0.2", "--gravity", "1,-5,0")])
def test_what_is_written_is_valid(options: tuple[str, ...], fixture: Fixture, call: Call) -> None:
    data = call("simulate", "rigid", fixture("wall"), "-", *BRICKS, *options).product()
    assert errors(validate(data)) == []


@needs_rapier
@needs_validator
def test_bodies_of_the_extension_need_no_option(call: Call) -> None:
    data = call("simulate", "rigid", "-", "-", stdin=BOX_AND_FLOOR).product()
    assert errors(validate(data)) == []
    assert b"KHR_physics_rigid_bodies" in data


@needs_rapier
def test_required_physics_is_noted_where_it_is_not_used(call: Call) -> None:
    required = {"extensionsRequired": ["KHR_implicit_shapes", "KHR_physics_rigid_bodies"]}
    data = json.dumps(json.loads(BOX_AND_FLOOR) | required).encode()
    run = call("simulate", "rigid", "-", "-", stdin=data)
    assert "note: " not in run.err
    words = "requires KHR_implicit_shapes, KHR_physics_rigid_bodies: kept as it is; bodies stay"
    assert words in call("convert", "-", "-", stdin=run.product()).err
    assert "is required but used by simulate rigid only" in call("check", "-", stdin=data).text


@needs_rapier
def test_tracks_are_put_into_the_driving_clip(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    """The first hop drives; the bricks of the second run replace those of the first."""
    out, merged = tmp_path / "out.glb", tmp_path / "merged.glb"
    call("simulate", "rigid", fixture("wall"), out, *BRICKS).product()
    call("simulate", "rigid", out, merged, *BRICKS, "--body", "ball", "--merge").product()
    clips = anim.load(merged).clips
    assert clips.names == ("rigid",)
    assert len(clips["rigid"].tracks) == 62


@needs_rapier
def test_nodes_without_meshes_are_no_bodies(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    run = call("simulate", "rigid", fixture("wall"), tmp_path / "out.glb", "--body", "*", "--duration", "0.1")
    assert run.code == 0, run.err
    assert "of --body without a mesh of their own are no bodies" in run.err
    assert "31 bodies" in run.err


@needs_rapier
@pytest.mark.parametrize(
    ("name", "args", "code", "words"),
    [
        ("wall", (), 2, "no body to simulate"),
        ("wall", ("--body", "tile*"), 5, "no node"),
        ("wall", (*BRICKS, "--density", "-1"), 2, "density is -1"),
        ("wall", (*BRICKS, "--step", "0"), 2, "--step is '0'"),
        ("wall", (*BRICKS, "--fps", "0"), 2, "--fps is 0"),
        ("wall", (*BRICKS, "--gravity", "1,2"), 2, "expected 3 numbers"),
        ("wall", (*BRICKS, "--velocity", "ball=1,0,0"), 2, "names no body"),
        ("wall", (*BRICKS, "--velocity", "1,0,0"), 2, "expected GLOB=X,Y,Z"),
        ("wall", (*BRICKS, "--velocity", "brick*=1e9,0,0"), 2, "limit 1e+06"),
        ("wall", (*BRICKS, "--max-error", "x"), 2, "--max-error"),
        ("wall", (*BRICKS, "--gravity", "0,-1e30,0"), 2, "limit 10000"),
        ("wall", ("--body", "brick*", "--floor", "1e30"), 2, "--floor is at 1e+30 m (limit 100000)"),
        ("biped", ("--body", "body"), 4, "is skinned"),
        ("biped", ("--body", "left_foot"), 5, "no mesh to collide with"),
        ("flag", ("--body", "flag"), 3, "is flat: its hull has no volume"),
    ],
)
def test_input_without_sense_is_refused_in_one_line(
    name: str, args: tuple[str, ...], code: int, words: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out = tmp_path / "out.glb"
    run = call("simulate", "rigid", fixture(name), out, *args)
    assert (run.code, out.exists()) == (code, False), run.err
    assert words in run.err
    assert len(run.err.splitlines()) <= 2


@needs_rapier
@pytest.mark.parametrize(
    ("old", "new", "code", "words"),
    [
        (b'"mass": 2', b'"mass": -2', 3, "mass is -2 kg"),
        (b'"angularVelocity": [0, 0, 0]', b'"angularVelocity": [1e30, 0, 0]', 6, "diverges in step"),
        (b'"mass": 2', b'"mass": 1e30', 3, "0 is an infinite mass"),
        (b'"size": [1, 1, 1]', b'"size": [1, 1e20, 1]', 3, "limit 100000 m"),
        (b'"shape": 1', b'"shape": 5', 3, "there is no shape 5"),
    ],
)
def test_a_faulty_file_is_refused_in_one_line(
    old: bytes, new: bytes, code: int, words: str, call: Call, tmp_path: Path
) -> None:
    assert old in BOX_AND_FLOOR
    out = tmp_path / "out.glb"
    run = call("simulate", "rigid", "-", out, stdin=BOX_AND_FLOOR.replace(old, new))
    assert (run.code, out.exists()) == (code, False), run.err
    assert words in run.err
    assert len(run.err.splitlines()) <= 2


def test_the_missing_package_is_named(
    fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rapier3d", None)
    run = call("simulate", "rigid", fixture("wall"), tmp_path / "out.glb", *BRICKS)
    assert run.code == 4
    assert "rigid bodies need the package rapier3d\nhelp: pip install 'gltf-anim[physics]'\n" in run.err

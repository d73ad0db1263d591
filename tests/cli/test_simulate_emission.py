"""`gltf-anim simulate particles` as a user runs it: files, clips, options."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import anim
from tests.cli.conftest import Call, Fixture
from tests.khronos import errors, needs_validator, validate

# Options with the same name and another meaning: VRM's, a ball's or a body's, of a fabric or of the air.
OWN_MEANING = {"sphere", "gravity", "stiffness", "drag", "density", "max_error", "integrator", "colliders"}


def test_the_help_of_particles_states_its_limits(call: Call) -> None:
    words = " ".join(call("simulate", "particles", "--help").product().decode().split())
    assert "with verlet, velocity-verlet or rk4 only, a path is written as the exact parabolas" in words
    assert "Balls, boxes, capsules and planes stop the centers of particles" in words


def test_particles_are_written_with_a_report(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out, report = tmp_path / "out.glb", tmp_path / "report.json"
    run = call(*("simulate", "particles", fixture("biped"), out, "--node", "head", "--floor", "0", "--report", report))
    assert run.code == 0, run.err
    assert "50 particles" in run.err
    found = json.loads(report.read_text())
    assert (found["schema"], found["kind"], found["particles"], found["step_s"]) == (
        "simulate/1",
        "particles",
        50,
        1 / 240,
    )
    assert found["error_estimate_m"] < 1e-9
    again = tmp_path / "again.glb"
    call("simulate", "particles", fixture("biped"), again, "--node", "head", "--floor", "0").product()
    assert again.read_bytes() == out.read_bytes()


@needs_validator
@pytest.mark.parametrize(
    "options", [(), ("--drag", "2", "--turbulence", "1", "--loop"), ("--emit", "surface", "--merge")]
)
def test_what_is_written_is_valid(options: tuple[str, ...], fixture: Fixture, call: Call) -> None:
    node = "body" if "surface" in options else "head"
    data = call("simulate", "particles", fixture("biped"), "-", "--node", node, *options).product()
    assert errors(validate(data)) == []


@pytest.mark.parametrize("zero", ["0", "0deg", "0.0rad"])
def test_a_spread_of_0_is_accepted(zero: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    calm = ("--gravity", "0,0,0", "--inherit", "0", "--direction", "0,1,0", "--duration", "0.2", "--variation", "0")
    run = call("simulate", "particles", fixture("flag"), out, "--node", "pole", "--spread", zero, *calm)
    assert run.code == 0, run.err


def test_tracks_are_put_into_the_driving_clip(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    call("simulate", "particles", fixture("biped"), out, "--node", "head", "--clip", "wave", "--merge")
    clips = anim.load(out).clips
    assert clips.names == anim.load(fixture("biped")).clips.names
    assert len(clips["wave"].tracks) > len(anim.load(fixture("biped")).clips["wave"].tracks)


@pytest.mark.parametrize(
    ("args", "code", "words"),
    [
        (("--node", "tail"), 5, "no node"),
        (("--node", "head", "--step", "0"), 2, "--step is '0'"),
        (("--node", "head", "--step", "1/0"), 2, "--step is '1/0'"),
        (("--node", "head", "--wind", "1,0,0"), 2, "drag is 0"),
        (("--node", "head", "--wind", "1,0"), 2, "expected 3 numbers"),
        (("--node", "head", "--sphere", "0,0,0,-1"), 2, "radius"),
        (("--node", "head", "--rate", "0"), 2, "no particle is emitted"),
        (("--node", "head", "--fps", "0"), 2, "--fps is 0"),
        (("--node", "head", "--emit", "surface"), 5, "no surface"),
        (("--node", "body", "--emit", "surface", "--rate", "1e-320"), 2, "no particle is emitted"),
        (("--node", "head", "--report", "out.txt"), 2, "unsupported report format"),
        (("--node", "head", "--rate", "1e9"), 4, "limit 1000000"),
        (("--node", "head", "--integrator", "euler"), 2, "none of explicit-euler"),
        (("--node", "head", "--drag", "900", "--integrator", "explicit-euler", "--step", "1/60"), 6, "diverges"),
    ],
)
def test_input_without_sense_is_refused_in_one_line(
    args: tuple[str, ...], code: int, words: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out = tmp_path / "out.glb"
    run = call("simulate", "particles", fixture("biped"), out, *args)
    assert (run.code, out.exists()) == (code, False), run.err
    assert words in run.err
    assert len(run.err.splitlines()) <= 2


def test_a_clip_of_its_own_is_noted_with_the_option_that_merges_it(
    fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    words = "note: the motion is clip 'particles'; players begin with another: --merge adds it to clip 'walk'"
    args = ("simulate", "particles", fixture("biped"), tmp_path / "out.glb", "--node", "head", "--duration", "0.5")
    assert words in call(*args).err
    assert "note: the motion" not in call(*args, "--merge").err

"""`gltf-anim simulate springs` as a user runs it: files, notes, reports, refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import anim
from anim.sampling.track import sample
from tests.cli.conftest import Call, Fixture
from tests.cli.running import built
from tests.files import clips_of
from tests.khronos import errors, needs_validator, validate

COMMAND = ("simulate", "springs")
HAIR = [f"hair{k}" for k in range(1, 6)]


def test_springs_of_a_file_are_put_into_its_clip(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    run = call(*COMMAND, fixture("ponytail"), out)
    assert run.code == 0, run.err
    assert "1 chain, 5 joints, 2 colliders, 1 s in steps of 1/60 s, largest rotation" in run.err
    before, after = anim.load(fixture("ponytail")).clips["walk"], anim.load(out).clips["walk"]
    assert [track.target for track in after.tracks[: len(before.tracks)]] == [t.target for t in before.tracks]
    assert all(a == b for a, b in zip(after.tracks, before.tracks, strict=False))
    assert len(after.tracks) == len(before.tracks) + 5
    assert len({id(track.time_axis) for track in after.tracks[-5:]}) == 1
    call(*COMMAND, fixture("ponytail"), tmp_path / "again.glb")
    assert (tmp_path / "again.glb").read_bytes() == out.read_bytes()


@needs_validator
@pytest.mark.parametrize(
    "options",
    ["", "--loop", "--fps 24 --warm-up 1", "--chain hair2", "--max-error 1mm", "--step 5ms"],
)
def test_what_is_written_is_valid(options: str, fixture: Fixture, call: Call) -> None:
    assert errors(validate(call(*COMMAND, fixture("ponytail"), "-", *options.split()).product())) == []


def test_a_loop_is_closed_and_reported(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    run = call(*COMMAND, fixture("ponytail"), "-", "--loop", "--report", report)
    (clip,) = clips_of(run.product())
    for track in clip.tracks[-5:]:
        np.testing.assert_allclose(np.abs((track.values[0] * track.values[-1]).sum()), 1, atol=1e-7)
    assert "loop after" in run.err
    found = json.loads(report.read_text())
    assert (found["schema"], found["kind"], found["step_s"], found["num_steps"]) == (
        "simulate/1",
        "springs",
        1 / 60,
        60,
    )
    assert (found["chains"], found["joints"], found["colliders"], found["oscillators"]) == (1, 5, 2, 0)
    assert found["loop_settled"]
    assert 0 <= found["penetration_m"] < 0.01
    assert found["loop_seam_m"] < 1e-4


def test_half_the_step_of_oscillators_differs_by_less_than_reported(
    fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    """What the report states for 1/120 s, and what `diff` finds between files at 1/120 s and 1/240 s."""
    estimates, files = [], [tmp_path / "120.glb", tmp_path / "240.glb"]
    for file, rate in zip(files, (120, 240), strict=True):
        own = ("--frequency", "3", "--gravity", "5", "--step", f"1/{rate}", "--report", tmp_path / "report.json")
        call(*COMMAND, fixture("ponytail"), file, *own).product()
        estimates.append(json.loads((tmp_path / "report.json").read_text())["error_estimate_m"])
    found = call("diff", *files, "--format", "json").json
    largest = max(each["max_error_m"] for each in found["clips"])
    assert 0 < largest <= estimates[0] * (1 + 1e-3)
    assert estimates[1] < 0.7 * estimates[0] < 0.01


def test_keys_are_removed_within_an_error(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    full, less = tmp_path / "full.glb", tmp_path / "less.glb"
    call(*COMMAND, fixture("ponytail"), full, "--loop").product()
    run = call(*COMMAND, fixture("ponytail"), less, "--loop", "--max-error", "1mm")
    assert "305 → " in run.err
    keys = [sum(len(t.times) for t in anim.load(f).clips["walk"].tracks[-5:]) for f in (full, less)]
    assert keys[1] < 0.7 * keys[0]
    found = call("diff", full, less, "--format", "json").json
    assert 0 < max(each["max_error_m"] for each in found["clips"]) <= 1e-3 * (1 + 1e-6)


def test_tracks_that_are_replaced_are_named(fixture: Fixture, call: Call) -> None:
    run = call(*COMMAND, fixture("biped"), "-", "--chain", "left_lower_arm", "--clip", "wave")
    assert "note: the rotation track of node 7 'left_lower_arm' and of 1 other joint is replaced" in run.err


def test_a_file_without_clips_gets_one(asset: Callable[[str], Path], call: Call) -> None:
    data = call(*COMMAND, asset("vrm/Godette.vrm"), "-", "--duration", "1", "--gravity", "2").product()
    (clip,) = clips_of(data)
    assert (clip.name, len(clip.tracks), clip.end) == ("springs", 16, 1.0)


def test_colliders_come_from_a_file(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    settings = tmp_path / "springs.json"
    head = {"name": "head", "node": "head", "sphere": {"offset": [0, 0.1, -0.1], "radius": 0.2}}
    settings.write_text(json.dumps({"schema": "spring-bones/1", "colliders": [head], "chains": [{"root": "hair1"}]}))
    run = call(*COMMAND, fixture("ponytail"), "-", "--springs", settings)
    assert "1 chain, 5 joints, 1 collider," in run.err
    settings.write_text(json.dumps({"schema": "spring-bones/1", "colliders": [head]}))
    run = call(*COMMAND, fixture("ponytail"), "-", "--springs", settings, "--chain", "hair1", "--hit-radius", "1cm")
    assert "1 chain, 5 joints, 1 collider," in run.err
    run = call(*COMMAND, fixture("ponytail"), "-", "--springs", settings)
    assert (run.code, run.out) == (3, b"")
    assert "springs.json: has no chains" in run.err


def test_joints_named_by_globs_are_those_of_the_skin(fixture: Fixture, call: Call) -> None:
    (clip,) = clips_of(call(*COMMAND, fixture("ponytail"), "-", "--chain", "hair*").product())
    names = [each["name"] for each in _nodes(built("ponytail"))]
    assert [names[t.node] for t in clip.tracks[-5:] if t.node is not None] == HAIR


def _nodes(data: bytes) -> list[dict[str, str]]:
    length = int.from_bytes(data[12:16], "little")
    found: list[dict[str, str]] = json.loads(data[20 : 20 + length])["nodes"]
    return found


@pytest.mark.parametrize(
    ("args", "code", "words", "help"),
    [
        (("--chain", "Hiar"), 5, "no node matches 'Hiar'", "did you mean 'hair"),
        (("--step", "0"), 2, "--step is '0' (expected seconds above 0", ""),
        (("--stiffness", "-1"), 2, "--stiffness is -1 (expected 0", ""),
        (("--stiffness", "nan"), 2, "'nan' is no finite number", ""),
        (("--drag", "2"), 2, "--drag is 2 (expected 0 to 1)", ""),
        (("--gravity", "1e7"), 2, "--gravity is 1e+07 (expected 0 to 1e+06)", ""),
        (("--gravity", "0,inf,0"), 2, "--gravity holds inf (expected finite numbers)", ""),
        (("--hit-radius", "-1cm"), 2, "--hit-radius is '-1cm'", ""),
        (("--gravity", "down"), 2, "--gravity is 'down' (expected a number, or three", ""),
        (("--frequency", "1", "--damping-ratio", "-1"), 2, "--damping-ratio is -1 (expected 0 to 1e+06)", ""),
        (("--frequency", "0"), 2, "--frequency is 0 (expected 0.001", ""),
        (("--frequency", "2", "--drag", "0.1"), 2, "--frequency replaces --stiffness and --drag", ""),
        (("--damping-ratio", "1"), 2, "--damping-ratio needs --frequency", ""),
        (("--center", "hair3"), 3, "spring 0 'ponytail': center is node 23 'hair3'", ""),
        (("--center", "*foot"), 2, "--center '*foot' matches 2 nodes", ""),
        (("--springs", "none.json"), 3, "none.json: can't be read", ""),
        (("--loop", "--duration", "2"), 2, "--loop closes the whole clip (expected no --duration)", ""),
        (("--fps", "0"), 2, "fps is 0", ""),
        (("--max-error", "0"), 2, "--max-error is '0'", ""),
        (("--report", "x.txt"), 2, "--report x.txt", ""),
        (("--integrator", "rk4"), 2, "--integrator is for springs with a frequency", "choose --frequency"),
        (("--integrator", "euler"), 2, "'euler' is none of explicit-euler", ""),
    ],
)
def test_refusals_are_one_line(
    args: tuple[str, ...], code: int, words: str, help: str, fixture: Fixture, call: Call
) -> None:
    run = call(*COMMAND, fixture("ponytail"), "-", *args)
    assert (run.code, run.out) == (code, b""), run.err
    first, *rest = run.err.splitlines()
    assert words in first
    assert len(rest) <= 1
    assert help in "".join(rest)


@pytest.mark.parametrize("ending", ["json", "png", "svg"])
def test_masses_on_springs_that_diverge_end_with_a_report_and_runnable_advice(
    ending: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out, report = tmp_path / "out.glb", tmp_path / f"report.{ending}"
    args = ("--chain", "hair1", "--frequency", "22", "--integrator", "verlet")
    run = call(*COMMAND, fixture("ponytail"), out, *args, "--report", report)
    assert (run.code, out.exists(), report.exists()) == (6, False, True)
    assert "help: ω·h = 2.3, verlet's limit is 1.24: --step 1/125 or --integrator rk4" in run.err
    if ending == "json":
        found = json.loads(report.read_text())
        assert found["first_bad_step"] > 0
        assert found["omega_h_limit"] == pytest.approx(1.236, abs=1e-3)  # with its damping ratio of 0.5
        assert found["advice"] in run.err
    for mended in (("--step", "1/125"), ("--integrator", "rk4")):
        call(*COMMAND, fixture("ponytail"), out, *args, *mended).product()


def test_the_picture_of_a_report_is_computed_from_the_run(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.svg"
    call(*COMMAND, fixture("ponytail"), tmp_path / "out.glb", "--report", report).product()
    drawn = report.read_text()
    assert "Step 1/60 s, ω·h = 0.33: explicit-euler (2.20 s) diverges" in drawn


def test_a_file_without_springs_is_told_about_chains(fixture: Fixture, call: Call) -> None:
    run = call(*COMMAND, fixture("biped"), "-")
    assert (run.code, run.out) == (5, b"")
    assert "has no spring bones (neither VRMC_springBone nor VRM 0.x secondaryAnimation)" in run.err
    assert "help: --chain names the first joint of each chain" in run.err


def test_a_late_clip_swings_from_its_start(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    late, paths = tmp_path / "late.glb", [tmp_path / "a.glb", tmp_path / "b.glb"]
    call("retime", fixture("ponytail"), late, "--offset", "600").product()
    for source, out in zip((fixture("ponytail"), late), paths, strict=True):
        call("simulate", "springs", source, out).product()
    early, moved = (anim.load(path).clips["walk"] for path in paths)
    assert (moved.start, moved.end) == pytest.approx((early.start + 600, early.end + 600))
    for a, b in zip(early.tracks, moved.tracks, strict=True):
        assert a.target == b.target
        if a.path == "rotation":
            found = sample(b, a.times + 600)
            assert np.abs(np.sum(sample(a, a.times) * found, axis=1)).min() > np.cos(np.radians(1.0) / 2)


def test_the_clip_that_drives_is_named_if_there_are_several(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    """Also of cloth; a file with one clip, and --clip, need no note."""
    two, words = tmp_path / "two.glb", "drives the simulation, the first of 2 clips (--clip: another)"
    asset = anim.load(fixture("ponytail"))
    anim.save(asset.add_clips([replace(asset.clips["walk"], name="stand")]), two)
    run = call(*COMMAND, two, tmp_path / "out.glb")
    assert f"note: clip 'walk' {words}" in run.err
    springs = anim.load(tmp_path / "out.glb")
    assert len(springs.clips["walk"].tracks) == len(springs.clips["stand"].tracks) + 5
    for path, args in ((two, ("--clip", "stand")), (fixture("ponytail"), ())):
        assert "drives the simulation" not in call(*COMMAND, path, tmp_path / "out.glb", *args).err
    flag = anim.load(fixture("flag"))
    anim.save(flag.add_clips([replace(flag.clips[0], name="calm")]), two)
    cloth = call("simulate", "cloth", two, tmp_path / "out.npz", "--mesh", "flag", "--duration", "0.1")
    assert f"note: clip '{flag.clips[0].name}' {words}" in cloth.err

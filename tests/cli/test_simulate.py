"""`gltf-anim simulate`: the group of kinds, and particles as a user runs them."""

from __future__ import annotations

import importlib
import inspect
import json
import typing
from pathlib import Path

import numpy as np
import pytest
from typer.models import OptionInfo

import anim
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.sampling.sample import sample
from anim.simulation.registry import SIMULATIONS
from cli.commands import simulate
from tests.cli.conftest import Call, Fixture
from tests.cli.running import ROOT
from tests.khronos import errors, needs_validator, validate

# Options with the same name and another meaning: VRM's, a ball's or a body's, of a fabric or of the air.
OWN_MEANING = {"sphere", "gravity", "stiffness", "drag", "density", "max_error", "integrator"}


@pytest.mark.parametrize("args", [(), ("--help",)])
def test_the_help_lists_the_kinds(args: tuple[str, ...], call: Call) -> None:
    words = " ".join(call("simulate", *args).product().decode().split())
    assert "Usage: gltf-anim simulate [OPTIONS] KIND [IN] [OUT]" in words
    for kind, row in simulate.KINDS.items():
        assert f"{kind} {row.about}" in words


def test_every_kind_is_a_module_with_its_examples_in_the_help(call: Call) -> None:
    folder = ROOT / "cli" / "commands" / "simulate"
    assert {path.stem for path in folder.glob("*.py")} - {"__init__"} == set(simulate.KINDS)
    for kind, row in simulate.KINDS.items():
        words = " ".join(call("simulate", kind, "--help").product().decode().split())
        assert all(" ".join(example.split()) in words for example in row.examples)


def test_the_default_step_and_the_line_of_a_kind_are_those_of_the_table(call: Call) -> None:
    assert list(simulate.KINDS) == list(SIMULATIONS)
    for kind, row in SIMULATIONS.items():
        assert simulate.KINDS[kind].about == row.about
        words = " ".join(call("simulate", kind, "--help").product().decode().split())
        assert f"such as 1/240. [default: {row.step}]" in words


@pytest.mark.parametrize("kind", SIMULATIONS)
def test_the_table_loads_the_function_of_a_kind(kind: str) -> None:
    parameters = list(inspect.signature(SIMULATIONS[kind].load()).parameters)
    assert (parameters[1] in ("clip", "driver"), parameters[-1]) == (True, "options")


def test_options_of_several_kinds_are_written_once() -> None:
    seen: dict[str, tuple[str, object]] = {}
    for kind in SIMULATIONS:
        command = importlib.import_module(f"cli.commands.simulate.{kind}").command
        for name, hint in typing.get_type_hints(command, include_extras=True).items():
            option = next((each for each in typing.get_args(hint) if isinstance(each, OptionInfo)), None)
            if option is not None and name not in OWN_MEANING:
                assert seen.setdefault(name, (kind, option))[1] is option, f"--{name} of {seen[name][0]} and {kind}"


def test_the_help_of_particles_states_its_limits(call: Call) -> None:
    words = " ".join(call("simulate", "particles", "--help").product().decode().split())
    assert "with verlet, velocity-verlet or rk4 only, a path is written as the exact parabolas" in words
    assert "Balls, boxes, capsules and planes stop the centers of particles" in words


def test_an_unknown_kind_is_named_with_the_nearest(call: Call) -> None:
    run = call("simulate", "particels")
    assert (run.code, run.out) == (2, b"")
    assert run.err == "gltf-anim: simulate: no such kind 'particels'\nhelp: did you mean 'particles'?\n"


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
        (("--node", "head", "--report", "out.txt"), 2, "unsupported report format"),
        (("--node", "head", "--rate", "1e9"), 2, "limit 1000000"),
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


# Cloth.


def test_a_flag_blows_on_its_swaying_pole(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    flag, out, report = fixture("flag"), tmp_path / "out.npz", tmp_path / "flag.json"
    args = ("--mesh", "flag", "--pin", "x-min", "--wind", "5,0,2", "--duration", "1", "--report", report)
    run = call("simulate", "cloth", flag, out, *args)
    assert run.code == 0, run.err
    assert "61 frames of 425 points (17 pinned), xpbd, steps of 1/600 s" in run.err
    found = json.loads(report.read_text())
    assert (found["kind"], found["solver"], found["points"]) == ("cloth", "xpbd", 425)
    assert found["error_estimate_m"] > 0
    call("bake", flag, tmp_path / "rigid.npz", "--mesh", "flag", "--rigid", "--fps", "60").product()
    with np.load(out) as cloth, np.load(tmp_path / "rigid.npz") as rigid:
        at_pole = np.flatnonzero(cloth["rest"][:, 0] < 0.01)
        np.testing.assert_allclose(cloth["positions"][:, at_pole], rigid["positions"][:61, at_pole], atol=1e-5)
        assert np.abs(cloth["positions"] - rigid["positions"][:61]).max() > 0.2


def test_a_loop_of_cloth_states_its_seam(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    args = ("--mesh", "flag", "--pin", "x-min", "--damping", "3", "--loop")
    run = call("simulate", "cloth", fixture("flag"), tmp_path / "out.npz", *args)
    assert run.code == 0, run.err
    assert "181 frames" in run.err
    assert "rounds, seam " in run.err
    with np.load(tmp_path / "out.npz") as cache:
        np.testing.assert_array_equal(cache["positions"][0], cache["positions"][-1])
    refused = call("simulate", "cloth", fixture("flag"), tmp_path / "none.npz", *args, "--duration", "1")
    assert (refused.code, "expected no --duration" in refused.err) == (2, True)


COLLIDERS = {
    "schema": "spring-bones/1",
    "colliders": [
        {"node": "pole", "capsule": {"offset": [0.5, 0, 0.25], "tail": [0.5, 2, 0.25], "radius": 0.1}},
        {"plane": {"offset": [0, 1.15, 0], "normal": [0, 1, 0]}},
    ],
}


def test_cloth_meets_colliders_of_a_file_and_of_nodes(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out, report, given = tmp_path / "out.npz", tmp_path / "report.json", tmp_path / "colliders.json"
    given.write_text(json.dumps(COLLIDERS))
    args = ("--mesh", "flag", "--pin", "x-min", "--wind", "0,0,6", "--duration", "1.5", "--thickness", "1cm")
    run = call("simulate", "cloth", fixture("flag"), out, *args, "--colliders", given, "--report", report)
    assert run.code == 0, run.err
    found = json.loads(report.read_text())
    assert (found["colliders"], found["penetration_m"]) == (2, 0.0)
    document = container.read(np.frombuffer(fixture("flag").read_bytes(), np.uint8))
    skeleton, clip = reader.scene(document).skeleton, reader.clips(document)[0]
    world = sample(skeleton, clip, np.arange(91) / 60, space="world").world
    assert world is not None
    pole = world[:, skeleton.names.index("pole")]
    with np.load(out) as cache:
        frames = cache["positions"].astype(float)
        free = cache["rest"][:, 0] > 0.01
    local = np.einsum("fij,fvi->fvj", pole[:, :, :3], frames - pole[:, None, :, 3])[:, free]
    assert np.hypot(local[..., 0] - 0.5, local[..., 2] - 0.25).min() > 0.105  # both push at once
    assert frames[:, free, 1].min() > 1.16 - 1e-5
    plane = ("--plane", "0,1.15,0,0,1,0", "--capsule", "pole,post,0.05")
    assert call("simulate", "cloth", fixture("flag"), out, *args, *plane).code == 0


def test_cloth_that_begins_inside_a_collider_says_how_deep(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    args = ("--mesh", "flag", "--pin", "x-min", "--duration", "0.1", "--sphere", "1.2,2,0,0.3")
    run = call("simulate", "cloth", fixture("flag"), tmp_path / "out.npz", *args)
    assert run.code == 0, run.err
    assert ", 30 cm inside a collider or below the floor at most," in run.err


def test_cloth_meets_the_colliders_of_spring_bones(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    args = ("--mesh", "flag", "--pin", "x-min", "--duration", "0.2", "--colliders", "vrm", "--report", report)
    given = tmp_path / "flag.gltf"
    call("convert", fixture("flag"), given).product()
    document = json.loads(given.read_text())
    shape = {"sphere": {"offset": [0, 1, 0], "radius": 0.2}}
    document["extensions"] = {"VRMC_springBone": {"specVersion": "1.0", "colliders": [{"node": 0, "shape": shape}]}}
    document["extensionsUsed"] = ["VRMC_springBone"]
    given.write_text(json.dumps(document))
    run = call("simulate", "cloth", given, tmp_path / "out.npz", *args)
    assert run.code == 0, run.err
    assert json.loads(report.read_text())["colliders"] == 1


def test_halving_the_step_changes_the_cloth_by_less_than_the_estimate(
    fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    args = ("--mesh", "flag", "--pin", "x-min", "--wind", "3,0,1", "--duration", "0.7")
    report, paths = tmp_path / "report.json", (tmp_path / "a.npz", tmp_path / "b.npz")
    for step, path in zip(("1/600", "1/1200"), paths, strict=True):
        name = report if path == paths[0] else tmp_path / "other.json"
        call("simulate", "cloth", fixture("flag"), path, *args, "--step", step, "--report", name).product()
    with np.load(paths[0]) as a, np.load(paths[1]) as b:
        change = np.linalg.norm(a["positions"] - b["positions"], axis=2).max()
    found = json.loads(report.read_text())
    assert 0 < change <= found["error_estimate_m"]
    assert found["energy_j"]["peak"] >= found["energy_j"]["end"]
    assert found["drift_per_s"] < 0


def test_the_picture_of_cloth_draws_every_solver(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.svg"
    args = ("--mesh", "flag", "--pin", "x-min", "--duration", "0.1", "--step", "1/240", "--report", report)
    call("simulate", "cloth", fixture("flag"), tmp_path / "out.npz", *args).product()
    drawn = report.read_text()
    assert "Step 1/240 s, ω·h = 20.67: all but implicit-euler, relaxation, xpbd diverge" in drawn
    assert "this run: ω·h = 20.67 →" in drawn


def test_cloth_keeps_the_materials_that_bake_keeps(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    found = []
    for path, command in ((tmp_path / "a.glb", ("bake",)), (tmp_path / "b.glb", ("simulate", "cloth"))):
        more = ("--rigid",) if command == ("bake",) else ("--pin", "x-min", "--duration", "0.1")
        call(*command, fixture("flag"), path, "--mesh", "flag", *more).product()
        document = container.read(np.frombuffer(path.read_bytes(), np.uint8)).json
        primitives = [part for mesh in document["meshes"] for part in mesh["primitives"]]
        found.append((document["materials"], [(set(part["attributes"]), part["material"]) for part in primitives]))
    assert found[0] == found[1]


@pytest.mark.parametrize("threads", ["1", "2", "7"])
def test_the_same_seed_gives_the_same_bytes_for_any_number_of_threads(
    threads: str, fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    args = ("--mesh", "flag", "--pin", "x-min", "--wind", "5,0,2", "--seed", "3", "--duration", "0.3")
    call("simulate", "cloth", fixture("flag"), tmp_path / "a.glb", *args).product()
    monkeypatch.setattr("os.cpu_count", lambda: int(threads))
    monkeypatch.setenv("NUMBA_NUM_THREADS", threads)
    call("simulate", "cloth", fixture("flag"), tmp_path / "b.glb", *args).product()
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    call("simulate", "cloth", fixture("flag"), tmp_path / "c.glb", *args, "--seed", "4").product()
    assert (tmp_path / "a.glb").read_bytes() != (tmp_path / "c.glb").read_bytes()


@needs_validator
def test_cloth_as_morph_targets_is_valid(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    call("simulate", "cloth", fixture("flag"), out, "--mesh", "flag", "--pin", "x-min", "--duration", "0.5").product()
    assert errors(validate(out.read_bytes())) == []


@pytest.mark.parametrize("ending", ["json", "png"])
def test_springs_that_diverge_end_with_a_report_and_nothing_written(
    ending: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out, report = tmp_path / "out.npz", tmp_path / f"report.{ending}"
    args = ("--mesh", "flag", "--pin", "x-min", "--solver", "mass-spring", "--step", "1/60", "--report", report)
    run = call("simulate", "cloth", fixture("flag"), out, *args)
    assert (run.code, out.exists(), report.exists()) == (6, False, True)
    assert "diverges at frame" in run.err
    assert "help: ω·h = " in run.err
    step = run.err.split("--step ")[1].split()[0]
    calmer = call("simulate", "cloth", fixture("flag"), out, *args[:-4], "--step", step, "--duration", "0.5")
    assert calmer.code == 0, calmer.err


@pytest.mark.parametrize("dry", [True, False])
def test_cloth_beyond_its_largest_stretch_ends_with_a_report_and_no_cache(
    dry: bool, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out, report = tmp_path / "out.npz", tmp_path / "report.json"
    args = ("--mesh", "flag", "--pin", "x-min", "--duration", "0.2", "--report", report, "--max-stretch", "0.0001%")
    run = call("simulate", "cloth", fixture("flag"), out, *args, *(("--dry-run",) if dry else ()))
    assert (run.code, out.exists(), report.exists()) == (6, False, not dry)
    problem, help = run.err.splitlines()[-2:]
    assert problem.startswith("gltf-anim: stretched by ")
    assert problem.endswith(" s with 80 substeps a frame (limit 0.0001 %)")
    assert help == "help: a larger --max-stretch, a higher --fps, or a mesh with longer edges"
    if not dry:
        found = json.loads(report.read_text())
        assert found["substeps"] == 80
        assert found["worst_stretch"]["fraction"] > 1e-6
        assert found["advice"] == help.removeprefix("help: ")


def test_cloth_that_the_first_pose_stretches_is_advised_to_warm_up(
    fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    args = ("--mesh", "body", "--clip", "walk", "--cloth", "weight:*hand*,0.5", "--duration", "0.2")
    out = tmp_path / "out.npz"
    run = call("simulate", "cloth", fixture("biped"), out, *args, "--max-stretch", "5%")
    assert (run.code, out.exists()) == (6, False), run.err
    assert "at 0 s with 10 substeps a frame (limit 5 %)" in run.err
    assert run.err.splitlines()[-1] == "help: the clip's first pose stretches it: --warm-up 1 lets it relax before"
    relaxed = call("simulate", "cloth", fixture("biped"), out, *args, "--max-stretch", "5%", "--warm-up", "1")
    assert relaxed.code == 0, relaxed.err


@pytest.mark.parametrize(
    ("args", "code", "words"),
    [
        ((), 2, "2 meshes are chosen"),
        (("--mesh", "flag", "--pin", "left"), 2, "selects no vertices"),
        (("--mesh", "flag", "--pin", "joint:hip"), 5, "has no skin"),
        (("--mesh", "flag", "--pin", "x-min", "--density", "-1"), 2, "--density is -1"),
        (("--mesh", "flag", "--cloth", "material:wool"), 5, "selects no vertex"),
        (("--mesh", "flag", "--sphere", "1,2"), 5, "no node"),
        (("--mesh", "flag", "--sphere", "0,0,0,0"), 2, "radius"),
        (("--mesh", "flag", "--capsule", "pole,post"), 2, "expected NODE,NODE,R"),
        (("--mesh", "flag", "--plane", "0,0,0,0,0,0"), 2, "normal of a plane"),
        (("--mesh", "flag", "--plane", "0,0,0"), 2, "expected NODE, NODE,NX,NY,NZ or X,Y,Z,NX,NY,NZ"),
        (("--mesh", "flag", "--colliders", "vrm"), 5, "has no colliders"),
        (("--mesh", "flag", "--pin", "weight:hip,0.2"), 5, "has no skin"),
        (("--mesh", "flag", "--pin", "weight:hip"), 2, "expected weight:GLOB,MIN"),
        (("--mesh", "flag", "--report", "x.txt"), 2, "unsupported report format"),
        (("--mesh", "flag", "--step", "0"), 2, "--step is '0'"),
        (("--mesh", "flag", "--stretch-compliance", "-1"), 2, "--stretch-compliance is -1"),
        (("--mesh", "flag", "--pin", "x-min", "--gravity", "0,-1e12,0"), 6, "diverges at frame 1"),
        (("--mesh", "flag", "--pin", "box:0,0,0,9,9,9"), 5, "every point"),
    ],
)
def test_cloth_without_sense_is_refused_in_one_line(
    args: tuple[str, ...], code: int, words: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    out = tmp_path / "out.npz"
    run = call("simulate", "cloth", fixture("flag"), out, *args)
    assert (run.code, out.exists()) == (code, False), run.err
    assert words in run.err
    assert len(run.err.splitlines()) <= 2


@pytest.mark.parametrize("kind", ["particles", "cloth"])
def test_a_late_clip_is_simulated_from_its_start(kind: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    late = tmp_path / "late.glb"
    call("retime", fixture("flag"), late, "--offset", "600").product()
    if kind == "cloth":
        args: tuple[str, ...] = ("--mesh", "flag", "--pin", "x-min")
        paths = [tmp_path / "a.npz", tmp_path / "b.npz"]
    else:
        args = ("--node", "pole", "--rate", "5")
        paths = [tmp_path / "a.glb", tmp_path / "b.glb"]
    for source, out in zip((fixture("flag"), late), paths, strict=True):
        run = call("simulate", kind, source, out, *args)
        assert run.code == 0, run.err
    if kind == "cloth":
        with np.load(paths[0]) as a, np.load(paths[1]) as b:
            np.testing.assert_allclose(b["times"], a["times"] + 600, atol=1e-4)
            assert np.abs(a["positions"][:20] - b["positions"][:20]).max() < 1e-3
        return
    early, moved = (anim.load(path).clips["particles"] for path in paths)
    assert (moved.start, moved.end) == pytest.approx((early.start + 600, early.end + 600))
    assert len(moved.tracks) == len(early.tracks)

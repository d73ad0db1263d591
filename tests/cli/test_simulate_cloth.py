"""`gltf-anim simulate cloth` as a user runs it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.sampling.sample import sample
from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal
from tests.khronos import errors, needs_validator, validate

# Options with the same name and another meaning: VRM's, a ball's or a body's, of a fabric or of the air.
OWN_MEANING = {"sphere", "gravity", "stiffness", "drag", "density", "max_error", "integrator", "colliders"}


THREAD_VARIABLES = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


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


@pytest.mark.slow
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
    assert "cloth: steps of 1/240 s, 0.1 s, by xpbd: energy " in drawn  # and the run itself
    for words in ("kinetic", "potential", "Poses from 0 to 0.1 s", "% at most"):
        assert words in drawn


def test_cloth_keeps_the_materials_that_bake_keeps(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    found = []
    for path, command in ((tmp_path / "a.glb", ("bake",)), (tmp_path / "b.glb", ("simulate", "cloth"))):
        more = ("--rigid",) if command == ("bake",) else ("--pin", "x-min", "--duration", "0.1")
        call(*command, fixture("flag"), path, "--mesh", "flag", *more).product()
        document = container.read(np.frombuffer(path.read_bytes(), np.uint8)).json
        primitives = [part for mesh in document["meshes"] for part in mesh["primitives"]]
        found.append((document["materials"], [(set(part["attributes"]), part["material"]) for part in primitives]))
    (materials, baked), (kept_materials, parts) = found
    assert kept_materials == materials
    assert [part for part in parts if part in baked] == baked  # the pole stays beside the cloth; bake leaves it out


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_for_any_number_of_threads(
    fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    """In processes of their own, since numba and the pool read the number once."""
    args = (
        "--mesh",
        "flag",
        "--pin",
        "x-min",
        "--wind",
        "5,0,2",
        "--seed",
        "3",
        "--duration",
        "0.3",
        "--self-collision",
    )
    found = set()
    for threads in ("1", "2"):
        out = tmp_path / f"{threads}.glb"
        environment = {**os.environ, **dict.fromkeys(THREAD_VARIABLES, threads)}
        words = [sys.executable, "-m", "anim", "simulate", "cloth", str(fixture("flag")), str(out), *args]
        subprocess.run(words, check=True, env=environment, capture_output=True)
        found.add(out.read_bytes())
    assert len(found) == 1
    call("simulate", "cloth", fixture("flag"), tmp_path / "other.glb", *args, "--seed", "4").product()
    assert (tmp_path / "other.glb").read_bytes() not in found


@needs_validator
def test_cloth_as_morph_targets_is_valid(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    call("simulate", "cloth", fixture("flag"), out, "--mesh", "flag", "--pin", "x-min", "--duration", "0.5").product()
    assert errors(validate(out.read_bytes())) == []


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
    loose = call("simulate", "cloth", fixture("biped"), out, *args)
    assert " at 0.00 s, by the clip's first pose" in loose.err


def test_the_largest_stretch_chooses_the_step_and_states_it(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    args = ("--mesh", "flag", "--pin", "x-min", "--duration", "0.5", "--step", "1/60", "--report", report)
    loose = call("simulate", "cloth", fixture("flag"), tmp_path / "a.npz", *args)
    assert "steps of 1/60 s" in loose.err
    assert json.loads(report.read_text())["worst_stretch"]["fraction"] > 0.02
    run = call("simulate", "cloth", fixture("flag"), tmp_path / "b.npz", *args, "--max-stretch", "2%")
    found = json.loads(report.read_text())
    assert (run.code, found["substeps"] in (2, 4, 8, 16, 32, 64)) == (0, True), run.err
    assert found["worst_stretch"]["fraction"] <= 0.02
    assert found["step_s"] == pytest.approx(1 / 60 / found["substeps"])
    assert f"steps of 1/{60 * found['substeps']} s (chosen for --max-stretch)" in run.err


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
        (("--mesh", "flag", "--gravity", "1e30,0,0"), 2, "--gravity is 1e+30 m/s² (limit 10000)"),
        (("--mesh", "flag", "--wind", "0,0,-1e308"), 2, "--wind is 1e+308 m/s (limit 10000)"),
        (("--mesh", "flag", "--density", "1e308"), 2, "--density is 1e+308 kg/m² (expected above 0, at most 1e+12)"),
        (("--mesh", "flag", "--step", "1e-320"), 4, "more than 10000000 steps"),
        (("--mesh", "flag", "--solver", "mass-spring", "--stiffness", "1e9"), 6, "diverges at frame 1"),
        (("--mesh", "flag", "--pin", "box:0,0,0,9,9,9"), 5, "every point"),
        (("--mesh", "flag", "--duration", "1e300"), 4, "frames at 60 fps (limit 10000000)"),
        (("--mesh", "flag", "--duration", "1e5", "--step", "1/60"), 4, "would take"),
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


def test_the_advice_on_too_few_targets_names_an_option(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    line = ("--duration", "1", "--max-error", "1e-6mm", "--max-targets", "2")
    run = call("simulate", "cloth", fixture("flag"), tmp_path / "out.glb", "--mesh", "flag", *line)
    assert "2 morph targets can't keep every vertex within" in refusal(run, 2)
    assert "more --max-targets" in help_line(run)

"""`gltf-anim simulate`: the group of kinds, and particles as a user runs them."""

from __future__ import annotations

import importlib
import inspect
import typing
from pathlib import Path

import numpy as np
import pytest
from typer.models import OptionInfo

import anim
from anim.simulation.registry import SIMULATIONS
from cli.commands import simulate
from tests.cli.conftest import Call, Fixture
from tests.cli.running import ROOT
from tests.files import mark_slow

# Options with the same name and another meaning: VRM's, a ball's or a body's, of a fabric or of the air.
OWN_MEANING = {"sphere", "gravity", "stiffness", "drag", "density", "max_error", "integrator", "colliders"}


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


@pytest.mark.parametrize("kind", ["springs", "particles", "cloth"])
def test_the_help_states_the_order_of_each_integrator_also_with_drag(kind: str, call: Call) -> None:
    words = " ".join(call("simulate", kind, "--help").product().decode().split()).replace("- ", "-")
    assert "verlet: order 2 (1 with drag or damping), keeps energy; velocity-verlet: order 2 (1 with drag" in words
    assert "rk4: order 4, loses little energy" in words


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


def test_an_unknown_kind_is_named_with_the_nearest(call: Call) -> None:
    run = call("simulate", "particels")
    assert (run.code, run.out) == (2, b"")
    assert run.err == "gltf-anim: simulate: no such kind 'particels'\nhelp: did you mean 'particles'?\n"


@pytest.mark.parametrize("ending", mark_slow(["json", "png"], slow=["png"]))
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

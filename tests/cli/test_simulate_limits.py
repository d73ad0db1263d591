"""Numbers beyond the limits in every option of `simulate`: a result, or one line that names the option or the limit."""

from __future__ import annotations

import importlib
import typing
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.models import OptionInfo

from tests.cli.conftest import Call, Fixture

BASES = {
    "particles": ("biped", "--node", "head", "--duration", "0.1"),
    "cloth": ("flag", "--mesh", "flag", "--pin", "x-min", "--duration", "0.1"),
    "springs": ("springs", "--duration", "0.1"),
    "rigid": ("wall", "--body", "brick*", "--duration", "0.1"),
}
# The text of options that take more than a number, and options that others need to have an effect.
TEXTS = {
    "spread": ["{}deg"],
    "size": ["{}m"],
    "max_error": ["{}m"],
    "thickness": ["{}m"],
    "hit_radius": ["{}m"],
    "direction": ["0,{},0"],
    "gravity": ["0,{},0"],
    "wind": ["{},0,0"],
    "step": ["{}"],
    "max_stretch": ["{}"],
    "sphere": ["{},0,0,1", "0,0,0,{}"],
    "plane": ["{},0,0,0,1,0", "0,0,0,{},0,0"],
    "box": ["{},0,0,1,1,1", "0,0,0,{},1,1"],
    "attractor": ["head:{}:1", "head:1:{}"],
    "velocity": ["brick*={},0,0"],
}
NEEDED: dict[str, dict[str, tuple[str, ...]]] = {
    "particles": {
        "wind": ("--drag", "1"),
        "turbulence": ("--drag", "1"),
        "turbulence_size": ("--drag", "1", "--turbulence", "1"),
        "friction": ("--floor", "0"),
    },
    "cloth": {
        "gusts": ("--wind", "1,0,0"),
        "stiffness": ("--solver", "mass-spring"),
        "iterations": ("--solver", "relaxation"),
    },
    "springs": {"damping_ratio": ("--frequency", "3")},
    "rigid": {"friction": ("--floor", "0")},
}
VALUES = ("1e308", "-1e308", "1e-320", "9" * 25)


def _options(kind: str) -> Iterator[tuple[str, str, list[str]]]:
    """Yield name, flag and texts of all options with numbers."""
    command = importlib.import_module(f"cli.commands.simulate.{kind}").command
    for name, hint in typing.get_type_hints(command, include_extras=True).items():
        option = next((each for each in typing.get_args(hint) if isinstance(each, OptionInfo)), None)
        value = typing.get_args(hint)[0] if option is not None else str
        kinds = {value, *typing.get_args(value)}
        if option is not None and (name in TEXTS or kinds & {int, float}):
            flag = f"--{'from' if name == 'start' else 'to' if name == 'end' else name.replace('_', '-')}"
            yield name, flag, TEXTS.get(name, ["{}"])


@pytest.mark.parametrize("kind", BASES)
def test_numbers_beyond_the_limits_end_in_one_line(kind: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    name, *base = BASES[kind]
    if kind == "rigid":
        pytest.importorskip("rapier3d")
    path, seen = fixture(name), 0
    for option, flag, texts in _options(kind):
        for text in (each.format(value) for each in texts for value in VALUES):
            seen += 1
            given = (*base, *NEEDED[kind].get(option, ()), f"{flag}={text}", "--report", tmp_path / "report.json")
            run = call("simulate", kind, path, tmp_path / "out.glb", *given)
            assert run.code in (0, 2, 4, 6), (flag, text, run.err)
            assert "nan" not in run.err, (flag, text, run.err)
            if run.code == 2:
                assert flag in run.err or "no particle is emitted" in run.err, (flag, text, run.err)
    assert seen > 30


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--attractor", "head:1e308:1e-300"), "--attractor is 'head:1e308:1e-300': radius is 1e-300 m"),
        (("--attractor", "head:1e308"), "--attractor is 'head:1e308': strength is 1e+308 m/s²"),
        (("--size", "1e308%"), "--size is '1e308%' (expected at most 1e+08%)"),
        (("--size", "1e308m"), "--size is '1e308m' (expected 1e-30 to 1e+30 m)"),
        (
            ("--turbulence", "1", "--drag", "1", "--turbulence-size", "1e-300"),
            "--turbulence-size is 1e-300 m (expected",
        ),
        (("--burst", "99999999999999999999"), "99999999999999999999 is too large (expected at most 1e+18)"),
        (("--burst", "9" * 400), "is too large (expected at most 1e+18)"),
        (("--direction", "0,1e-300,0"), "--direction is (0.0, 1e-300, 0.0)"),
    ],
)
def test_the_option_of_a_number_beyond_its_limit_is_named(
    args: tuple[str, ...], words: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    run = call("simulate", "particles", fixture("biped"), tmp_path / "out.glb", "--node", "head", *args)
    assert (run.code, len(run.err.splitlines()) <= 2) == (2, True), run.err
    assert words in run.err

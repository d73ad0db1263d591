"""`gltf-anim spline`: the files that it writes, and what it says."""

from __future__ import annotations

import re
from pathlib import Path

from anim.curves.tangents.table import TANGENTS
from anim.model import Interpolation
from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal, shell
from tests.files import clips_of


def test_list_shows_every_rule(call: Call) -> None:
    names = {line.split()[0] for line in call("spline", "--list").text.splitlines() if line.strip()}
    assert set(TANGENTS) <= names


def test_keys_stay_and_become_splines(call: Call, fixture: Fixture) -> None:
    path = fixture("biped")
    before, after = clips_of(path.read_bytes())[0], clips_of(call("spline", path, "--clip", "walk", "-q").product())[0]
    for old, new in zip(before.tracks, after.tracks, strict=True):
        assert new.interpolation is Interpolation.CUBICSPLINE
        assert len(new.times) == len(old.times)


def test_an_approximating_rule_says_how_far_keys_move(call: Call, fixture: Fixture) -> None:
    assert (
        "the curve does not pass through its keys" in call("spline", fixture("biped"), "-", "--tangents", "bspline").err
    )
    assert "does not pass through" not in call("spline", fixture("biped"), "-", "--tangents", "natural").err


def test_says_how_far_the_motion_moved(call: Call, fixture: Fixture) -> None:
    assert "max " in call("spline", fixture("biped"), "-").err.splitlines()[-1]


def test_unknown_rule_is_refused(call: Call, fixture: Fixture) -> None:
    assert "'catmul-rom'" in refusal(call("spline", fixture("biped"), "--tangents", "catmul-rom"), 2)


def test_a_loop_that_is_open_is_named_and_closed_by_the_help(call: Call, walk: Path, tmp_path: Path) -> None:
    half, closed = tmp_path / "half.glb", tmp_path / "closed.glb"
    assert call("trim", walk, half, "--clip", "walk", "--to", "0.4").code == 0
    rules = [("--cyclic", "--tangents", name) for name in ("natural", "catmull-rom", "flat", "clamped")]
    for options in (*rules, ("--cyclic", "--path", "rotation"), ("--tangents", "periodic")):
        run = call("spline", half, "-", "--clip", "walk", *options)
        assert re.search(r"clip 'walk', track of node \d+ '\w+', \w+: the loop is open", refusal(run, 2))
        advice, command = help_line(run).split(": ")
        assert (advice, command) == ("close it first", "gltf-anim loop IN OUT --blend 0.1 --clip '#0'")
        assert shell(command.replace("IN", half.name).replace("OUT", closed.name), tmp_path).code == 0
        assert call("spline", closed, "-", "--clip", "walk", *options).code == 0
    unknown = call("spline", half, "-", "--tangents", "catmul-rom", "--cyclic")
    assert "did you mean 'catmull-rom'?" in unknown.err
    assert help_line(unknown) == "see gltf-anim spline --list"

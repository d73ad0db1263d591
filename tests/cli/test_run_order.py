"""`run`: recipes whose steps read what others make."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, refusal
from tests.cli.running_recipes import statuses, write_recipe

PLAIN = "resample --fps 12"
ONTO = "from-euler --onto ./build/hero.glb"


@pytest.fixture
def chain(folder: Path, call: Call) -> Path:
    """A folder with a recipe that needs the output of a later one, in turn needed by an earlier one."""
    (folder / "hero.glb").write_bytes(built("noop"))
    for name in ("take", "second"):
        (folder / f"{name}.bvh").write_bytes(call("to-euler", "noop.glb", "-", "--clip", "#0").product())
    write_recipe(folder, "from-euler --onto clips/take.glb --name again", match="second.bvh", out="clips/{stem}.glb")
    write_recipe(folder, ONTO, match="take.bvh", out="clips/{stem}.glb")
    write_recipe(folder, PLAIN, match="hero.glb")
    return folder


@pytest.mark.parametrize("options", [(), ("--jobs", "1"), ("--no-cache",), ("--resume",)])
def test_what_steps_read_is_made_before(options: tuple[str, ...], chain: Path, call: Call) -> None:
    """The first run was exit 3; after a change of the source, outputs were of the old one, with exit 0."""
    assert "3 files: 3 made" in call("run", *options).err
    (chain / "hero.glb").write_bytes(call("retime", "noop.glb", "--speed", "2").product())
    assert "3 files: 3 made" in call("run", *options).err
    made = call(*ONTO.split(), "take.bvh").product()
    assert (chain / "clips/take.glb").read_bytes() == made
    clips = json.loads(call("inspect", "clips/second.glb", "--format", "json").text)["files"][0]["clips"]
    assert clips[-1]["name"] == "again"
    assert ("3 made" if "--no-cache" in options else "3 files: 3 ") in call("run", *options).err


def test_what_reads_an_output_that_failed_fails_too(chain: Path, call: Call) -> None:
    """It took the old output."""
    call("run").product()
    (chain / "hero.glb").write_bytes(b"no glTF")
    run = call("run")
    assert run.code == 3
    assert "take.bvh: its steps read 'build/hero.glb', which was not made" in run.err
    assert "second.bvh: its steps read 'clips/take.glb', which was not made" in run.err
    assert set(statuses(chain).values()) == {"failed"}


def test_outputs_that_need_each_other_are_refused(folder: Path, call: Call) -> None:
    for name, other in (("a", "b"), ("b", "a")):
        (folder / f"{name}.bvh").write_text("HIERARCHY")
        write_recipe(folder, f"from-euler --onto {other}.glb", match=f"{name}.bvh", out="{stem}.glb")
    words = "'a.glb' and 'b.glb' can't be made: steps read the output of each other"
    assert words in refusal(call("run"), 2)


def test_a_recipe_that_matches_only_outputs_of_others_is_a_warning(folder: Path, call: Call) -> None:
    """It was skipped without a word."""
    write_recipe(folder, PLAIN, match="noop.glb", out="b.glb", name="first")
    write_recipe(folder, PLAIN, match="b.glb", out="c.glb", name="next")
    write_recipe(folder, PLAIN, match="none/*.glb", out="d/{path}", name="none")
    write_recipe(folder, PLAIN, match="*.glb", out="{stem}-small.glb", name="beside")
    line = "warning: recipe 'next' makes nothing: it matches only outputs of others ('b.glb'), which "
    for _ in range(2):
        run = call("run", "-q")
        assert (run.code, run.err.count("makes nothing")) == (0, 1)
        assert line in run.err
    run = call("run", "--recipe", "next")
    assert run.code == 3
    assert line in run.err
    assert "1 file: 1 made" in call("run", "--recipe", "next", "b.glb").err
    assert "makes nothing" not in call("run", "b.glb").err

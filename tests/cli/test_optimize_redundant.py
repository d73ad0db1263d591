"""Redundant keys through `optimize`: `inspect` finds none afterwards, and a second run changes nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

import fixtures
from tests.cli.conftest import Call, Find

FAST = ("--effort", "fast")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(fixtures.FIXTURES))
def test_inspect_finds_no_redundant_key_of_a_fixture(name: str, fixture: Find, call: Call, tmp_path: Path) -> None:
    assert call("optimize", fixture(name), tmp_path / "out.glb", *FAST).code == 0
    clips = call("inspect", tmp_path / "out.glb", "--format", "json").json["files"][0]["clips"]
    assert {each["name"]: each["redundant_keys"] for each in clips if each["redundant_keys"]} == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fox.glb", "CesiumMan.glb", "BitmojiRun.glb", "Robot.glb", "Knight.glb"])
def test_inspect_finds_no_redundant_key(name: str, asset: Find, call: Call, tmp_path: Path) -> None:
    first, second = tmp_path / "first.glb", tmp_path / "second.glb"
    assert call("optimize", asset(name), first, *FAST).code == 0
    clips = call("inspect", first, "--format", "json").json["files"][0]["clips"]
    assert {each["name"]: each["redundant_keys"] for each in clips if each["redundant_keys"]} == {}
    assert call("optimize", first, second, *FAST).code == 0
    assert second.read_bytes() == first.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "clip"), [("BitmojiRun.glb", "*"), ("Knight.glb", "T-Pose")])
def test_without_loss_whatever_may_be_dropped(name: str, clip: str, asset: Find, call: Call, tmp_path: Path) -> None:
    """Rests in decimals, keys in float32: near enough to look the same, and not the same."""
    run = call("optimize", asset(name), tmp_path / "out.glb", "--max-error", "0", "--drop", "rest", "--clip", clip)
    assert run.code == 0, run.err
    assert "no vertex moved" in run.err

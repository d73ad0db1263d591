"""Loops through `optimize`: what was closed is closed to the bit, and `loop` calls each clip what it was."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from anim.model import Track
from tests.cli.conftest import Call, Find, Fixture
from tests.files import clips_of

REAL = ("Fox.glb", "CesiumMan.glb", "BitmojiRun.glb")
LARGE = ("Knight.glb", "Robot.glb")


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("--meshopt", "ext")])
@pytest.mark.parametrize("bound", ["0.01%", "0.5%"])
def test_loops_of_the_biped_stay_closed(
    call: Call, fixture: Fixture, bound: str, options: tuple[str, ...], tmp_path: Path
) -> None:
    _hold(call, fixture("biped"), tmp_path / "out.glb", "--max-error", bound, *options)


@pytest.mark.slow
@pytest.mark.parametrize("bound", ["0.01%", "0.1%"])
@pytest.mark.parametrize("name", [*REAL, *LARGE])
def test_loops_of_real_files_stay_closed(call: Call, asset: Find, name: str, bound: str, tmp_path: Path) -> None:
    _hold(call, asset(name), tmp_path / "out.glb", "--max-error", bound, "--effort", "fast")


def _hold(call: Call, source: Path, output: Path, *options: str) -> None:
    call("optimize", source, output, "-q", "-j", "1", *options).product()
    before, after = (clips_of(path.read_bytes()) for path in (source, output))
    for old, new in zip(before, after, strict=True):
        closed = {each.target for each in old.tracks if _is_closed(each)}
        opened = [each.target for each in new.tracks if each.target in closed and not _is_closed(each)]
        assert not opened, (old.name, opened)
    kinds = [[each["kind"] for each in _loops(call, path)] for path in (source, output)]
    assert kinds[0] == kinds[1]


def _loops(call: Call, path: Path) -> list[dict[str, object]]:
    found: list[dict[str, object]] = call("loop", path, "--format", "json").json["loops"]
    return found


def _is_closed(track: Track) -> bool:
    """Equal at both ends to the bit; −q is the rotation q."""
    first, last = np.asarray(track.values[0]), np.asarray(track.values[-1])
    return bool((first == last).all() or (track.path == "rotation" and (first == -last).all()))

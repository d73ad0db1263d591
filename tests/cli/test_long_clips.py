"""Small files with clips of hours: what they would be sampled to is counted before it is computed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, refusal

HOURS_S = 60_000.0


@pytest.fixture
def long(tmp_path: Path, call: Call) -> Path:
    """A skinned fixture played over hours."""
    path = tmp_path / "long.glb"
    path.write_bytes(built("tube"))
    call("retime", path, path, "--duration", str(HOURS_S)).product()
    return path


@pytest.mark.parametrize(
    ("line", "out"),
    [
        ("resample --fps 150", "out.glb"),
        ("resample --fps 100 --interpolation cubicspline", "out.glb"),
        ("to-euler --fps 100", "out.csv"),
        ("to-euler --fps 100", "out.json"),
        ("to-euler --fps 100", "out.bvh"),
        ("sample --fps 100", "out.json"),
        ("convert", "out.usdc"),
    ],
)
def test_frames_of_a_long_clip_count(line: str, out: str, long: Path, call: Call, tmp_path: Path) -> None:
    if out.endswith(".usdc"):
        pytest.importorskip("pxr")
    command, *options = line.split()
    clip = [] if command == "resample" else ["--clip", "#0"]
    run = call(command, long, tmp_path / out, *options, *clip)
    assert "would take" in refusal(run, 4)
    assert list(tmp_path.iterdir()) == [long]

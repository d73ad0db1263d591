"""Small files with clips of hours: what they would be sampled to is counted before it is computed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, help_line, refusal

HOURS_S = 60_000.0
MONTHS_S = 1.6e7


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


@pytest.mark.parametrize(
    ("line", "out", "advice"),
    [
        ("resample --fps 30", "out.glb", "a lower --fps"),
        ("optimize", "out.glb", "--clip"),
        ("diff", "", "--clip"),
        ("spline --tangents natural", "out.glb", "--clip"),
        ("loop --blend 0.2", "out.glb", "--clip"),
        ("collapse", "", "--samples-per-second"),
        ("sample --fps 10", "out.csv", "a lower --fps"),
        ("to-euler --fps 10", "out.bvh", "a lower --fps"),
        ("convert", "out.usdc", "a lower --fps"),
        ("bake --fps 30", "out.npz", "a lower --fps"),
        ("bake --fps 30", "out.glb", "a lower --fps"),
        ("render", "out.gif", "--from"),
        ("simulate springs --chain *", "out.glb", "--duration"),
        ("simulate cloth --mesh *", "out.npz", "--duration"),
        ("simulate particles --node *", "out.glb", "--duration"),
    ],
)
def test_clips_of_months_are_refused_alike(line: str, out: str, advice: str, call: Call, tmp_path: Path) -> None:
    """A limit of resources is exit 4, whichever of file and options is to blame, and says what helps."""
    if out.endswith(".usdc"):
        pytest.importorskip("pxr")
    endless = tmp_path / "endless.glb"
    endless.write_bytes(built("tube"))
    call("retime", endless, endless, "--duration", str(MONTHS_S)).product()
    words = line.split()
    number = 2 if words[0] == "simulate" else 1
    files = [endless, endless] if words[0] == "diff" else [endless, tmp_path / out] if out else [endless]
    run = call(*words[:number], *files, *words[number:], "--clip", "#0")
    assert refusal(run, 4).startswith(f"gltf-anim: {endless}: ")
    assert advice in help_line(run)
    assert list(tmp_path.iterdir()) == [endless]


@pytest.mark.parametrize("command", ["resample --fps 30", "optimize"])
def test_a_short_clip_that_starts_after_months_is_told_to_start_at_0(command: str, call: Call, tmp_path: Path) -> None:
    """Players show its first pose until then, so that this time counts: to shorten the clip does not help."""
    late, out = tmp_path / "late.glb", tmp_path / "out.glb"
    late.write_bytes(built("tube"))
    call("retime", late, late, "--offset", "1e6", "--clip", "#0").product()
    name, *options = command.split()
    run = call(name, late, out, *options, "--clip", "#0")
    refusal(run, 4)
    assert "trim, which also moves a late start to 0 s" in help_line(run)
    call("trim", late, late, "--rebase", "--clip", "#0").product()
    call(name, late, out, *options, "--clip", "#0").product()


def test_a_number_of_pictures_has_its_own_limit(long: Path, call: Call, tmp_path: Path) -> None:
    run = call("render", long, tmp_path / "out.gif", "--clip", "#0")
    assert "frames at 24 fps (limit 3000)" in refusal(run, 4)
    assert "--frames" in help_line(run)

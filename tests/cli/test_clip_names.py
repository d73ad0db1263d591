"""A clip without a name is called #0 everywhere: in words, tables and data, as --clip '#0' takes it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, table
from tests.files import glb_of, opened

UNNAMED = ("clip 0", "clip 1", "''", "clip ''", "in '0'")


@pytest.fixture
def nameless(tmp_path: Path) -> Path:
    """The biped, whose first and second clip have lost their names."""
    document = opened(built("biped"))
    for animation in document.json["animations"][:2]:
        del animation["name"]
    path = tmp_path / "nameless.glb"
    path.write_bytes(glb_of(document))
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [
        ("inspect", "{}"),
        ("inspect", "{}", "--tracks", "--continuity"),
        ("inspect", "{}", "--format", "csv", "--tracks"),
        ("loop", "{}"),
        ("sample", "{}", "-", "--format", "csv", "--fps", "2", "--clip", "#0"),
        ("diff", "{}", "{}"),
        ("collapse", "{}", "--samples-per-second", "4"),
        ("optimize", "{}", "{}-out.glb", "-v", "--effort", "fast"),
        ("resample", "{}", "{}-out.glb", "--fps", "30", "-v"),
        ("retime", "{}", "{}-out.glb", "--speed", "2"),
        ("retime", "{}", "{}-out.glb", "--offset", "-7"),
        ("ease", "{}", "{}-out.glb", "--ease", "back-out"),
        ("spline", "{}", "{}-out.glb", "--tangents", "bspline"),
        ("to-euler", "{}", "{}.bvh"),
        ("sample", "{}", "-", "--clip", "nobody"),
    ],
    ids=" ".join,
)
def test_one_name(line: tuple[str, ...], nameless: Path, call: Call) -> None:
    run = call(*(word.format(nameless) for word in line))
    words = run.out.decode() + run.err
    assert "#0" in words
    assert not [each for each in UNNAMED if each in words], words


def test_the_name_is_one_that_selects(nameless: Path, call: Call) -> None:
    rows = table(call("inspect", nameless, "--format", "csv", "--tracks", "--clip", "#1").product())
    assert {row["clip"] for row in rows} == {"#1"}

"""A clip without a name is called #0 everywhere: in words, tables and data, as --clip '#0' takes it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, table
from tests.files import glb_of, opened

UNNAMED = ("clip 0", "clip 1", "''", "clip ''", "in '0'", "in '#", "of '#", "without a name", "the driving clip")


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
        ("bake", "{}", "{}.npz", "--clip", "#0", "--fps", "4"),
        ("simulate", "particles", "{}", "{}-out.glb", "--node", "head", "--rate", "4"),
        ("trim", "{}", "{}-out.glb", "--to", "0.5"),
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


@pytest.mark.slow
def test_one_name_beside_another_file(nameless: Path, call: Call, tmp_path: Path) -> None:
    """Clips that end elsewhere, a cache, a gate, and what can't be closed or is replaced."""
    cut, cache, motion = (tmp_path / name for name in ("cut.glb", "walk.npz", "walk.bvh"))
    for step in (
        ("trim", nameless, cut, "--to", "0.5"),
        ("bake", nameless, cache, "--clip", "#0", "--fps", "4"),
        ("to-euler", nameless, motion, "--clip", "#0", "--fps", "24"),
    ):
        assert call(*step, "-q").code == 0
    onto = ("from-euler", motion, "-", "--onto", nameless, "--replace")
    expected: dict[tuple[str | Path, ...], str] = {
        ("diff", nameless, cut): "clip #1 ends at 0.5 s instead of 2 s",
        ("diff", nameless, cut, "--fail-above", "1mm"): " in #1 at ",
        ("diff", nameless, cache, "--clip", "#0"): "\n#0 ",
        ("loop", cut, tmp_path / "closed.glb"): "clip #0 is not a loop",
        (*onto, "*"): "one of #0, #1, #2 'jump'",
        (*onto, "#0", "--name", "a"): "name of the clip: it has none",
    }
    for line, words in expected.items():
        run = call(*line)
        said = run.out.decode() + run.err
        assert words in said
        assert not [each for each in UNNAMED if each in said], said


def test_advice_on_a_replaced_clip_names_it(nameless: Path, call: Call, tmp_path: Path) -> None:
    """`trim` without --clip would cut the other clips too."""
    motion = tmp_path / "walk.bvh"
    assert call("to-euler", nameless, motion, "--clip", "#0", "--fps", "24", "-q").code == 0
    head, frames = motion.read_text().split("Frame Time:")
    rate, first, *rows = frames.strip("\n").split("\n")
    apart = " ".join(str(float(word) + 60 * (i > 2)) for i, word in enumerate(first.split()))
    motion.write_text(f"{head}Frame Time:{rate}\n" + "\n".join([apart, *rows]) + "\n")
    run = call("from-euler", motion, tmp_path / "out.glb", "--onto", nameless, "--replace", "#0")
    assert "the first frame is a pose apart" in run.err
    assert "--rebase --clip '#0'` removes it" in run.err
    run = call("from-euler", motion, tmp_path / "out.glb", "--onto", nameless, "--name", "jump")
    assert "a second clip 'jump': #3 beside #2" in run.err
    assert "--rebase --clip '#3'` removes it" in run.err

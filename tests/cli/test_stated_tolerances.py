"""Eased motion is fitted within tolerances, which the summary states; sizes of other formats are not compared."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.gltf.writing import writer
from anim.model import Clip, Track
from tests.cli.conftest import Call, Fixture
from tests.cli.running import built
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, track
from tests.files import glb_of, opened

MOVES = track("translation", [0, 1], [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]], LINEAR, node=0)
TURNS = track("rotation", [0, 1], about("x", [0, 90]), LINEAR, node=0)
HELD = track("scale", [0, 1], [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]], STEP, node=0)
BOTH = "easing within 0.05° and 0.1 % of each key interval's range"


@pytest.mark.parametrize(
    ("options", "tracks", "words"),
    [
        (("ease", "--ease", "smoothstep"), (MOVES,), "easing exact"),
        (("ease", "--ease", "smoothstep"), (MOVES, TURNS), "easing within 0.05°"),
        (("ease", "--ease", "sine-in-out"), (MOVES, TURNS, HELD), BOTH),
        (("ease", "--ease", "steps(4)"), (MOVES, TURNS), "easing exact"),
        (
            ("ease", "--ease", "smoothstep", "--interpolation", "linear", "--tolerance", "2%"),
            (MOVES,),
            "easing within 2 % of each key interval's range",
        ),
        (
            ("ease", "--per", "range", "--ease", "sine-in-out", "--angle-tolerance", "1deg"),
            (MOVES, TURNS),
            "easing within 1° and 0.1 % of each track's range",
        ),
        (("retime", "--warp", "sine-in-out"), (TURNS,), "easing within 0.05°"),
        (("retime", "--speed", "2"), (TURNS,), ""),
    ],
)
def test_the_summary_states_what_is_fitted(
    options: tuple[str, ...], tracks: tuple[Track, ...], words: str, call: Call, tmp_path: Path
) -> None:
    command, *rest = options
    data = glb_of(writer.replace_clips(opened(built("biped")), {0: Clip("walk", tracks)}))
    run = call(command, "-", tmp_path / "out.glb", "--clip", "walk", *rest, stdin=data)
    summary = run.err.splitlines()[-1]
    assert (f", {words}, took" in summary) if words else "easing" not in summary


def test_a_spline_under_a_cubic_easing_is_fitted(call: Call, tmp_path: Path) -> None:
    """A cubic of a cubic is of degree nine."""
    still = [[0.0, 0, 0]] * 2
    spline = Track(0, "translation", CUBICSPLINE, MOVES.times, MOVES.values, still, still)
    data = glb_of(writer.replace_clips(opened(built("biped")), {0: Clip("walk", (spline,))}))
    run = call("ease", "-", tmp_path / "out.glb", "--clip", "walk", stdin=data)
    assert "easing within 0.1 % of each key interval's range" in run.err


def test_sizes_of_different_formats_are_not_compared(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    """A BVH of 18 kB was "-93 %" of its model, and sticks were "+1002 %" of their BVH."""
    motion, sticks = tmp_path / "walk.bvh", tmp_path / "sticks.glb"
    made = call("to-euler", fixture("biped"), motion, "--clip", "walk", "--fps", "24")
    assert "→" not in made.err
    assert "→" not in call("from-euler", motion, sticks).err
    onto = call("from-euler", motion, tmp_path / "onto.glb", "--onto", fixture("biped"))
    assert "onto.glb  271 kB → " in onto.err

"""`plot` and `inspect --continuity` from the command line: files, pipes, refusals, and the words of the issue."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.authoring import build_document
from anim.model import Clip
from anim.show.plots.figure import TITLE, text_width
from anim.show.plots.stability_plot import LEFT, WIDTH
from tests import clips
from tests.anim.show.reading import png_size, words
from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal, shell, table
from tests.clips import STEP
from tests.files import glb_of

VALUES = np.array([[0, 0, 0], [0.9, 0, 0], [0.2, 0, 0], [1, 0, 0]])


@pytest.fixture
def book() -> bytes:
    """The curve of the book, 0, 0.9, 0.2, 1, as lines and as steps."""
    line = clips.track("translation", range(4), VALUES)
    steps = clips.track("translation", range(4), VALUES, STEP, node=1)
    return glb_of(build_document(clips.skeleton([-1, 0]), [Clip("book", (line, steps))]))


def counted(call: Call, data: bytes) -> list[dict[str, int]]:
    found = call("inspect", "--continuity", "--format", "json", stdin=data).json
    assert found["schema"] == 1
    names = ("jumps", "c0", "g1", "c1", "c2")
    return [
        {name: track[name] for name in names if track[name]} for track in found["files"][0]["clips"][0]["continuity"]
    ]


def test_continuity_says_exactly_that(call: Call, book: bytes) -> None:
    assert counted(call, book) == [{"c0": 2}, {"jumps": 2}]
    for rule, expected in (("catmull-rom", "c1"), ("natural", "c2")):
        spline = call("spline", "-", "-", "--tangents", rule, "--node", "0", stdin=book).product()
        assert counted(call, spline) == [{expected: 2}, {"jumps": 2}]


def test_continuity_as_text(call: Call, book: bytes) -> None:
    text = call("inspect", "--continuity", stdin=book).product().decode()
    line, steps = (row for row in text.splitlines() if row.split()[1:2] == ["translation"])
    assert line.split() == [*["0", "translation", "linear", "2", "2", "1.6", "m/s", "at", "1", "s", "jump,", "1", "m"]]
    assert steps.split() == [*["1", "translation", "step", "2", "2", "90", "cm", "at", "1", "s", "jump,", "1", "m"]]


def test_continuity_as_csv_and_json(call: Call, book: bytes) -> None:
    rows = table(call("inspect", "--continuity", "--format", "csv", stdin=book).product())
    assert [row["c0"] for row in rows] == ["2", "0"]
    assert float(rows[0]["largest_speed_jump"]) == pytest.approx(1.6)
    assert rows[0]["seam"] == "jump"
    track = call("inspect", "--continuity", "--format", "json", stdin=book).json["files"][0]["clips"][0]["continuity"][
        0
    ]
    assert track["keys"]["grades"] == ["C0", "C0"]
    assert track["keys"]["speed_jumps"] == pytest.approx([1.6, 1.5])
    assert track["largest_speed_jump"] == {"size": pytest.approx(1.6), "time_s": 1}
    assert track["unit"] == "m"


def test_without_the_option_nothing_changes(call: Call, book: bytes) -> None:
    assert "continuity" not in call("inspect", "--format", "json", stdin=book).product().decode()
    assert "smoothness" not in call("inspect", stdin=book).product().decode()


def test_files(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    walk = fixture("biped")
    for name in ("walk.png", "walk.svg"):
        run = call("plot", walk, tmp_path / name, "--clip", "walk", "--node", "hips")
        assert (run.code, run.out) == (0, b"")
        assert run.err.startswith(f"{tmp_path / name}  ")  # one line after a write: its name and size
        assert run.err.count("\n") == 1
    said = words((tmp_path / "walk.svg").read_bytes())
    assert "biped: walk" in said
    assert said.count("hips") == 2
    assert png_size((tmp_path / "walk.png").read_bytes())[0] > 900


def test_same_bytes_in_another_process(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    walk = fixture("biped")
    here = call("plot", walk, "--limit", "2", "--format", "svg", "-q").product()
    line = f"PYTHONHASHSEED=7 gltf-anim plot {walk.name} --limit 2 --format svg -q"
    assert shell(line, tmp_path).product() == here


def test_pipes(tmp_path: Path, fixture: Fixture) -> None:
    walk = fixture("biped")
    run = shell(f"gltf-anim resample {walk.name} --fps 10 | gltf-anim plot --limit 1 > out.png", tmp_path)
    assert run.code == 0, run.err
    assert "drew the first 1 of" in run.err
    png_size((tmp_path / "out.png").read_bytes())


def test_the_limit_is_said(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("plot", fixture("biped"), tmp_path / "a.svg", "--limit", "3")
    assert run.err.startswith("note: drew the first 3 of ")
    assert "--clip, --node and --path" in run.err
    assert "3 of " in " ".join(words((tmp_path / "a.svg").read_bytes()))


def test_compare(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    walk = fixture("biped")
    call("resample", walk, tmp_path / "slow.glb", "--fps", "6", "-q").product()
    call(
        "plot", walk, tmp_path / "a.svg", "--compare", tmp_path / "slow.glb", "--clip", "walk", "--limit", "2", "-q"
    ).product()
    said = words((tmp_path / "a.svg").read_bytes())
    assert {"biped.glb", "slow.glb"} <= set(said)
    assert sum(text.startswith("difference: at most ") for text in said) == 2
    assert any("25 → 7 keys" in text for text in said)


def test_eases_and_rules(call: Call, tmp_path: Path) -> None:
    call("plot", "--ease", "smoothstep", "--ease", "cubic-bezier(.2,0,0,1)", tmp_path / "e.svg").product()
    assert {"smoothstep", "cubic-bezier(0.2, 0, 0, 1)"} <= set(words((tmp_path / "e.svg").read_bytes()))
    run = call(
        "plot", "--through", "0,0.9,0.2,1", "--tangents", "catmull-rom", "--tangents", "linear", "--format", "svg"
    )
    said = words(run.product())
    assert "C1 at every key; overshoots by 0.00108" in said
    assert "velocity, per second" in said  # signed, so no speed
    assert "C0 at every key; no overshoot" in said
    timed = words(call("plot", "--through", "0:0,0.5:0.9,2:1", "--format", "svg").product())
    assert {"catmull-rom", "0.5", "2 s"} <= set(timed)


@pytest.mark.slow
def test_integrators_of_an_oscillator(call: Call) -> None:
    said = words(call("plot", "--integrators", "--omega", "20", "--step", "1/9", "--format", "svg").product())
    title = next(each for each in said if each.startswith("Step 1/9 s, ω·h = 2.22: "))
    assert title.endswith(": all but rk4, implicit-euler diverge")
    assert any(each.startswith("Largest stable steps of this system: verlet 1/10 s, rk4 1/7.071 s") for each in said)
    assert {"verlet", "rk4", "explicit-euler", "this run"} <= set(said) | {each.split("\n")[0] for each in said}
    calm = words(call("plot", "--integrators", "--format", "svg").product())
    assert any(each.startswith("Step 1/60 s, ω·h = 0.33: explicit-euler (2.20 s) diverges") for each in calm)
    assert call("plot", "--integrators").product() == call("plot", "--integrators").product()


@pytest.mark.parametrize(
    ("omega", "step", "title"),
    [
        ("1", "0.008", "Step 1/125 s, ω·h = 0.008: no integrator diverges within 63 s"),  # near the limit of steps
        ("12", "1/60", "Step 1/60 s, ω·h = 0.20: explicit-euler gains energy ×223000 in 5.2 s"),  # 1.04³¹⁴
        ("100", "0.0283", "Step 1/35.34 s, ω·h = 2.83: all but rk4, implicit-euler diverge"),
        ("100", "0.0285", "Step 1/35.09 s, ω·h = 2.85: all but rk4, implicit-euler diverge"),
        ("100", "0.05", "Step 1/20 s, ω·h = 5.00: all but implicit-euler diverge"),
    ],
)
def test_the_title_of_integrators_fits(omega: str, step: str, title: str, call: Call) -> None:
    drawn = call("plot", "--integrators", "--omega", omega, "--step", step, "--format", "svg").product()
    assert title in words(drawn)
    assert text_width(title, TITLE + 2, "bold") < WIDTH - LEFT


@pytest.mark.parametrize(
    ("args", "code", "words"),
    [
        (["biped.glb", "out.pdf"], 2, "out.pdf: is no .png or .svg file"),
        (["biped.glb", "out.png", "more.png"], 2, "3 files are named (expected IN and OUT)"),
        (["biped.glb", "nowhere/out.png"], 3, "there is no folder"),
        (["biped.glb", "out.png", "--limit", "0"], 2, "--limit is 0"),
        (["biped.glb", "out.png", "--clip", "wlak"], 5, "no clip matches 'wlak'"),
        (["biped.glb", "out.png", "--node", "nobody"], 5, "no node matches 'nobody'"),
        (["biped.glb", "out.png", "--path", "weights"], 5, "biped.glb: no track is selected"),
        (["missing.glb", "out.png"], 3, "missing.glb"),
        (["biped.glb", "out.png", "--compare", "missing.glb"], 3, "missing.glb"),
        (["-", "out.png", "--compare", "-"], 2, "can't both be stdin"),
        (["--ease", "smoth", "out.png"], 2, "unknown easing 'smoth' (did you mean 'smoothstep'"),
        (["--ease", "linear", "in.glb", "out.png"], 2, "2 files are named (expected OUT)"),
        (["--ease", "linear", "--through", "0,1", "out.png"], 2, "exclude each other"),
        (["--ease", "linear", "--clip", "x", "out.png"], 2, "read no file"),
        (["--tangents", "natural", "biped.glb", "out.png"], 2, "--tangents needs --through"),
        (["--omega", "3", "biped.glb", "out.png"], 2, "need --integrators"),
        (["--integrators", "--ease", "linear", "out.png"], 2, "excludes --ease"),
        (["--integrators", "--omega", "0", "out.png"], 2, "--omega is 0 rad/s"),
        (["--integrators", "--step", "0", "out.png"], 2, "--step is '0'"),
        (["--integrators", "--omega", "1e308", "out.png"], 2, "--omega is 1e+308 rad/s (expected 1e-09 to 1e+09)"),
        (["--integrators", "--omega", "1e200", "--step", "1e-200", "out.png"], 2, "--omega is 1e+200 rad/s"),
        (["--integrators", "--step", "1e300", "out.png"], 2, "expected at most 5e+04 s: --omega times --step"),
        (["--integrators", "--step", "1e-9", "out.png"], 2, "at least 0.000315 s: 10000 steps"),
        (["--integrators", "--omega", "1e6", "--step", "1e-9", "out.png"], 2, "expected at least 6.29e-09 s"),
        (["--integrators", "--step", "1e-320", "out.png"], 2, "--step is '1e-320' (expected at least 0.000315 s"),
        (["--through", "1e308,-1e308,1e308", "--tangents", "natural", "out.png"], 2, "has a value of 1e+308 (limit"),
        (["--through", "0:0,1:1,1e300:2", "out.png"], 2, "--through has a time of 1e+300 (limit 1e+12)"),
        (["--through", "0:0,1e-300:1,1:2", "out.png"], 2, "--through has times 1e-300 s apart (expected at least"),
        (["--through", ",".join("01" * 501), "out.png"], 2, "--through has 1002 values (limit 1000)"),
        (["--through", "0,x", "out.png"], 2, "can't read '0,x'"),
        (["--through", "0:1,2", "out.png"], 2, "all of them with a time or none"),
        (["--through", "1", "out.png"], 2, "two or more values"),
        (["--through", "0:1,0:2", "out.png"], 2, "not increasing"),
        (["--through", "0,nan", "out.png"], 2, "nan"),
        (["--through", "0,1", "--tangents", "natrual", "out.png"], 2, "natrual"),
        (["biped.glb", "out.png", "--euler", "XYW"], 2, "order is 'XYW'"),
        (["biped.glb", "out.png", "--euler", "XYZ", "--components"], 2, "exclude each other"),
        (["biped.glb", "out.png", "--euler", "XYZ", "--path", "translation"], 5, "no track is selected"),
        (["--ease", "linear", "--euler", "XYZ", "out.png"], 2, "read no file"),
        (["biped.glb", "out.png", "--format", "pdf"], 2, "'pdf' is none of png, svg"),
    ],
)
def test_refusals(
    call: Call,
    fixture: Fixture,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    args: list[str],
    code: int,
    words: str,
) -> None:
    fixture("biped")
    monkeypatch.chdir(tmp_path)
    assert words in refusal(call("plot", *args), code)
    assert not (tmp_path / "out.png").exists()


def test_files_without_a_common_track(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("plot", fixture("biped"), tmp_path / "a.svg", "--compare", fixture("noop"), "-q")
    assert "noop.glb: has none of the tracks" in refusal(run, 5)
    assert help_line(run).startswith("its clips are ")


def test_the_extra_that_is_missing(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    run = call("plot", "--ease", "linear", tmp_path / "a.png")
    refusal(run, 4)
    assert help_line(run) == "pip install 'gltf-anim[plot]'"

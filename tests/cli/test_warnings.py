"""What changes the meaning of a number is said however quiet, once, and stands in the JSON report; nothing else is.

-q leaves out words and tables, and never a product.
"""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from cli.command_table import COMMANDS
from tests import pages
from tests.anim.skinning.odd_rigs import with_bad_sums
from tests.cli.conftest import Call
from tests.cli.curve_files import SMALL
from tests.cli.running import ROOT, built
from tests.cli.test_instancing import with_copies

SUMS = "don't add up to 1"
COPIES = "has copies of a mesh by EXT_mesh_gpu_instancing"
JSON = ("--format", "json")
POINTER = "the pointer '/nodes/1/weights/7' moves nothing: no node has such morph weights"
REPORT = ("--report", "-", "--effort", "fast")
WARNED = (  # command line, words of the warning, options that ask for the report; none where there is no report
    (("resample", "bad.glb", "out.glb", "--fps", "9"), SUMS, ()),
    (("bake", "bad.glb", "{clip}.npz", "--fps", "4"), SUMS, ()),
    (("render", "bad.glb", "out.png", "--frames", "2"), SUMS, ()),
    (("convert-cache", "bad.glb", "out.npz", "--at", "0"), SUMS, ()),
    (("collapse", "bad.glb", "--samples-per-second", "4"), SUMS, JSON),
    (("loop", "bad.glb"), SUMS, JSON),
    (("diff", "bad.glb", "bad.glb"), SUMS, JSON),
    (("optimize", "bad.glb", "out.glb", "--effort", "fast"), SUMS, REPORT),
    (("resample", "copies.glb", "out.glb", "--fps", "9"), COPIES, ()),
    (("diff", "copies.glb", "copies.glb"), COPIES, JSON),
    (("optimize", "copies.glb", "out.glb", "--effort", "fast"), COPIES, REPORT),
    (("resample", "lost.glb", "out.glb", "--fps", "9"), POINTER, ()),
    (("bake", "lost.glb", "out.npz", "--clip", "weights", "--fps", "4"), POINTER, ()),
    (("loop", "lost.glb"), POINTER, JSON),
    (("optimize", "lost.glb", "out.glb", "--effort", "fast"), POINTER, REPORT),
    (("diff", "arm.glb", "biped.glb"), "no clip and no node has the same name", JSON),
    (("optimize", "arm.glb", "out.glb", "--max-error", "0.1", "--effort", "fast"), "0.1 means 0.1 m", REPORT),
    (
        ("optimize", "small.glb", "out.glb", "--max-error", "2%"),
        "measured from it, not from its source",
        REPORT,
    ),
    (("from-euler", "small.bvh", "out.glb"), "scale: 0.01 m per unit, guessed: centimeters", JSON),
    (("from-euler", "small.bvh", "out.glb"), "is taken for 1/30 s", JSON),
    (("to-euler", "late.glb", "out.bvh", "--clip", "walk"), "a BVH begins there, at 0", ()),
    (("bake", "tube.glb", "out.npz", "--clip", "twist180"), "linear interpolation between frames: error of ", ()),
    (("convert-cache", "arm.glb", "out.npz"), "clip 'twist', one of 2", ()),
    (("bake", "tube.glb", "tube.ply", "--clip", "twist180", "--fps", "2"), "frame of before still there", ()),
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call) -> Path:
    """Files to warn of, in the current folder."""
    monkeypatch.chdir(tmp_path)
    for name in ("arm", "biped", "tube", "pointer"):
        (tmp_path / f"{name}.glb").write_bytes(built(name))
    (tmp_path / "bad.glb").write_bytes(with_bad_sums(built("arm")))
    (tmp_path / "copies.glb").write_bytes(with_copies("arm"))
    (tmp_path / "lost.glb").write_bytes(built("pointer").replace(b'"/nodes/1/weights/1"', b'"/nodes/1/weights/7"'))
    (tmp_path / "small.bvh").write_bytes(SMALL.replace(b"0.033333", b"0.03334"))
    return tmp_path


@pytest.mark.parametrize(("line", "words", "report"), WARNED, ids=[f"{line[0]}: {words}" for line, words, _ in WARNED])
def test_warnings(line: tuple[str, ...], words: str, report: tuple[str, ...], folder: Path, call: Call) -> None:
    if "small.glb" in line:
        call("optimize", "arm.glb", "small.glb", "--max-error", "1%", "--effort", "fast").product()
    if "late.glb" in line:
        call("trim", "biped.glb", "late.glb", "--from", "0.5", "--clip", "walk").product()
    if "tube.ply" in line:
        call("bake", "tube.glb", "tube.ply", "--clip", "twist180", "--fps", "3").product()
    run = call(*line, "-q")
    assert run.code == 0, run.err
    said = [each for each in run.err.splitlines() if words in each]
    assert len(said) == 1, run.err
    assert all(each.startswith("warning: ") for each in run.err.splitlines())
    if report:
        document = json.loads(call(*line, *report, "-q").product())
        assert [f"warning: {each}" for each in document["warnings"]] == run.err.splitlines()


@pytest.mark.parametrize(
    ("line", "report"),
    [
        (("loop", "arm.glb"), JSON),
        (("collapse", "arm.glb"), JSON),
        (("diff", "arm.glb", "arm.glb"), JSON),
        (("optimize", "arm.glb", "out.glb", "--effort", "fast"), REPORT),
        (("diff", "pointer.glb", "pointer.glb"), JSON),
    ],
)
def test_reports_of_sound_files_have_no_warnings(
    line: tuple[str, ...], report: tuple[str, ...], folder: Path, call: Call
) -> None:
    run = call(*line, *report)
    assert run.json["warnings"] == []
    assert "warning" not in run.err


QUIET = {  # a line for each command, and how its product on stdout begins; b"" for none
    "inspect": (("arm.glb",), b""),
    "check": (("arm.glb",), b""),
    "loop": (("arm.glb",), b""),
    "run": (("arm.glb",), b""),
    "collapse": (("arm.glb", "--samples-per-second", "4"), b""),
    "diff": (("arm.glb", "arm.glb"), b""),
    "sample": (("arm.glb", "--at", "0"), b"{"),
    "resample": (("arm.glb", "--fps", "4"), b"glTF"),
    "from-euler": (("door.csv", "--order", "XYZ", "--axes", "extrinsic", "--unit", "deg"), b"glTF"),
    "to-euler": (("arm.glb", "--clip", "bend"), b"HIERARCHY"),
    "ease": (("arm.glb",), b"glTF"),
    "spline": (("arm.glb",), b"glTF"),
    "retime": (("arm.glb", "--speed", "2"), b"glTF"),
    "trim": (("arm.glb", "--to", "0.5"), b"glTF"),
    "bake": (("arm.glb", "out.npz", "--clip", "bend", "--fps", "24"), b""),
    "plot": (("arm.glb", "--format", "svg"), b"<?xml"),
    "convert-cache": (("one.npz", "out.pc2"), b""),
    "render": (("arm.glb", "-", "--frames", "1"), b"\x89PNG"),
    "view": (("arm.glb", "-o", "-"), b"<!doctype html>"),
    "simulate": (("particles", "arm.glb", "--node", "*"), b"glTF"),
    "optimize": (("arm.glb", "--effort", "fast"), b"glTF"),
    "convert": (("arm.glb",), b"glTF"),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_quiet_leaves_out_words_and_never_a_product(command: str, folder: Path, call: Call) -> None:
    if command == "view" and pages.missing():
        pytest.skip(pages.missing())
    if command == "convert-cache":
        call("bake", "arm.glb", "one.npz", "--clip", "bend", "--fps", "24").product()
    (folder / "door.csv").write_text("time,door.rx\n0,0\n1,90\n")
    recipe = 'match = "*.glb"\nsteps = ["resample --fps 4"]\nout = "build/{path}"\n'
    (folder / "gltf-anim.toml").write_text(f"[[recipe]]\n{recipe}")
    assert command in QUIET, f"add a line to QUIET for {command}"
    options, product = QUIET[command]
    run = call(command, *options, "-q")
    assert run.code == 0, run.err
    assert run.err == ""
    assert run.out.startswith(product)
    assert bool(run.out) == bool(product)


def test_scenes_are_read_in_one_place() -> None:
    """Where their weights are looked at, too."""
    found = [
        path.name
        for path in (ROOT / "cli").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Attribute) and node.attr == "scene" and ast.unparse(node.value) == "reader"
    ]
    assert sorted(found) == ["edit_clips.py", "scenes.py"]

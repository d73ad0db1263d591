"""What `collapse`, `loop` and `optimize` advise is a command line that runs, and does what it is for."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.inspecting import Json
from tests.cli.running import built


def lines_of(advised: list[str]) -> list[list[str]]:
    """The command lines in advice, as words without the name of the program."""
    return [shlex.split(line.partition("gltf-anim ")[2]) for line in advised if "gltf-anim " in line]


def placed(line: list[str], path: Path, output: Path) -> list[str]:
    """A line with files for IN and OUT; an OUT for several clips goes beside it."""
    files = {"IN": str(path), "OUT": str(output), "OUT-{clip}.glb": str(output.with_name("{clip}.glb"))}
    return [files.get(word, word) for word in line]


@pytest.mark.parametrize(
    ("name", "options", "commands"),
    [
        ("biped", [], ["bake"]),
        ("arm", [], ["bake"]),
        ("tube", [], ["bake", "collapse", "collapse"]),
        ("tube", ["--method", "lbs"], ["collapse"]),
        ("tube", ["--bulge-clamp"], ["bake"]),
        ("arm", ["--method", "dqs", "--clip", "bend"], ["collapse"]),
    ],
)
def test_what_collapse_advises(name: str, options: list[str], commands: list[str], call: Call, tmp_path: Path) -> None:
    """Each line runs: a bake is written per clip that pinches; another look measures what was not measured yet."""
    path, seen = tmp_path / "in.glb", tmp_path / "baked"
    path.write_bytes(built(name))
    seen.mkdir()
    before = call("collapse", path, *options, "--format", "json").json
    lines = lines_of(before["advice"])
    assert [line[0] for line in lines] == commands
    for line in lines:
        run = call(*placed(line, path, seen / "out.glb"), *(["--format", "json"] if line[0] == "collapse" else []))
        assert run.code == 0, run.err
        if line[0] == "bake":
            pinched = [each for each in before["clips"] if any(mesh["pinches"] for mesh in each["meshes"])]
            assert len(list(seen.iterdir())) == len(pinched)
        else:
            assert (run.json["methods"], run.json["bulge_clamp"]) != (before["methods"], before["bulge_clamp"])
            if before["methods"] == ["lbs", "dqs"]:
                assert _worst_bulge(run.json) < _worst_bulge(before)


def _worst_bulge(report: Json) -> float:
    """What the better one of the methods other than lbs bulges at worst."""
    worst: dict[str, float] = {}
    for fared in (fared for each in report["clips"] for mesh in each["meshes"] for fared in mesh["methods"]):
        worst[fared["method"]] = max(worst.get(fared["method"], 0.0), fared["bulge_max"])
    return min(value for method, value in worst.items() if method != "lbs")


@pytest.mark.parametrize("name", ["arm", "tube"])
def test_what_loop_advises_closes_the_clips(name: str, call: Call, tmp_path: Path) -> None:
    path, output = tmp_path / "in.glb", tmp_path / "out.glb"
    path.write_bytes(built(name))
    (line,) = lines_of(call("loop", path, "--format", "json").json["advice"])
    call(*placed(line, path, output)).product()
    closed = call("loop", output, "--format", "json").json
    assert {each["kind"] for each in closed["loops"]} == {"closed"}
    assert closed["advice"] == []


def test_what_loop_advises_adds_the_missing_frame(call: Call, tmp_path: Path) -> None:
    path, output, cut = tmp_path / "in.glb", tmp_path / "out.glb", ["--clip", "walk", "--to", "0.9583333"]
    path.write_bytes(built("biped"))
    path.write_bytes(call("trim", path, "-", *cut, "-q").product())
    line, *others = lines_of(call("loop", path, "--format", "json").json["advice"])
    assert "--blend" not in line
    assert all("--blend" in other for other in others)  # the jump has another speed at its end
    call(*placed(line, path, output)).product()
    assert {each["kind"] for each in call("loop", output, "--format", "json").json["loops"]} == {"closed"}


@pytest.mark.parametrize("options", [[], ["--max-error", "1%"]])
def test_what_optimize_advises_fits(options: list[str], call: Call, tmp_path: Path) -> None:
    path, output, fast = tmp_path / "in.glb", tmp_path / "out.glb", [*options, "--effort", "fast"]
    path.write_bytes(built("arm"))
    run = call("optimize", path, output, "--max-bytes", "1", *fast)
    assert run.code == 6
    (line,) = lines_of(run.err.splitlines())
    call(*placed(line, path, output), *fast).product()
    assert output.stat().st_size <= int(line[-1])

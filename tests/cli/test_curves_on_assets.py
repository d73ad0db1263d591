"""The curve commands on real files: no new error by the Khronos validator, through pipes as well."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call, Find
from tests.cli.running import shell
from tests.khronos import errors, needs_validator, validate_many

ASSETS = ["Fox.glb", "CesiumMan.glb", "InterpolationTest.gltf", "Knight.glb"]
COMMANDS = [
    ["ease", "--ease", "smoothstep"],
    ["ease", "--ease", "elastic-out", "--tolerance", "1%", "--angle-tolerance", "0.5deg"],
    ["ease", "--ease", "steps(3)"],
    ["ease", "--per", "range", "--ease", "back-in-out"],
    ["spline"],
    ["spline", "--tangents", "natural"],
    ["retime", "--speed", "0.3", "--ping-pong"],
    ["retime", "--reverse"],
    ["retime", "--warp", "sine-in-out"],
    ["trim", "--from", "0.1", "--to", "0.6", "--rebase"],
    ["loop", "--blend", "0.2"],
]
SELECTED = {"Knight.glb": ["--clip", "1H_*"]}


@needs_validator
@pytest.mark.slow
@pytest.mark.parametrize("name", ASSETS)
def test_written_files_are_valid(name: str, call: Call, asset: Find) -> None:
    path = asset(name)
    written = []
    for command in COMMANDS:
        options = [*SELECTED.get(name, []), "-q"]
        written.append(call(command[0], path, "-", *command[1:], *options).product())
    reports = validate_many(written, resources={"l.jpg": _PIXEL})
    for command, report in zip(COMMANDS, reports, strict=True):
        new = [line for line in errors(report) if "IO_ERROR" not in line and "IMAGE" not in line]
        assert new == [], command


def test_a_pipe_of_all(asset: Find, tmp_path: Path) -> None:
    line = (
        f"cat '{asset('Fox.glb')}' | gltf-anim trim --clip Walk --to 0.5 | gltf-anim spline --clip Walk"
        " | gltf-anim ease --clip Walk --per range --ease sine-in-out | gltf-anim retime --clip Walk --ping-pong"
        " | gltf-anim loop --clip Walk"
    )
    run = shell(line, tmp_path)
    assert run.code == 0, run.err
    assert "closed" in run.text


_PIXEL = b"\xff\xd8\xff\xd9"

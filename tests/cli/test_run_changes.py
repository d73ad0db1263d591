"""`run`: files that others change while it works; no later run takes the result for that of other content."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cli.workflows.run import job as jobs
from cli.workflows.run import run as runs
from cli.workflows.run import run_job
from cli.workflows.run.cache import MAX_HASHED_BYTES, FileHashes
from tests.cli.conftest import Call
from tests.cli.running import built
from tests.cli.running_recipes import write_recipe

PLAIN = "resample --fps 12"


def do_after(monkeypatch: pytest.MonkeyPatch, module: Any, name: str, change: Callable[[], None]) -> None:
    """Change files once, when a function of a run is done."""
    function, todo = getattr(module, name), [change]

    def changed(*args: Any, **options: Any) -> Any:
        result = function(*args, **options)
        while todo:
            todo.pop()()
        return result

    monkeypatch.setattr(module, name, changed)


def replace(path: Path, data: bytes) -> None:
    """Exchange a file for one with the same time."""
    stamp, new = path.stat(), path.with_name("new")
    new.write_bytes(data)
    os.utime(new, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    new.replace(path)


@pytest.fixture
def text_file(folder: Path, call: Call) -> Path:
    """A folder with crowd/arm.gltf and its buffer, and the recipe."""
    call("convert", "crowd/arm 1.glb", "crowd/arm.gltf").product()
    write_recipe(folder, PLAIN, match="crowd/*.gltf", out="build/{stem}.glb")
    return folder


def flipped(path: Path) -> bytes:
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    return bytes(data)


@pytest.mark.parametrize("name", ["crowd/arm.bin", "crowd/arm.gltf"])
def test_the_result_of_a_file_that_is_replaced_during_the_steps_is_not_kept(
    name: str, text_file: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = text_file / name
    data = flipped(path) if name.endswith("bin") else path.read_bytes().replace(b'"arm"', b'"leg"')
    do_after(monkeypatch, run_job, "run_steps", lambda: replace(path, data))
    assert "1 file: 1 made" in call("run").err
    old = (text_file / "build/arm.glb").read_bytes()
    assert "1 file: 1 made" in call("run", "--resume").err
    assert "1 file: 1 cached" in call("run").err
    new = (text_file / "build/arm.glb").read_bytes()
    assert (new == call("resample", "crowd/arm.gltf", "--fps", "12").product(), new == old) == (True, False)


def test_the_result_of_a_file_that_is_replaced_while_it_waits_is_not_kept_for_the_old_one(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = folder / "crowd/arm 1.glb"
    before = path.read_bytes()
    write_recipe(folder, PLAIN)
    do_after(monkeypatch, runs, "result_key", lambda: replace(path, built("biped")))
    assert "1 file: 1 made" in call("run").err
    replace(path, before)
    for _ in range(2):
        call("run").product()
        found = (folder / "build/crowd/arm 1.glb").read_bytes()
        assert found == call("resample", "crowd/arm 1.glb", "--fps", "12").product()
        shutil.rmtree(folder / "build")


def test_a_buffer_that_is_replaced_while_a_result_is_looked_up_is_not_resumed(
    text_file: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    call("run").product()
    (text_file / "build/arm.glb").unlink()
    path = text_file / "crowd/arm.bin"
    do_after(monkeypatch, jobs, "write_file", lambda: replace(path, flipped(path)))
    assert "1 file: 1 cached" in call("run").err
    assert "1 file: 1 made" in call("run", "--resume").err


def test_files_without_an_end_have_no_hash(tmp_path: Path) -> None:
    path = tmp_path / "long.glb"
    path.touch()
    os.truncate(path, MAX_HASHED_BYTES + 1)
    for name in (str(path), "/dev/zero", "/proc/self/pagemap"):
        if os.path.exists(name):
            assert FileHashes().hash(name) != FileHashes().hash(name)

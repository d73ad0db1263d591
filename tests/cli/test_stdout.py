"""Stdout takes a product whole, or one line says why not: buffered by Python or not, and whatever it leads to."""

from __future__ import annotations

import io
import os
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from anim.errors import OutputError
from cli.io import stdout
from tests.cli.running import TIMEOUT, help_line, refusal, shell, started
from tests.files import mark_slow

LIMIT = "export PYTHONDONTWRITEBYTECODE=1; ulimit -f"  # kB a file; Python would leave halves of its compiled modules
BUFFERING = ["PYTHONUNBUFFERED=", "PYTHONUNBUFFERED=1"]
PRODUCTS = {
    "convert walk.glb": 100,
    "resample walk.glb --fps 30 -q": 100,
    "sample walk.glb --fps 60 --format csv": 100,
    "sample walk.glb --fps 60 --clip walk --format npz": 10,
    "inspect walk.glb --format json": 1,
    "inspect walk.glb --tracks": 1,
    "optimize walk.glb o.glb --dry-run --report - -q": 1,
    "--help": 1,
    "optimize --help": 1,
}  # and kB that the disk takes of each
PIPED = [*list(PRODUCTS)[:4], "bake walk.glb --clip walk --fps 30 -q"]


@pytest.mark.parametrize("buffering", BUFFERING)
@pytest.mark.parametrize("line", mark_slow(PRODUCTS, slow=list(PRODUCTS)[1::2]))
def test_a_disk_that_takes_a_part_is_said_in_one_line(line: str, buffering: str, walk: Path, tmp_path: Path) -> None:
    run = shell(f"{LIMIT} {PRODUCTS[line]}; {buffering} gltf-anim {line} > product", tmp_path)
    assert refusal(run, 3) == "gltf-anim: stdout: can't be written (file too large)"
    assert (tmp_path / "product").stat().st_size == 1024 * PRODUCTS[line]


@pytest.mark.parametrize("buffering", BUFFERING)
@pytest.mark.parametrize("line", mark_slow(PIPED, slow=PIPED[1:-1]))
def test_a_pipe_that_does_not_block_gets_everything(
    line: str, buffering: str, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As some programs, Node among them, hand it to those that they start."""
    expected = shell(f"gltf-anim {line}", tmp_path).product()
    monkeypatch.setitem(os.environ, *buffering.split("="))
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    command, *rest = line.replace("walk.glb", str(walk)).split()
    run = started(command, *rest, stdout=writing)
    os.close(writing)
    time.sleep(0.5)
    with open(reading, "rb") as pipe:
        assert pipe.read() == expected
    _, err = run.communicate(timeout=TIMEOUT)
    assert (run.returncode, b"can't" in err) == (0, False)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize("buffering", BUFFERING)
@pytest.mark.parametrize("line", ["--help", "--version", "convert --help", "--show-completion"])
def test_what_the_program_says_of_itself_is_a_product_too(line: str, buffering: str, tmp_path: Path) -> None:
    run = shell(f"{buffering} SHELL=/bin/bash gltf-anim {line} > /dev/full", tmp_path)
    assert refusal(run, 3) == "gltf-anim: stdout: can't be written (no space left on device)"


@pytest.mark.parametrize("line", ["--help", "--version", "convert --help"])
def test_closed_stdout_is_said_in_one_line(line: str, tmp_path: Path) -> None:
    assert refusal(shell(f"gltf-anim {line} >&-", tmp_path), 2) == "gltf-anim: stdout is closed"


class Narrow(io.RawIOBase):
    """Takes a few bytes at a time, as Linux takes 2 GiB, and no more than `room` of them."""

    def __init__(self, room: int) -> None:
        self.taken = b""
        self._room = room

    def write(self, data: memoryview) -> int:  # type: ignore[override]
        count = min(7, len(data), self._room - len(self.taken))
        if not count:
            raise OSError(28, "No space left on device")
        self.taken += bytes(data[:count])
        return count


def test_writes_go_on_until_all_is_out(monkeypatch: pytest.MonkeyPatch) -> None:
    narrow = Narrow(100)
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(buffer=narrow, flush=lambda: None))
    stdout.write([b"0123456789" * 5, memoryview(b"abc")])
    assert narrow.taken == b"0123456789" * 5 + b"abc"
    with pytest.raises(OutputError, match=r"stdout: can't be written \(no space left on device\)"):
        stdout.write([bytes(50)])


def test_a_full_folder_for_temporary_files_is_named(walk: Path, tmp_path: Path) -> None:
    """A cache for a pipe is made there first."""
    line = f"TMPDIR='{tmp_path}' gltf-anim bake walk.glb --clip walk --fps 30 > /dev/null"
    shell(line, tmp_path).product()
    assert refusal(shell(f"{LIMIT} 100; {line}", tmp_path), 3).startswith(f"gltf-anim: {tmp_path}/")


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["usdc", "exr"])
def test_room_for_temporary_files_can_end(ending: str, walk: Path, tmp_path: Path) -> None:
    """Of stdin, which is read more than once, and of packages that write only by name."""
    shell("gltf-anim bake walk.glb a.npz --clip walk --fps 30", tmp_path).product()
    run = shell(f"{LIMIT} 4; cat a.npz | gltf-anim convert-cache - out.{ending}", tmp_path)
    assert refusal(run, 3) == "gltf-anim: the temporary file for stdin: can't be written (file too large)"
    assert "TMPDIR" in help_line(run)
    run = shell(f"{LIMIT} 4; gltf-anim convert-cache a.npz out.{ending}", tmp_path)
    where = f"in a temporary file in {tempfile.gettempdir()}"
    assert refusal(run, 3) == f"gltf-anim: out.{ending}: can't be written as .{ending} {where} (file too large)"
    assert "TMPDIR" in help_line(run)
    assert [path.name for path in tmp_path.glob("out*")] == []

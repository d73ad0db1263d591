"""Real processes, shells and files: pipes, signals, terminals, links, modes."""

from __future__ import annotations

import errno
import json
import os
import pty
import select
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Call, Find
from tests.cli.running import ENVIRONMENT, ROOT, TIMEOUT, Run, built, refusal, shell

# The command line, but it stops before it puts its finished temporary file into place.
PAUSED = """
import os, signal, sys, time
from cli import main
def paused(source, target):
    print("paused", file=sys.stderr, flush=True)
    time.sleep(60)
os.replace = paused
signal.signal(signal.SIGINT, signal.default_int_handler)
main.main()
"""


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    path = tmp_path / "walk.glb"
    path.write_bytes(built("biped"))
    return path


def started(*args: str | Path, stdin: int | None = None, stdout: int | None = None) -> subprocess.Popen[bytes]:
    command = [str(Path(sys.executable).parent / "gltf-anim"), *map(str, args)]
    return subprocess.Popen(command, env=ENVIRONMENT, stdin=stdin, stdout=stdout, stderr=subprocess.PIPE)


def test_commands_chain(walk: Path, tmp_path: Path) -> None:
    run = shell("cat walk.glb | gltf-anim resample --fps 30 | gltf-anim inspect --format json", tmp_path)
    (facts,) = run.json["files"]
    assert (run.code, facts["file"]) == (0, "stdin")
    assert {clip["name"]: clip["end_s"] for clip in facts["clips"]} == {
        "walk": 1,
        "wave": 2,
        "jump": pytest.approx(1.6),
    }
    assert run.err.startswith("stdin  271 kB → ")
    assert run.err.count("\n") == 1


def test_real_commands_chain(asset: Find, tmp_path: Path) -> None:
    (tmp_path / "Knight.glb").symlink_to(asset("Knight.glb"))
    run = shell("cat Knight.glb | gltf-anim resample --fps 30 | gltf-anim inspect --format json", tmp_path)
    assert run.code == 0
    assert len(run.json["files"][0]["clips"]) == 76


def test_a_long_chain_gives_what_one_command_after_the_other_gives(walk: Path, tmp_path: Path) -> None:
    line = "gltf-anim convert walk.glb | gltf-anim resample --fps 12 -q | gltf-anim convert - c.gltf"
    chained = shell(f"{line} && gltf-anim convert c.gltf", tmp_path).product()
    line = "gltf-anim resample walk.glb a.glb --fps 12 && gltf-anim convert a.glb b.gltf && gltf-anim convert b.gltf"
    assert shell(line, tmp_path).product() == chained


@pytest.mark.parametrize(
    "command",
    [
        "resample walk.glb --fps 240",
        "convert walk.glb",
        "sample walk.glb --fps 240",
        "sample walk.glb --fps 240 --format csv",
    ],
)
def test_a_reader_that_stops_early_ends_it_quietly(command: str, walk: Path, tmp_path: Path) -> None:
    run = shell(f"gltf-anim {command} | head -c 10 > start; echo ${{PIPESTATUS[0]}}", tmp_path)
    assert len((tmp_path / "start").read_bytes()) == 10
    assert int(run.text) in (0, 128 + signal.SIGPIPE)
    assert "Traceback" not in run.err
    assert "rror" not in run.err


def test_a_writer_that_fails_is_noticed(tmp_path: Path) -> None:
    run = shell("cat nowhere.glb 2>/dev/null | gltf-anim resample --fps 3 | gltf-anim inspect", tmp_path)
    assert run.code == 3
    assert run.err == "gltf-anim: stdin: is empty (expected glTF)\n" * 2


def test_an_input_may_be_its_own_output(walk: Path, tmp_path: Path) -> None:
    expected = shell("gltf-anim resample walk.glb --fps 12", tmp_path).product()
    shell("gltf-anim resample walk.glb walk.glb --fps 12", tmp_path).product()
    assert walk.read_bytes() == expected
    walk.write_bytes(built("biped"))
    shell("cat walk.glb | gltf-anim resample - walk.glb --fps 12", tmp_path).product()
    assert walk.read_bytes() == expected
    assert list(tmp_path.iterdir()) == [walk]


def test_named_pipes_and_substitutions(walk: Path, tmp_path: Path) -> None:
    line = (
        "mkfifo in.pipe out.pipe; cat walk.glb > in.pipe & gltf-anim convert in.pipe out.pipe -q & cat out.pipe; wait"
    )
    data = shell(line, tmp_path).product()
    assert data == shell("gltf-anim convert walk.glb", tmp_path).product()
    assert stat.S_ISFIFO((tmp_path / "out.pipe").stat().st_mode)
    found = shell("gltf-anim inspect <(cat walk.glb) --format json", tmp_path).json["files"][0]
    assert [clip["name"] for clip in found["clips"]] == ["walk", "wave", "jump"]


def test_the_null_device_stays_one(walk: Path, tmp_path: Path) -> None:
    for line in ("gltf-anim convert walk.glb /dev/null", "gltf-anim sample walk.glb --at 0 > /dev/null"):
        assert shell(line, tmp_path).code == 0
        assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize(
    "line", ["convert walk.glb > /dev/full", "inspect walk.glb > /dev/full", "convert walk.glb /dev/full"]
)
def test_a_full_disk_is_said_in_one_line(line: str, walk: Path, tmp_path: Path) -> None:
    assert "can't be written (no space left on device)" in refusal(shell(f"gltf-anim {line}", tmp_path), 2)


def test_closed_stdin_is_said_in_one_line(walk: Path, tmp_path: Path) -> None:
    assert "stdin is closed" in refusal(shell("gltf-anim inspect <&-", tmp_path), 2)


def test_closed_stdout_is_said_in_one_line(walk: Path, tmp_path: Path) -> None:
    assert "stdout is closed" in refusal(shell("gltf-anim inspect walk.glb >&-", tmp_path), 2)


# Files are replaced whole, or not at all.


@pytest.mark.parametrize("before", [None, b"precious"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_a_killed_run_leaves_what_was_there(
    number: signal.Signals, code: int, before: bytes | None, walk: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.glb"
    if before is not None:
        out.write_bytes(before)
    command = [sys.executable, "-c", PAUSED, "convert", str(walk), str(out)]
    run = subprocess.Popen(command, cwd=ROOT, env=ENVIRONMENT, stderr=subprocess.PIPE)
    assert run.stderr is not None
    assert run.stderr.readline() == b"paused\n"
    run.send_signal(number)
    _, err = run.communicate(timeout=TIMEOUT)
    assert run.returncode in (code, -number)  # either way a shell says 128 + the signal's number
    assert b"Traceback" not in err
    assert (out.read_bytes() if out.exists() else None) == before
    others = {path.name for path in tmp_path.iterdir()} - {"walk.glb", "out.glb"}
    if number != signal.SIGKILL:
        assert others == set()
    else:  # nobody can clear up after that, but what is left is hidden and tells whose it was
        assert [name.startswith(".out.glb.") and name.endswith(".tmp") for name in others] == [True]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
@pytest.mark.parametrize("delay", [0.1, 0.4, 0.8])
def test_a_run_killed_at_work_leaves_nothing(number: signal.Signals, delay: float, asset: Find, tmp_path: Path) -> None:
    run = started("resample", asset("Knight.glb"), tmp_path / "out.glb", "--fps", "240")
    time.sleep(delay)
    run.send_signal(number)
    _, err = run.communicate(timeout=TIMEOUT)
    assert run.returncode in (128 + number, -number)
    assert list(tmp_path.iterdir()) == []
    if delay > 0.2:  # before, Python itself may still be starting
        assert err == b""


@pytest.mark.parametrize("fails", ["mkstemp", "write"])
def test_a_text_file_and_its_buffer_change_together(
    fails: str, call: Call, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    call("convert", walk, tmp_path / "out.gltf").product()
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    made: list[str] = []

    def mkstemp(*, prefix: str, suffix: str, dir: Path) -> tuple[int, str]:
        made.append(prefix)
        if len(made) == 2 and fails == "mkstemp":
            raise OSError(errno.ENOSPC, "No space left on device")
        handle, name = real(prefix=prefix, suffix=suffix, dir=dir)
        return (os.open(name, os.O_RDONLY) if len(made) == 2 else handle), name

    real = tempfile.mkstemp
    monkeypatch.setattr(tempfile, "mkstemp", mkstemp)
    run = call("resample", walk, tmp_path / "out.gltf", "--fps", "9")
    assert "out.gltf: can't be written (" in refusal(run, 2)
    assert made == [".out.bin.", ".out.gltf."]
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_ctrl_c_is_130_for_the_shell(walk: Path, tmp_path: Path) -> None:
    script = tmp_path / "paused.py"
    script.write_text(PAUSED)
    line = f"PYTHONPATH='{ROOT}' '{sys.executable}' paused.py convert walk.glb out.glb 2> words & "
    line += "until grep -q paused words; do sleep 0.05; done; kill -INT $!; wait $!; echo $?"
    run = shell(line, tmp_path)
    assert run.text == "130\n"
    assert (tmp_path / "words").read_text() == "paused\n"


@pytest.mark.parametrize("out", ["out.glb", "out.gltf", "out.csv"])
def test_equal_bytes_are_not_written_again(out: str, call: Call, walk: Path, tmp_path: Path) -> None:
    line = (
        ["sample", walk, tmp_path / out, "--at=0"]
        if out == "out.csv"
        else ["resample", walk, tmp_path / out, "--fps=9"]
    )
    call(*line).product()
    before = [path.stat() for path in sorted(tmp_path.iterdir())]
    call(*line).product()
    after = [path.stat() for path in sorted(tmp_path.iterdir())]
    assert [(s.st_ino, s.st_mtime_ns) for s in after] == [(s.st_ino, s.st_mtime_ns) for s in before]
    walk.write_bytes(built("arm"))
    call(*line).product()
    changed = [path.stat().st_mtime_ns for path in sorted(tmp_path.glob("out.*"))]
    assert not set(changed) & {s.st_mtime_ns for s in before}


@pytest.mark.parametrize("mode", [0o640, 0o600, 0o755, 0o664])
def test_mode_bits_are_kept(mode: int, call: Call, walk: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    out.touch()
    out.chmod(mode)
    call("convert", walk, out).product()
    assert out.read_bytes().startswith(b"glTF")
    assert stat.S_IMODE(out.stat().st_mode) == mode


@pytest.mark.parametrize(("mask", "mode"), [("022", 0o644), ("077", 0o600), ("002", 0o664)])
def test_new_files_have_the_mode_that_any_program_gives(mask: str, mode: int, walk: Path, tmp_path: Path) -> None:
    shell(f"umask {mask} && gltf-anim convert walk.glb out.glb", tmp_path).product()
    assert stat.S_IMODE((tmp_path / "out.glb").stat().st_mode) == mode


def test_links_are_written_through(call: Call, walk: Path, tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    real, link, dangling = tmp_path / "real" / "out.glb", tmp_path / "link.glb", tmp_path / "dangling.glb"
    real.write_bytes(b"old")
    link.symlink_to(real)
    dangling.symlink_to("real/new.glb")
    for path in (link, dangling):
        call("convert", walk, path).product()
        assert path.is_symlink()
    assert real.read_bytes() == (tmp_path / "real" / "new.glb").read_bytes() == call("convert", walk).product()
    assert sorted(path.name for path in (tmp_path / "real").iterdir()) == ["new.glb", "out.glb"]


# Terminals.


def at_terminal(run: Callable[[int], subprocess.Popen[bytes]]) -> Run:
    """Run with a terminal; what it wrote there is `out`."""
    master, slave = pty.openpty()
    try:
        process = run(slave)
        _, err = process.communicate(timeout=TIMEOUT)
        out = b""
        while select.select([master], [], [], 0)[0]:
            out += os.read(master, 1 << 16)
        return Run(process.returncode, out, err.decode())
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize(
    "command", [["convert"], ["resample", "--fps=3"], ["sample", "--at=0", "--clip=walk", "--format=npz"]]
)
def test_binary_is_never_written_to_a_terminal(command: list[str], walk: Path) -> None:
    name, *rest = command
    run = at_terminal(lambda slave: started(name, walk, *rest, stdout=slave))
    assert "the output is binary and stdout is a terminal" in refusal(run, 2)
    assert run.err.splitlines()[1] == "help: name an output file, or pipe it on"


def test_text_may_go_to_a_terminal(walk: Path) -> None:
    run = at_terminal(lambda slave: started("inspect", walk, stdout=slave))
    assert (run.code, run.err) == (0, "")
    assert b"walk.glb  271 kB" in run.out
    assert b"\x1b" not in run.out


@pytest.mark.parametrize("command", [["inspect"], ["convert", "-", "/dev/null"]])
def test_a_terminal_is_no_input(command: list[str]) -> None:
    run = at_terminal(lambda slave: started(*command, stdin=slave, stdout=subprocess.DEVNULL))
    assert refusal(run, 2) == "gltf-anim: no input: name a file, or pipe a GLB into stdin"


# The same everywhere.


@pytest.mark.parametrize("locale", ["LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0", "PYTHONIOENCODING=latin-1"])
def test_the_product_is_utf8_in_every_locale(locale: str, walk: Path, tmp_path: Path) -> None:
    for command in ("inspect walk.glb", "sample walk.glb --at 0 --format csv"):
        run = shell(f"{locale} gltf-anim {command}", tmp_path)
        assert run.product() == shell(f"gltf-anim {command}", tmp_path).product()
    assert shell(f"{locale} gltf-anim resample walk.glb --fps 9 | wc -c", tmp_path).code == 0


def test_the_bytes_depend_on_nothing_but_input_and_options(walk: Path, tmp_path: Path) -> None:
    lines = [f"PYTHONHASHSEED={seed} gltf-anim resample walk.glb --fps 9 -q" for seed in (1, 2)]
    first, second = (shell(line, tmp_path).product() for line in lines)
    assert first == second


def test_names_are_taken_as_they_are(walk: Path, tmp_path: Path) -> None:
    name = "é ✓ %20.glb"
    walk.rename(tmp_path / name)
    run = shell(f"gltf-anim inspect '{name}' './-.glb' --format json; gltf-anim convert '{name}' ./-.gltf", tmp_path)
    assert json.loads(run.text)["files"][0]["file"] == name
    assert shell("gltf-anim convert -- ./-.gltf | gltf-anim inspect", tmp_path).code == 0

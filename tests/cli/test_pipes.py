"""Real processes, shells and files: pipes, signals, terminals, links, modes."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import stat
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Find
from tests.cli.running import TIMEOUT, Run, built, refusal, shell, started


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
    "line",
    [
        "convert walk.glb > /dev/full",
        "inspect walk.glb > /dev/full",
        "convert walk.glb /dev/full",
        "bake walk.glb /dev/full --format npz --clip walk --fps 4",
    ],
)
def test_a_full_disk_is_said_in_one_line(line: str, walk: Path, tmp_path: Path) -> None:
    assert "can't be written (no space left on device)" in refusal(shell(f"gltf-anim {line}", tmp_path), 3)


def test_closed_stdin_is_said_in_one_line(walk: Path, tmp_path: Path) -> None:
    assert "stdin is closed" in refusal(shell("gltf-anim inspect <&-", tmp_path), 2)


def test_closed_stdout_is_said_in_one_line(walk: Path, tmp_path: Path) -> None:
    assert "stdout is closed" in refusal(shell("gltf-anim inspect walk.glb >&-", tmp_path), 2)


FAILURES = {
    "resample walk.glb out.glb --fsp 3": 2,
    "convert nowhere.glb out.glb": 3,
    "convert unknown.glb out.glb": 4,
    "trim walk.glb out.glb --clip nothing --to 1": 5,
    "inspect walk.glb -q --fail-on info": 6,
    "convert walk.glb out.glb": 0,
}


@pytest.mark.parametrize("stderr", ["2>&-", "2>/dev/full"])
def test_exit_codes_are_the_same_where_nobody_reads_the_words(stderr: str, walk: Path, tmp_path: Path) -> None:
    walk.write_bytes(built("noop"))
    (tmp_path / "unknown.glb").write_text('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 1}]}')
    line = "; ".join(f"gltf-anim {each} {stderr}; echo $?" for each in FAILURES)
    assert shell(line, tmp_path).text.split() == [str(code) for code in FAILURES.values()]


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

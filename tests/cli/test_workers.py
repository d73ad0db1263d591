"""`optimize` and the processes that it works with: none outlives it, and it waits for none that is gone."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.cli.conftest import Find
from tests.cli.running import TIMEOUT, started
from tests.files import mark_slow

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="asks Linux for a process's children")
CPU_S = 0.5  # after which a process is at work, on a busy machine too


def working(asset: Find, tmp_path: Path) -> tuple[subprocess.Popen[bytes], list[int]]:
    """A run that will take long, and its two processes at work."""
    line = ("optimize", asset("Knight.glb"), tmp_path / "out.glb", "--effort", "max", "--jobs", "2")
    run = started(*line, stdout=subprocess.PIPE)
    end = time.monotonic() + TIMEOUT
    while len(children := _children(run.pid)) < 2 or min(map(_cpu_seconds, children)) < CPU_S:
        assert run.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    return run, children


def _children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def wait_for_the_end(pids: list[int]) -> None:
    """Return when none of the processes runs any more."""
    end = time.monotonic() + TIMEOUT
    while any(_runs(pid) for pid in pids):
        assert time.monotonic() < end
        time.sleep(0.05)


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.parametrize("which", mark_slow([0, 1], slow=[1]))
def test_a_killed_worker_is_one_line_that_names_a_clip(which: int, asset: Find, tmp_path: Path) -> None:
    run, workers = working(asset, tmp_path)
    os.kill(workers[which], signal.SIGKILL)
    _, err = run.communicate(timeout=TIMEOUT)
    assert run.returncode == 4
    first, second = err.decode().splitlines()[-2:]
    assert first.startswith("gltf-anim: ")
    assert "clip '" in first
    assert "ended by the system" in first
    assert second.startswith("help: ")
    wait_for_the_end(workers)
    assert list(tmp_path.iterdir()) == []


SIGNALS = [("TERM", 143), ("HUP", 129), ("INT", 130), ("KILL", -9)]


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), SIGNALS)
def test_nobody_works_on_when_the_command_was_stopped(number: str, code: int, asset: Find, tmp_path: Path) -> None:
    if number != "KILL" and signal.getsignal(signal.Signals[f"SIG{number}"]) is signal.SIG_IGN:
        pytest.skip(f"SIG{number} is ignored here, as under nohup")
    run, workers = working(asset, tmp_path)
    run.send_signal(signal.Signals[f"SIG{number}"])
    _, err = run.communicate(timeout=TIMEOUT)  # until nobody holds stdout and stderr open
    assert run.returncode == code
    assert b"Traceback" not in err
    wait_for_the_end(workers)
    assert list(tmp_path.iterdir()) == []

"""A function in a child process: its messages and errors, its end, and the limit of its memory."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.caches import child_process
from anim.caches.child_process import ChildEndedError, run_in_child
from anim.errors import FormatError, UnsupportedError
from anim.model import FrameChunk, VertexCache
from tests.anim.caches.making import written

GB = 10**9


def squares(count: int) -> Iterator[int]:
    """Yield squares, and print beside them as native packages do."""
    os.write(1, b"printed")
    os.write(2, b"printed")
    yield from (i * i for i in range(count))


def refused() -> Iterator[int]:
    yield 1
    raise FormatError("is none", where="mesh 'a'", help="look")


def crashed() -> Iterator[int]:
    yield 1
    os.abort()


def crashed_with(size: int) -> Iterator[int]:
    yield len(np.ones(size, np.uint8))
    os.abort()


def wrong() -> Iterator[int]:
    yield 1
    raise KeyError("of ours")


def greedy() -> Iterator[int]:
    yield len(np.ones(2 * GB, np.uint8))


def endless(path: str) -> Iterator[int]:
    yield os.getpid()
    Path(path).touch()
    while True:
        pass


def native(path: str) -> Iterator[int]:
    """Like `endless`, in a loop that never lets another thread run."""
    yield os.getpid()
    Path(path).touch()
    sum(itertools.repeat(0))


def modules() -> Iterator[list[str]]:
    yield sys.path


def taken(function: Any, *arguments: Any) -> list[Any]:
    with run_in_child(function, *arguments, limit_bytes=GB) as messages:
        return list(messages)


def test_messages_come_in_order_without_what_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    assert taken(squares, 3) == [0, 1, 4]
    assert capfd.readouterr() == ("", "")
    assert taken(modules) == [sys.path]


def test_errors_of_ours_pass() -> None:
    with pytest.raises(FormatError) as caught:
        taken(refused)
    assert (str(caught.value), caught.value.help) == ("mesh 'a': is none", "look")
    assert caught.value.__notes__ == ["help: look"]


def test_a_child_that_ends_is_an_error() -> None:
    with pytest.raises(ChildEndedError):
        taken(crashed)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell the memory of a child")
def test_a_child_that_ends_tells_its_memory() -> None:
    """The figure of a child starts with that of its parent, so only a larger one is its own."""
    resource = pytest.importorskip("resource")
    own = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peaks = []
    for size in (1, own + GB // 5):
        with pytest.raises(ChildEndedError) as caught, run_in_child(crashed_with, size, limit_bytes=own + GB) as each:
            list(each)
        peaks.append(caught.value.peak_bytes)
    assert peaks[0] == 0
    assert own + GB // 5 < peaks[1] < own + GB


def test_other_errors_have_their_traceback() -> None:
    with pytest.raises(RuntimeError, match="KeyError: 'of ours'"):
        taken(wrong)


def test_where_no_python_can_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "")
    with pytest.raises(UnsupportedError, match="interpreter"):
        taken(modules)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has this limit")
def test_memory_has_a_limit() -> None:
    with pytest.raises(MemoryError):
        taken(greedy)


PARENT = """
import sys
from anim.caches import child_process
from anim.caches.child_process import run_in_child
from tests.anim.caches import test_child_process
with run_in_child(getattr(test_child_process, sys.argv[1]), sys.argv[2], limit_bytes=10**9) as messages:
    print(next(messages), flush=True)
    sys.stdin.read()
"""


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are found in /proc")
@pytest.mark.parametrize("work", ["endless", "native"])
def test_the_child_ends_with_a_parent_that_is_killed(work: str, tmp_path: Path) -> None:
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT, work, str(tmp_path / "a")],
        cwd=Path(__file__).parents[3],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    wait_until((tmp_path / "a").exists)
    parent.kill()
    parent.communicate()
    wait_until(lambda: not is_running(child))


ENDING = """
import signal
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
from anim.caches import child_process
from anim.caches.child_process import ChildEndedError, run_in_child
from tests.anim.caches import test_child_process
try:
    with run_in_child(test_child_process.crashed, limit_bytes=10**9) as messages:
        list(messages)
except ChildEndedError as error:
    print("ended", error.peak_bytes)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGCHLD"), reason="a signal of POSIX")
def test_a_child_ends_where_its_signal_is_ignored() -> None:
    """Programs that ignore it hand that down to what they start; nobody can wait for children there."""
    run = subprocess.run(
        [sys.executable, "-c", ENDING], cwd=Path(__file__).parents[3], capture_output=True, text=True, timeout=120
    )
    assert (run.stdout, run.stderr) == ("ended 0\n", "")


@pytest.mark.skipif(not hasattr(os, "WNOWAIT"), reason="waits of POSIX")
def test_a_child_that_another_has_waited_for_tells_no_memory() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    os.waitpid(process.pid, 0)
    assert child_process._peak_bytes(process) == 0
    assert process.wait() == 0


def wait_until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 120
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def is_running(number: int) -> bool:
    """Return whether a process works: one that nobody has waited for doesn't."""
    try:
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state not in "ZX"


@pytest.mark.skipif(os.name != "posix", reason="signal 0")
def test_the_child_ends_with_the_block(tmp_path: Path) -> None:
    with run_in_child(endless, str(tmp_path / "a"), limit_bytes=GB) as messages:
        child = next(messages)
        os.kill(child, 0)
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


@pytest.mark.parametrize("ending", ["usdc", "abc"])
def test_errors_of_ours_are_not_taken_for_a_full_folder(ending: str) -> None:
    """As of a child that reads the frames while a package writes them."""
    pytest.importorskip({"usdc": "pxr", "abc": "alembic3d"}[ending])

    def frames() -> Iterator[FrameChunk]:
        raise RuntimeError("of ours")
        yield

    cache = VertexCache(np.arange(2.0), 3, np.array([[0, 1, 2]]), frames)
    with pytest.raises(RuntimeError, match="of ours"):
        written(cache, f"a.{ending}")

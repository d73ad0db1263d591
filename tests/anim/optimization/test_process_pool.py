"""Work in processes: the same results in the same order, however many there are."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pytest

from anim.optimization import process_pool as module
from anim.optimization.process_pool import ProcessPool, process_pool


def _product(shared: int, task: int) -> tuple[int, int]:
    return shared * task, os.getpid()


def _refused(shared: int, task: int) -> int:
    if task == 2:
        raise ValueError(f"task {task}")
    return task


def test_one_process_is_this_one() -> None:
    with process_pool(1, 10) as workforce:
        found = list(workforce.each(_product, range(4), label=str))
    assert found == [(10 * i, os.getpid()) for i in range(4)]


def test_two_processes_keep_the_order() -> None:
    with process_pool(2, 10) as workforce:
        found = list(workforce.each(_product, range(6), label=str))
        again = list(workforce.each(_product, [7], label=str))  # on the same processes
    assert [product for product, _ in [*found, *again]] == [0, 10, 20, 30, 40, 50, 70]
    assert os.getpid() not in {number for _, number in found}


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_is_the_callers(workers: int) -> None:
    with process_pool(workers, 0) as workforce, pytest.raises(ValueError, match="task 2"):
        list(workforce.each(_refused, range(5), label=str))


def test_none_where_there_is_nothing_to_do() -> None:
    with process_pool(0, None) as workforce:
        assert list(workforce.each(_product, [], label=str)) == []


UNGUARDED = """
from anim.errors import AnimError
from anim.optimization.process_pool import process_pool

def size(shared, task):
    return len(shared) + task

try:
    with process_pool(2, bytes(1_000_000)) as pool:
        print(list(pool.each(size, [1, 2], label=str)))
except AnimError as error:
    print(error, error.help)
"""


def test_a_script_without_a_main_guard_gets_an_error_that_names_it(tmp_path: Path) -> None:
    """It waited for ever: a process that had ended never read the megabyte that was sent to it."""
    script = tmp_path / "unguarded.py"
    script.write_text(UNGUARDED)
    run = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    assert "ended at their start" in run.stdout
    assert '`if __name__ == "__main__":`' in run.stdout


def _killed(shared: None, task: bytes) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


LARGE_KILLED = """
from anim.errors import AnimError
from anim.optimization.process_pool import process_pool
from tests.anim.optimization.test_process_pool import _killed

if __name__ == "__main__":
    try:
        with process_pool(2, None) as pool:
            list(pool.each(_killed, [bytes(1_000_000)] * 8, label=lambda task: "clip"))
    except AnimError as error:
        print(error)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_killed_processes_leave_no_pipe_that_waits(tmp_path: Path) -> None:
    """With Python 3.11.2, the thread that sent the next megabyte waited for a reader for ever."""
    script = tmp_path / "killed.py"
    script.write_text(LARGE_KILLED)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, env=environment)
    assert "ended by the system" in run.stdout, run.stderr


def test_what_goes_through_pipes_is_small(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A process that is killed while it sends a large result would stop all others, and the parent with them."""
    monkeypatch.setattr(module, "_run_in_worker", [bytes(1_000_000)])
    sizes: list[int] = []

    class Pipes(_Serial):
        def submit(self, function: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
            future = super().submit(function, *given, **named)
            sizes.append(max(len(pickle.dumps((function, given, named))), len(pickle.dumps(future.result()))))
            return future

    pool = ProcessPool(Pipes(), bytes(1_000_000), tmp_path)
    found = list(pool.each(_joined, [bytes(1_000_000)] * 3, label=str))
    assert [len(each) for each in found] == [2_000_000] * 3
    assert len(sizes) == 4
    assert max(sizes) < 4096
    assert not list(tmp_path.iterdir())  # files are removed as they are read


def _joined(shared: bytes, task: bytes) -> bytes:
    return shared + task


class _Serial(Executor):
    """Runs at once what is submitted."""

    def submit(self, function: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(function(*given, **named))
        return future


def test_the_most_work_starts_first_and_results_keep_the_order(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    started: list[int] = []
    monkeypatch.setattr(module, "_run_in_worker", [None])
    pool = ProcessPool(_Serial(), None, tmp_path)

    def run(_: object, task: int) -> int:
        started.append(task)
        return task

    found = list(pool.each(run, [2, 0, 3, 1], label=str, work=float))
    assert (started, found) == ([3, 2, 1, 0], [2, 0, 3, 1])


def test_one_process_imports_no_multiprocessing() -> None:
    code = "import sys, anim.optimization.optimize; sys.exit('concurrent.futures.process' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0

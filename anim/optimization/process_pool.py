"""A process pool for work on many clips; results keep the order of tasks for any number of processes.

Workers read the shared value from a temporary file: sent as an argument of a process, a value larger than the buffer of
a pipe would block the parent for ever if the process ends before it reads.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from anim.errors import UnsupportedError, not_written

if TYPE_CHECKING:  # several modules of the standard library, which one process does not need
    from concurrent.futures import Executor, Future

    from anim.worker_processes import Lifeline

Result = TypeVar("Result")


class ProcessPool:
    """Runs one function on many arguments; `shared` is passed to every process once."""

    def __init__(self, pool: Executor | None, shared: Any) -> None:
        self._pool, self._shared = pool, shared
        self._started: Future[None] | None = None  # done once a process has started

    def each(
        self,
        function: Callable[[Any, Any], Result],
        tasks: Sequence[Any],
        *,
        label: Callable[[Any], str],
        work: Callable[[Any], float] = lambda _: 0.0,
    ) -> Iterator[Result]:
        """Yield function(shared, task) for every task, in order; tasks with the most work start first.

        label: name of a task for errors. work: estimate, in any unit. Raises UnsupportedError if a process ended before
        its work did, as the system ends one when memory runs out, or at its start.
        """
        if self._pool is None or not tasks:
            yield from (function(self._shared, task) for task in tasks)
            return
        from concurrent.futures.process import BrokenProcessPool

        try:
            self._started = self._started or self._pool.submit(_start)
            order = sorted(range(len(tasks)), key=lambda i: -work(tasks[i]))
            futures = {i: self._pool.submit(_run, function, tasks[i]) for i in order}
        except BrokenProcessPool:
            raise self._broken(label(tasks[0])) from None
        for i, task in enumerate(tasks):
            try:
                result = futures[i].result()
            except BrokenProcessPool:
                raise self._broken(label(task)) from None
            yield result

    def _broken(self, name: str) -> UnsupportedError:
        """The error for a process that ended before its work on the task `name`, or on a later one."""
        if self._started is None or self._started.exception() is not None:
            return UnsupportedError(
                "the processes of `workers` ended at their start",
                help='a script with more than one calls its functions under `if __name__ == "__main__":`',
            )
        return UnsupportedError(
            f"{name}: a process that worked on it, or on one of the next clips, was ended by the system",
            help="if memory ran out, `workers` 1 needs the least",
        )


@contextmanager
def process_pool(workers: int, shared: Any, *, start: str = "spawn") -> Iterator[ProcessPool]:
    """Provide a pool of `workers` processes; for one, the work runs in this process.

    start: "spawn" for fresh processes, for which callers guard their main module as `multiprocessing` requires; "fork"
    for copies of this one, quicker, if no other thread runs. All inherit the environment: `cli.main` has set
    OPENBLAS_NUM_THREADS to 1 in it, so that each process uses one core.
    """
    if workers <= 1:
        yield ProcessPool(None, shared)
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    from anim.worker_processes import open_lifeline

    context = multiprocessing.get_context(start)
    with _as_file(shared) as path, ExitStack() as stack:
        lifeline = stack.enter_context(open_lifeline(context, start))
        pool = ProcessPoolExecutor(workers, context, _set_up, (path, lifeline))
        try:
            yield ProcessPool(pool, shared)
            pool.shutdown()
        finally:
            stack.close()  # running workers exit now
            pool.shutdown(cancel_futures=True)  # the pool's thread has ended before the interpreter shuts down


@contextmanager
def _as_file(shared: Any) -> Iterator[str]:
    """Yield the path of a temporary file with the pickled value."""
    import tempfile

    with ExitStack() as stack:
        try:
            path = Path(stack.enter_context(tempfile.TemporaryDirectory()), "shared")
            with path.open("wb") as file:
                pickle.dump(shared, file, pickle.HIGHEST_PROTOCOL)
        except OSError as error:
            raise not_written("temporary file of `workers`", error) from None
        yield str(path)


_run_in_worker: list[Any] = []  # the shared value of a worker process; set once, before its first task


def _set_up(path: str, lifeline: Lifeline) -> None:
    from anim.worker_processes import follow_parent

    follow_parent(lifeline)
    with Path(path).open("rb") as file:
        _run_in_worker[:] = [pickle.load(file)]


def _start() -> None:
    """Do nothing: its result shows that a process has started."""


def _run(function: Callable[[Any, Any], Result], task: Any) -> Result:
    return function(_run_in_worker[0], task)

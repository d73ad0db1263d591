"""A process pool for work on many clips; results keep the order of tasks for any number of processes.

The shared value, tasks and results are passed as temporary files, not through the pipes of the processes: what is
larger than the buffer of a pipe would block the parent for ever if a process is killed before it has read or written
all of it (https://github.com/python/cpython/issues/94777).
"""

from __future__ import annotations

import itertools
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
SHARED = "shared"  # name of the file
TEMPORARY = "temporary file of `workers`"


class ProcessPool:
    """Runs one function on many arguments; `shared` is passed to every process once.

    folder: for temporary files of tasks and results, if there is a pool.
    """

    def __init__(self, pool: Executor | None, shared: Any, folder: Path = Path()) -> None:
        self._pool, self._shared, self._folder = pool, shared, folder
        self._numbers = itertools.count()  # of temporary files
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
        its work did, as the system ends one when memory runs out, or at its start; OutputError if a temporary file
        can't be written.
        """
        if self._pool is None or not tasks:
            yield from (function(self._shared, task) for task in tasks)
            return
        from concurrent.futures.process import BrokenProcessPool

        try:
            self._started = self._started or self._pool.submit(_start)
            order = sorted(range(len(tasks)), key=lambda i: -work(tasks[i]))
            futures = {i: self._pool.submit(_run, function, self._write_task(tasks[i])) for i in order}
        except BrokenProcessPool:
            raise self._broken(label(tasks[0])) from None
        for i, task in enumerate(tasks):
            try:
                result = futures[i].result()
            except BrokenProcessPool:
                raise self._broken(label(task)) from None
            yield _take(result)

    def _write_task(self, task: Any) -> Path:
        path = self._folder / f"task{next(self._numbers)}"
        _write(path, task)
        return path

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
    with _temporary_folder() as folder, ExitStack() as stack:
        _write(folder / SHARED, shared)
        lifeline = stack.enter_context(open_lifeline(context, start))
        pool = ProcessPoolExecutor(workers, context, _set_up, (folder / SHARED, lifeline))
        try:
            yield ProcessPool(pool, shared, folder)
            pool.shutdown()
        finally:
            stack.close()  # running workers exit now
            pool.shutdown(cancel_futures=True)  # the pool's thread has ended before the interpreter shuts down


@contextmanager
def _temporary_folder() -> Iterator[Path]:
    import tempfile

    with ExitStack() as stack:
        try:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
        except OSError as error:
            raise not_written(TEMPORARY, error) from None
        yield Path(folder)


def _write(path: Path, value: Any) -> None:
    try:
        with path.open("wb") as file:
            pickle.dump(value, file, pickle.HIGHEST_PROTOCOL)
    except OSError as error:
        raise not_written(TEMPORARY, error) from None


def _take(path: Path) -> Any:
    """Return the value of a file, and remove the file."""
    with path.open("rb") as file:
        value = pickle.load(file)
    path.unlink()
    return value


_run_in_worker: list[Any] = []  # the shared value of a worker process; set once, before its first task


def _set_up(path: Path, lifeline: Lifeline) -> None:
    from anim.worker_processes import follow_parent

    follow_parent(lifeline)
    with path.open("rb") as file:
        _run_in_worker[:] = [pickle.load(file)]


def _start() -> None:
    """Do nothing: its result shows that a process has started."""


def _run(function: Callable[[Any, Any], Any], path: Path) -> Path:
    """Run the task of a file; return the path of its result."""
    result = path.with_suffix(".result")
    _write(result, function(_run_in_worker[0], _take(path)))
    return result

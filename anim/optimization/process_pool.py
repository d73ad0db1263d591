"""Work on many clips at once, in processes; the order of results, and so the output, never depends on how many.

Processes live only as long as this one: each waits on a pipe that nobody writes to and whose other end only this
process holds. However this process ends, the system closes that end, and they are gone.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from anim.errors import UnsupportedError

Result = TypeVar("Result")


class ProcessPool:
    """Runs one function on many arguments. `shared` is handed to every process once."""

    def __init__(self, pool: ProcessPoolExecutor | None, shared: Any) -> None:
        self._pool, self._shared = pool, shared

    def each(
        self, function: Callable[[Any, Any], Result], tasks: Sequence[Any], *, label: Callable[[Any], str]
    ) -> Iterator[Result]:
        """Yield function(shared, task) for every task, in order.

        label: what errors call a task. Raises UnsupportedError where a process ended before its work did, as the system
        ends one where memory runs out.
        """
        if self._pool is None:
            yield from (function(self._shared, task) for task in tasks)
            return
        futures = [self._pool.submit(_run, function, task) for task in tasks]
        for future, task in zip(futures, tasks, strict=True):
            try:
                result = future.result()
            except BrokenProcessPool:
                raise UnsupportedError(
                    f"{label(task)}: a process that worked on it, or on one of the next clips, was ended by the system",
                    help="if memory ran out: --jobs 1 takes least",
                ) from None
            yield result


@contextmanager
def process_pool(workers: int, shared: Any, *, start: str = "spawn") -> Iterator[ProcessPool]:
    """Give a crew of so many processes; of none, in this process, where one is enough.

    start: "spawn" for fresh processes, for which callers guard their main module as `multiprocessing` asks; "fork" for
    copies of this one, quicker, where no other thread runs. All inherit the environment: `cli.main` has set
    OPENBLAS_NUM_THREADS to 1 in it, so that each has a core of its own.
    """
    if workers <= 1:
        yield ProcessPool(None, shared)
        return
    context = multiprocessing.get_context(start)
    lifeline, held = context.Pipe(duplex=False)
    inherited = held if start == "fork" else None  # copies of this process hold the other end too, and close it
    pool = ProcessPoolExecutor(workers, context, _set_up, (shared, lifeline, inherited))
    try:
        yield ProcessPool(pool, shared)
        pool.shutdown()
    finally:
        held.close()  # whoever still works ends now, and nobody waits for it
        pool.shutdown(wait=False, cancel_futures=True)
        lifeline.close()


_run_in_worker: list[Any] = []  # what every task of a worker process works with; set once, before the first


def _set_up(shared: Any, lifeline: Connection, inherited: Connection | None) -> None:
    for stop in (signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else [])):
        signal.signal(stop, signal.SIG_DFL)  # copies of this process have its handlers, and would go on
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches us all; the process that started us says what follows
    if inherited is not None:
        inherited.close()
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
    _run_in_worker[:] = [shared]


def _end_with(lifeline: Connection) -> None:
    """End this process when the other end of the pipe is closed."""
    lifeline.poll(None)
    os._exit(1)


def _run(function: Callable[[Any, Any], Result], task: Any) -> Result:
    return function(_run_in_worker[0], task)

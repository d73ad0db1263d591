"""Work on many clips at once, in processes; the order of results, and so the output, never depends on how many."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

Result = TypeVar("Result")


class Crew:
    """Runs one function on many arguments. `shared` is handed to every process once."""

    def __init__(self, pool: ProcessPoolExecutor | None, shared: Any) -> None:
        self._pool, self._shared = pool, shared

    def each(self, function: Callable[[Any, Any], Result], tasks: Sequence[Any]) -> Iterator[Result]:
        """Yield function(shared, task) for every task, in order."""
        if self._pool is None:
            yield from (function(self._shared, task) for task in tasks)
        else:
            futures = [self._pool.submit(_run, function, task) for task in tasks]
            try:
                yield from (future.result() for future in futures)
            finally:
                for future in futures:
                    future.cancel()


@contextmanager
def crew(workers: int, shared: Any, *, start: str = "spawn") -> Iterator[Crew]:
    """Give a crew of so many processes; of none, in this process, where one is enough.

    start: "spawn" for fresh processes, for which callers guard their main module as `multiprocessing` asks; "fork" for
    copies of this one, quicker, where no other thread runs. All inherit the environment: `cli.main` has set
    OPENBLAS_NUM_THREADS to 1 in it, so that each has a core of its own.
    """
    if workers <= 1:
        yield Crew(None, shared)
        return
    context = multiprocessing.get_context(start)
    with ProcessPoolExecutor(workers, context, _set_up, (shared,)) as pool:
        yield Crew(pool, shared)


_of_this_process: list[Any] = []  # what every task of a worker process works with; set once, before the first


def _set_up(shared: Any) -> None:
    _of_this_process[:] = [shared]


def _run(function: Callable[[Any, Any], Result], task: Any) -> Result:
    return function(_of_this_process[0], task)

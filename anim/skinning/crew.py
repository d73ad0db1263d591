"""Threads that share work with whoever waits for it."""

from __future__ import annotations

import atexit
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Thread, current_thread
from types import TracebackType
from typing import Any, Self, TypeAlias, TypeVar
from weakref import WeakSet

Result = TypeVar("Result")
Task: TypeAlias = "tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]"


class Crew:
    """Up to `size` threads, the one that waits for results included: it works meanwhile. Tasks are begun in order.

    Cores are all busy then, and none has to stop for a thread that only passes things on (a tenth of a short bake's
    time, measured against a pool). Threads start when there is work for them. Leaving the context drops what nobody has
    begun.
    """

    def __init__(self, size: int) -> None:
        self._tasks: SimpleQueue[Task | None] = SimpleQueue()
        self._others: list[Thread] = []
        self._most = size - 1

    def __enter__(self) -> Self:
        _at_work.add(self)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.stop()
        _at_work.discard(self)

    def submit(self, call: Callable[..., Result], *arguments: Any) -> Future[Result]:
        """Have a call made, sooner or later, by anyone."""
        future: Future[Result] = Future()
        self._tasks.put((future, call, arguments))
        if self._tasks.qsize() > 1 and len(self._others) < self._most:  # one can be left to whoever waits
            self._start()
        return future

    def result(self, future: Future[Result]) -> Result:
        """Return what a call returned, or raise what it raised; until then do what is to be done."""
        while not future.done() and self._do_next(block=False):
            pass
        return future.result()

    def stop(self) -> None:
        """Drop what nobody has begun, and wait for the rest."""
        with suppress(Empty):
            while True:
                self._tasks.get_nowait()
        for _ in self._others:
            self._tasks.put(None)
        for thread in self._others:
            if thread.is_alive() and thread is not current_thread():
                thread.join()

    def _start(self) -> None:
        thread = Thread(target=self._work, name="gltf-anim", daemon=True)
        self._others.append(thread)
        try:
            thread.start()
        except RuntimeError:  # the system has no more: those that are there do it
            self._others.remove(thread)
            self._most = len(self._others)

    def _work(self) -> None:
        while self._do_next(block=True):
            pass

    def _do_next(self, *, block: bool) -> bool:
        """Do one task, and forget it, with all that it holds; return whether there was one."""
        try:
            task = self._tasks.get(block)
        except Empty:
            return False
        if task is not None:
            _do(*task)
        return task is not None


_at_work: WeakSet[Crew] = WeakSet()


@atexit.register
def _stop_all() -> None:
    """Stop the threads of generators that nobody has finished: later, when these are closed, none can end any more."""
    for crew in list(_at_work):
        crew.stop()


def _do(future: Future[Any], call: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    try:
        result = call(*arguments)
    except BaseException as error:
        future.set_exception(error)
        if not isinstance(error, Exception):  # an interrupt is meant for whoever works here
            raise
    else:
        future.set_result(result)

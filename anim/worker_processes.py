"""Worker processes that live only as long as their parent.

Each waits on a pipe without any writer, whose other end only the parent holds open. The system closes that end when the
parent exits, however it does, and the workers exit too.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext

POLL_S = 0.01


@dataclass(frozen=True)
class Lifeline:
    """The worker's end of the pipe, and the parent's end that a forked copy has inherited and must close."""

    end: Connection
    inherited: Connection | None


@contextmanager
def open_lifeline(context: BaseContext, start: str) -> Iterator[Lifeline]:
    """Provide the pipe for the workers of this process; at the end of the block they exit. start: "fork" or "spawn"."""
    lifeline, parent_end = context.Pipe(duplex=False)
    try:
        yield Lifeline(lifeline, parent_end if start == "fork" else None)
    finally:
        parent_end.close()
        lifeline.close()


def follow_parent(lifeline: Lifeline, *, busy: threading.Event | None = None, max_wait_s: float = 0.0) -> None:
    """Set up a worker: it ignores Ctrl-C, which the parent handles, and exits when the parent does.

    busy: set while work runs. The work is then ended by SystemExit, so that it removes its temporary files, before the
    process exits after at most `max_wait_s`.
    """
    for stop in (signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else [])):
        signal.signal(stop, signal.SIG_DFL)  # forked copies inherit handlers, and would not exit
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if lifeline.inherited is not None:
        lifeline.inherited.close()
    if busy is not None:
        signal.signal(signal.SIGTERM, lambda number, frame: _exit(number, busy))
    threading.Thread(target=_end_with, args=(lifeline.end, busy, max_wait_s), daemon=True).start()


def _end_with(lifeline: Connection, busy: threading.Event | None, max_wait_s: float) -> None:
    """Exit this process when the other end of the pipe is closed."""
    lifeline.poll(None)
    if busy is not None and busy.is_set():
        os.kill(os.getpid(), signal.SIGTERM)
        end = time.monotonic() + max_wait_s
        while busy.is_set() and time.monotonic() < end:
            time.sleep(POLL_S)
    os._exit(1)


def _exit(number: int, busy: threading.Event) -> None:
    """Exit by SystemExit while work runs, else at once.

    Between jobs a worker may wait for the lock of the result queue, which another one held when it was killed. The pool
    would catch SystemExit there and wait again, for ever.
    """
    if not busy.is_set():
        os._exit(128 + number)
    raise SystemExit(128 + number)

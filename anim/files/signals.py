"""Signals deferred during critical file operations, and broken pipes as errors."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

STOPS = tuple(signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def hold_signals() -> Iterator[None]:
    """Defer termination signals until the end of the block.

    Only the main thread can, and only it receives them. They take effect after an error of the block, too.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    usual: dict[signal.Signals, Any] = {}
    try:
        for each in STOPS:
            usual[each] = signal.signal(each, lambda number, _: came.append(number))
        yield
    finally:
        for each, handler in usual.items():
            signal.signal(each, handler)
        for number in came:  # the first may be one that is ignored
            signal.raise_signal(number)


@contextmanager
def ignore_broken_pipes() -> Iterator[None]:
    """Ignore SIGPIPE inside: `concurrent.futures` handles writes to ended workers itself.

    After an error its thread may still write, so the signal then stays ignored. Only the main thread can.
    """
    if not hasattr(signal, "SIGPIPE") or threading.current_thread() is not threading.main_thread():
        yield
        return
    usual = signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGPIPE, usual)

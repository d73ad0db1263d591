"""Libraries that are loaded whole: some of them swallow an interrupt that comes meanwhile."""

from __future__ import annotations

import importlib
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

STOPS = tuple(signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def load(name: str) -> None:
    """Import a module if it is installed, "" for none; an interrupt takes effect when it is there."""
    if name:
        with signals_held(), suppress(ImportError):
            importlib.import_module(name)


@contextmanager
def signals_held() -> Iterator[None]:
    """Keep signals that stop us until the end. Only the main thread can, and only it gets them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    usual = {each: signal.signal(each, lambda number, _: came.append(number)) for each in STOPS}
    try:
        yield
    finally:
        for each, handler in usual.items():
            signal.signal(each, handler)
    if came:
        signal.raise_signal(came[0])

"""Signals that end the program: handlers that let temporary files be removed."""

from __future__ import annotations

import signal
import sys
from types import FrameType

HANDLED = tuple(signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def install_handlers() -> list[int]:
    """Let signals raise KeyboardInterrupt or SystemExit; return a list that receives their numbers.

    A library may discard an exception that is raised inside it; the list tells that the program has to end.
    """
    received: list[int] = []

    def end(number: int, _: FrameType | None) -> None:
        received.append(number)
        sys.unraisablehook = lambda _: None  # "Exception ignored in …", of a destructor or a callback
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        sys.exit(128 + number)

    for each in HANDLED:
        if signal.getsignal(each) is not signal.SIG_IGN:  # as under nohup
            signal.signal(each, end)
    return received

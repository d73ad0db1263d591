"""Progress of long work on stderr, if that is a terminal: a bar, and a line while kernels compile."""

from __future__ import annotations

import sys
import time

from cli.streams import step_streams
from cli.text import Reporter

DELAY_S = 1.0  # s, before the bar is shown
UPDATE_INTERVAL_S = 0.1  # s, between two updates
WIDTH_CHARACTERS = 30  # characters


class Progress:
    """Progress bar of a job: progress(done) is called repeatedly, `close` at the end.

    words: name of the work. total: value of `done` at the end. shown: False for no bar.
    """

    def __init__(self, words: str, total: int, *, shown: bool = True) -> None:
        self._words, self._total = words, max(total, 1)
        self._shown = shown and step_streams() is None and sys.stderr is not None and sys.stderr.isatty()
        self._began = self._drawn = time.monotonic()
        self._length = 0

    def __call__(self, done: int, words: str = "") -> None:
        """Draw the bar if an update is due. words: the work from now on."""
        self._words = words or self._words
        now = time.monotonic()
        if not self._shown or now - self._began < DELAY_S or now - self._drawn < UPDATE_INTERVAL_S:
            return
        self._drawn = now
        share = min(done / self._total, 1.0)
        filled = round(share * WIDTH_CHARACTERS)
        left = (now - self._began) * (1 - share) / share if share else 0.0
        bar = "█" * filled + "░" * (WIDTH_CHARACTERS - filled)
        line = f"{self._words} {bar} {100 * share:3.0f} %, {left:.0f} s left"
        sys.stderr.write("\r" + line.ljust(self._length))
        sys.stderr.flush()
        self._length = len(line)

    def close(self) -> None:
        """Erase the bar."""
        if self._length:
            sys.stderr.write("\r" + " " * self._length + "\r")
            sys.stderr.flush()
            self._length = 0


def announce_compiling(reporter: Reporter) -> None:
    """Report the compilation of kernels to a terminal if the user's cache folder has none yet."""
    if reporter.quiet or step_streams() is not None or sys.stderr is None or not sys.stderr.isatty():
        return
    from anim.skinning.kernels.jit import is_compiled

    if not is_compiled():
        reporter.info("compiling kernels (first run only)")

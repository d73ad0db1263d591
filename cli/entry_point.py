"""Entry point of the program: signals end it silently while its modules are imported, and nothing is collected."""

from __future__ import annotations

import gc
import signal

for _each in (signal.SIGINT, signal.SIGTERM):
    if signal.getsignal(_each) is not signal.SIG_IGN:  # as under nohup
        # Nothing is written yet; Python's own handlers would print a traceback, or be lost within an import.
        signal.signal(_each, signal.SIG_DFL)


def main() -> None:
    """Run the command line of this process and exit with its exit code."""
    gc.disable()  # one short job over many long-lived objects: collection only costs time
    from cli.main import main as run

    run()

"""python -m tests.cli.killing HOW BEFORE OUT ARGUMENT …: one command line, stopped before each of its file operations.

HOW: KILL, TERM or INT for the signal, ERROR for an OSError of the operation itself. OUT/0, OUT/1, … are copies of the
folder BEFORE, in each of which a run was stopped at its operation of this number; the last one ran to its end.
"""

from __future__ import annotations

import errno
import os
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

from cli import main

EVENTS = {"open", "os.rename", "os.link", "os.remove", "os.chmod", "os.utime"}  # of sys.audit, raised before the call
MAX_OPERATIONS = 1000


def stop_everywhere(how: str, before: Path, out: Path, arguments: list[str]) -> None:
    """Run the command line in a copy of the folder for each operation to stop at, until one comes to its end."""
    warm = shutil.copytree(before, out / "warm")
    os.chdir(warm)
    main.run(arguments)  # all is imported now
    os.chdir(out)
    shutil.rmtree(warm)
    for number in range(MAX_OPERATIONS):
        folder = shutil.copytree(before, out / str(number))
        child = os.fork()
        if child == 0:
            _run(how, number, folder, arguments)
        _, status = os.waitpid(child, 0)
        if os.waitstatus_to_exitcode(status) == 0:
            return
    raise AssertionError("no end")


def _run(how: str, number: int, folder: Path, arguments: list[str]) -> None:
    """Never returns."""
    os.chdir(folder)
    os.dup2(os.open(os.devnull, os.O_RDWR), 2)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    signal.signal(signal.SIGINT, signal.default_int_handler)
    left = number
    stopped = False

    def hook(event: str, details: tuple[Any, ...]) -> None:
        nonlocal left, stopped
        if stopped or event not in EVENTS or not any(_is_in(each, folder) for each in details[:2]):
            return
        if left == 0:
            stopped = True
            if how == "ERROR":
                raise OSError(errno.ENOSPC, "No space left on device")
            os.kill(os.getpid(), signal.Signals[f"SIG{how}"])
        left -= 1

    sys.addaudithook(hook)
    code = 1
    try:
        code = main.run(arguments)
    finally:
        os._exit(1 if stopped else code)


def _is_in(path: object, folder: Path) -> bool:
    """Relative paths are inside: the run works in the folder."""
    if not isinstance(path, (str, Path)):
        return False
    return str(path).startswith(str(folder)) or not os.path.isabs(path)


if __name__ == "__main__":
    stop_everywhere(sys.argv[1], Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve(), sys.argv[4:])

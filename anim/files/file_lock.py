"""A lock of an open file, by which others see that it is in use; nobody waits for it.

It leaves no file, and ends with the processes that have the file open. Where the system has none, no file is in use.
"""

from __future__ import annotations

import io
from contextlib import suppress


def lock(file: io.FileIO) -> None:
    """Lock an open file until it is closed."""
    with suppress(ImportError, OSError):  # Windows; a file system without locks
        import fcntl

        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)


def is_locked(file: io.BufferedReader) -> bool:
    """Return whether another has locked a file, which is to be closed after that: this locks it if nobody has."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (ImportError, OSError):
        pass
    return False

"""A lock of a folder, for sets of files that are related only by their names."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MAX_LOCK_WAIT_S = 5.0  # a lock held by a script (`flock FOLDER gltf-anim …`) would block forever
LOCK_POLL_S = 0.005


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Lock a folder against concurrent changes of file sets, if the system supports it.

    The lock leaves no file and ends with the process. After 5 s the block runs without it.
    """
    try:
        import fcntl

        handle = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        yield
        return
    try:
        end = time.monotonic() + MAX_LOCK_WAIT_S
        while time.monotonic() < end:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(LOCK_POLL_S)
            except OSError:  # a file system without locks
                break
        yield
    finally:
        os.close(handle)

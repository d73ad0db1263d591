"""Temporary files for packages that write and read only by path (usd-core, OpenEXR)."""

from __future__ import annotations

import errno
import io
import math
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

from anim.caches.storage import COPY_BYTES, Inputs, Outputs
from anim.errors import OutputError, not_written
from anim.files import resolver
from anim.memory import limit_for

ADVICE = "TMPDIR names another folder for it"


@contextmanager
def temporary_folder() -> Iterator[str]:
    """Yield a new folder for temporary files. Raises OutputError where the system has no room for one."""
    try:
        made = tempfile.TemporaryDirectory()
    except OSError as error:
        raise not_written("a temporary folder", error).advise(ADVICE) from None
    with made as folder:
        yield folder


@contextmanager
def temp_output(
    outputs: Outputs, name: str, ending: str, *, failures: tuple[type[Exception], ...] = ()
) -> Iterator[str]:
    """Yield a path of this extension to write to; its content becomes the output `name`.

    failures: errors of the package that writes there, which become an OutputError.
    """
    with temporary_folder() as folder:
        path = Path(folder) / f"output{ending}"
        try:
            yield str(path)
        except failures as failure:
            why = _system_reason(str(failure)) or "is there room?"
            where = f"as {ending} in a temporary file in {tempfile.gettempdir()}"
            help = "TMPDIR names another folder for temporary files"
            raise OutputError(f"{name}: can't be written {where} ({why})", help=help) from None
        with path.open("rb") as source, outputs.create(name) as target:
            shutil.copyfileobj(source, target, COPY_BYTES)


def _system_reason(words: str) -> str:
    """The system's reason among the words of a package, which are on many lines and name its own sources; or ""."""
    reasons = (os.strerror(number) for number in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO, errno.EROFS))
    return next((reason.lower() for reason in reasons if reason in words), "")


def check_free_space(size: int, name: str) -> None:
    """Raise OutputError unless `size` bytes fit beside the other temporary files: for packages that abort if not."""
    folder = tempfile.gettempdir()
    free = min(shutil.disk_usage(folder).free, _max_file_size())
    if size > free:
        raise OutputError(
            f"{name}: its {size} bytes don't fit in {folder} ({free} free)", help="TMPDIR names another folder"
        )


def _max_file_size() -> float:
    """The largest file that this process may write (`ulimit -f`), in bytes; infinity without a limit."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return math.inf
    most, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    return math.inf if most == resource.RLIM_INFINITY else most


@contextmanager
def temp_input(inputs: Inputs, name: str, ending: str) -> Iterator[str]:
    """Yield a path from which the bytes of an input can be read."""
    with temporary_folder() as folder:
        path = Path(folder) / f"input{ending}"
        with inputs.open(name) as source:
            try:
                with path.open("wb") as target:
                    target.writelines(resolver.read_blocks(source, limit_for(0), block=COPY_BYTES))
            except OSError as error:
                raise not_written("a temporary file", error).advise(ADVICE) from None
        yield str(path)


@contextmanager
def silence_native() -> Iterator[None]:
    """Suppress printed messages of native packages; errors are reported in one line instead."""
    try:
        kept = os.dup(2)
    except OSError:  # stderr is closed
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)

"""A function that runs in a process of its own, since a native package may crash, hang or print on a hostile file.

The child ends with the block that reads from it, so that a signal to this process is heard while native code runs. It
also ends with this process, however that ends: it waits for the end of its stdin, which this process holds open.
"""

from __future__ import annotations

import errno
import os
import pickle
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import IO, Any

from anim.errors import AnimError, UnsupportedError
from anim.memory import limit_allocations

# The child has this process's path of modules and no other: `-I` leaves out the current folder and $PYTHONPATH.
PROGRAM = "import sys; sys.path[:] = sys.argv[1:]; from anim.caches import child_process; child_process.serve()"


class ChildEndedError(Exception):
    """The child ended before its work did: native code has crashed, or the system ended it.

    peak_bytes: most memory that it had, 0 if unknown.
    """

    def __init__(self, peak_bytes: int = 0) -> None:
        super().__init__()
        self.peak_bytes = peak_bytes


@contextmanager
def run_in_child(function: Callable[..., Iterator[Any]], *arguments: Any, limit_bytes: int) -> Iterator[Iterator[Any]]:
    """Provide what a generator function yields in a child process; function and arguments as for `pickle`.

    limit_bytes: of memory that it may allocate (on Linux). Reading raises the function's AnimError or MemoryError,
    RuntimeError with the traceback of any other error, and ChildEndedError if the child ends without one. At the end of
    the block the child is ended. Raises UnsupportedError where no Python can be started (a program that embeds it).
    """
    task = pickle.dumps((function, arguments, limit_bytes))
    if not sys.executable or getattr(sys, "frozen", False):
        raise UnsupportedError(
            "it is read by a process of its own, which needs a Python interpreter that can be started"
        )
    process = subprocess.Popen(
        [sys.executable, "-I", "-c", PROGRAM, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    with process.stdout:
        try:
            _send(process.stdin, task)
            yield _messages(process, process.stdout)
        finally:
            process.kill()
            process.wait()
            with suppress(OSError):
                process.stdin.close()


def serve() -> None:
    """Run the function that stdin names, and write its messages to stdout; the whole life of the child."""
    with os.fdopen(0, "rb") as source, os.fdopen(os.dup(1), "wb") as out:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for what native packages print
        function, arguments, limit_bytes = pickle.load(source)
        threading.Thread(target=_end_with, args=(source,), daemon=True).start()
        _end_by_signal(source)
        try:
            with limit_allocations(limit_bytes):
                for message in function(*arguments):
                    pickle.dump((message, None), out, pickle.HIGHEST_PROTOCOL)
                    out.flush()
            end: BaseException | None = StopIteration()
        except AnimError as error:
            end = type(error)(error.problem, where=error.where, help=error.help)
        except MemoryError:
            end = MemoryError()
        except Exception:
            end = RuntimeError(traceback.format_exc())
        pickle.dump((None, end), out)
        out.flush()
        os._exit(0)  # the thread reads from a file that a normal exit would close


def _end_with(source: IO[bytes]) -> None:
    """Exit when the parent has closed its end of stdin, as the system does when it exits."""
    source.read(1)
    os._exit(1)


def _end_by_signal(source: IO[bytes]) -> None:
    """Let the system end this process when the other end of a pipe is closed: native code may never let threads run.

    SIGIO is sent then, whose default is to end.
    """
    with suppress(ImportError, AttributeError, OSError):  # Windows has none of these
        import fcntl

        signal.signal(signal.SIGIO, signal.SIG_DFL)
        fcntl.fcntl(source, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(source, fcntl.F_SETFL, fcntl.fcntl(source, fcntl.F_GETFL) | os.O_ASYNC)


def _send(pipe: IO[bytes], data: bytes) -> None:
    try:
        pipe.write(data)
        pipe.flush()
    except OSError as error:  # it has ended: reading says so
        if error.errno not in (errno.EPIPE, errno.EINVAL):  # EINVAL: the same on Windows
            raise


def _messages(process: subprocess.Popen[bytes], pipe: IO[bytes]) -> Iterator[Any]:
    while True:
        try:
            message, end = pickle.load(pipe)
        except (EOFError, pickle.UnpicklingError):
            raise ChildEndedError(_peak_bytes(process)) from None
        if isinstance(end, StopIteration):
            return
        if end is not None:
            raise end
        yield message


def _peak_bytes(process: subprocess.Popen[bytes]) -> int:
    """Most memory that the child had, which ends; 0 if it is unknown: on other systems than Linux, where SIGCHLD is
    ignored, or less than this process had, with which the child's figure starts.
    """
    if sys.platform != "linux" or process.returncode is not None:
        return 0
    if signal.getsignal(signal.SIGCHLD) is signal.SIG_IGN:  # inherited: the system itself waits for children
        return 0
    try:
        os.kill(process.pid, signal.SIGKILL)  # `process.kill` takes the figures of one that has ended
        _, status, usage = os.wait4(process.pid, 0)
    except (ProcessLookupError, ChildProcessError):  # the program around this has waited for all its children
        return 0
    process.returncode = os.waitstatus_to_exitcode(status)
    import resource  # not on Windows

    return 1024 * usage.ru_maxrss if usage.ru_maxrss > resource.getrusage(resource.RUSAGE_SELF).ru_maxrss else 0

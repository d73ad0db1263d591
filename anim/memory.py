"""Limit of the memory that the decoded data of one file may take, checked before it is allocated."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from anim.errors import UnsupportedError

MIN_LIMIT_BYTES = 10**9
LIMIT_PER_FILE_BYTE = 64  # above the ratio of good compression, of keys and of vertices, to float64

THREAD_BYTES = 1 << 24  # stack and first allocations of a thread that a native package starts

_chosen: ContextVar[int | None] = ContextVar("memory_limit", default=None)


@contextmanager
def memory_limit(size: int | None) -> Iterator[None]:
    """Use another limit, in bytes, inside the block; None for the limit by the file's size."""
    token = _chosen.set(size)
    try:
        yield
    finally:
        _chosen.reset(token)


def limit_for(file_bytes: int) -> int:
    """Return the limit for a file of this size: the chosen one, or the larger of 1 GB and 64 times the file."""
    return _chosen.get() or max(MIN_LIMIT_BYTES, LIMIT_PER_FILE_BYTE * file_bytes)


@contextmanager
def limit_allocations(size: int) -> Iterator[None]:
    """Let allocations fail inside the block, on Linux, beyond `size` bytes of the process's data.

    Or beyond half of `size` more than it has, if that is more. For native packages that count nothing.
    """
    used = _data_bytes()
    if used is None:
        yield
        return
    import resource

    usual = resource.getrlimit(resource.RLIMIT_DATA)
    most = max(size, used + size // 2) + THREAD_BYTES * (os.cpu_count() or 1)
    if usual[0] != resource.RLIM_INFINITY and usual[0] < most:
        yield
        return
    resource.setrlimit(resource.RLIMIT_DATA, (most, usual[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, usual)


def _data_bytes() -> int | None:
    """Size of this process's data, as RLIMIT_DATA counts it; None on other systems than Linux."""
    try:
        with Path("/proc/self/status").open(encoding="ascii", errors="replace") as file:
            return next((1024 * int(line.split()[1]) for line in file if line.startswith("VmData:")), None)
    except (OSError, ValueError):
        return None


class MemoryBudget:
    """Sum of the bytes that one file decodes to. file_bytes: the file's own size."""

    def __init__(self, file_bytes: int) -> None:
        self.limit = limit_for(file_bytes)
        self._sum = 0

    def add(self, size: int) -> None:
        """Count data before it is allocated. Raises UnsupportedError if the sum is above the limit."""
        self._sum += size
        self.check(0)

    def is_within(self, size: int) -> bool:
        """Return whether the sum and `size` more bytes are within the limit."""
        return self._sum + size <= self.limit

    def check(
        self, size: int, what: str = "decoded data", *, help: str = "raise `memory_limit`, or split the file"
    ) -> None:
        """Raise UnsupportedError if the sum and `size` more bytes are above the limit.

        what: takes these bytes; for the message. help: the way out.
        """
        if not self.is_within(size):
            taken, limit = (f"{each / 1e9:.3g} GB" for each in (self._sum + size, self.limit))
            raise UnsupportedError(f"{what} would take {taken} or more (limit {limit})", help=help)

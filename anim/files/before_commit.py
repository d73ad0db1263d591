"""A job that must succeed before the first file of a command is changed, so that its error leaves all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeAlias

Job: TypeAlias = Callable[[], object]

_waiting: ContextVar[Job | None] = ContextVar("job_before_commit", default=None)


@contextmanager
def before_commit(job: Job) -> Iterator[None]:
    """Call `job` inside the block once, before any file is replaced, written directly, or given another time."""
    token = _waiting.set(job)
    try:
        yield
    finally:
        _waiting.reset(token)


def run_job() -> None:
    """Run the job that waits for the first change, if any: its own files don't wait for it."""
    if (job := _waiting.get()) is not None:
        _waiting.set(None)
        job()

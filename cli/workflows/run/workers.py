"""Worker processes of a run: one loop over `concurrent.futures`, for a pool of this machine and for a cluster."""

from __future__ import annotations

import gc
import multiprocessing
import os
import sys
import threading
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from typing import TypeAlias

from anim.errors import UnsupportedError, is_out_of_memory
from anim.files import signals
from anim.worker_processes import Lifeline, follow_parent, open_lifeline
from cli import errors
from cli.workflows.run.job import Job, JobResult
from cli.workflows.run.run_job import run_job

HELP = "fewer --jobs need less, and `ulimit -a` shows the limits"
MAX_CLEAN_UP_S = 2.0  # of a worker, when the parent has ended
Answer: TypeAlias = tuple[Job, JobResult]
OpenPool: TypeAlias = Callable[[int], AbstractContextManager[Executor]]  # of a number of workers

_busy = threading.Event()  # of a worker process, while it runs a job


def run_jobs(
    jobs: Iterator[Job], open_pool: OpenPool, count: int, work: Callable[[Job], JobResult] | None = None
) -> Iterator[Answer]:
    """Yield the result of every job as it is done, from `count` jobs at a time.

    work: gives the result of a job in a worker; `run_in_worker` without it.
    If a worker process ends, the jobs that were running are run again, each alone: the one that ends its process is
    reported, and all others are done.
    """
    work = work or run_in_worker
    while True:
        lost = yield from _run_until_broken(jobs, open_pool, count, work)
        if not lost:
            return
        for job in lost:
            if (yield from _run_until_broken(iter([job]), open_pool, 1, work)):
                yield job, ended_result(job)


def ended_result(job: Job) -> JobResult:
    """Return the result of a job whose process was ended."""
    problem = "the process that worked on it was ended by the system"
    line = f"{errors.PROGRAM}: {job.input}: {problem}"
    return JobResult(errors.UNSUPPORTED, (line, "help: if memory ran out, fewer --jobs need less"))


def _run_until_broken(
    jobs: Iterator[Job], open_pool: OpenPool, count: int, work: Callable[[Job], JobResult]
) -> Generator[Answer, None, list[Job]]:
    """Yield results until all jobs are done, or until the pool is broken; return the jobs that were running then."""
    running: dict[Future[JobResult], Job] = {}
    with open_pool(count) as pool:
        for job in jobs:
            try:
                running[pool.submit(work, job)] = job
            except BrokenProcessPool:
                return [job, *(yield from _collect(running))]
            if len(running) > count and (lost := (yield from _collect(running, some=True))):
                return lost + (yield from _collect(running))
        return (yield from _collect(running))


def _collect(running: dict[Future[JobResult], Job], *, some: bool = False) -> Generator[Answer, None, list[Job]]:
    """Yield results as they come, until all are done, or only some; return the jobs that the pool has lost."""
    lost = []
    while running:
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            job = running.pop(future)
            error = _error_of(future)
            if isinstance(error, BrokenProcessPool):
                lost.append(job)
            else:
                yield job, future.result() if error is None else _failed(job, error)
        if some:
            break
    return lost


def _error_of(future: Future[JobResult]) -> BaseException | None:
    try:
        return future.exception()
    except CancelledError as error:  # the scheduler of a cluster has ended
        return error


def _failed(job: Job, error: BaseException) -> JobResult:
    """The result of a job that has none of its own: its worker was ended, or can't be reached."""
    if type(error).__name__ in ("KilledWorker", "SystemExit"):
        return ended_result(job)
    words = str(error).split("\n")[0]
    return JobResult(errors.UNSUPPORTED, (f"{errors.PROGRAM}: {job.input}: {type(error).__name__}: {words}",))


def run_in_worker(job: Job) -> JobResult:
    """Run a job in a worker process, which removes its temporary files before SIGTERM ends it."""
    _busy.set()
    try:
        return run_job(job)
    except SystemExit as stop:  # a pool would wait for a worker that goes on after SIGTERM
        os._exit(stop.code if isinstance(stop.code, int) else 1)
    finally:
        _busy.clear()


@contextmanager
def local_pool(count: int) -> Iterator[Executor]:
    """Provide a pool of processes of this machine, which end with this one.

    Raises UnsupportedError if the system has no more files, processes or semaphores for them.
    """
    start = "fork" if sys.platform == "linux" else "spawn"
    context = multiprocessing.get_context(start)
    gc.freeze()  # what this process has loaded is never collected by forked ones, so that its pages stay shared
    with _name_errors(), signals.ignore_broken_pipes(), open_lifeline(context, start) as lifeline:
        pool = ProcessPoolExecutor(count, context, _set_up, (lifeline,))
        try:
            yield pool
            pool.shutdown()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextmanager
def _name_errors() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if is_out_of_memory(error):
            raise
        reason = (error.strerror or str(error)).lower()
        raise UnsupportedError(f"worker processes can't be started ({reason})", help=HELP) from None


def _set_up(lifeline: Lifeline) -> None:
    follow_parent(lifeline, busy=_busy, max_wait_s=MAX_CLEAN_UP_S)
    gc.enable()  # one process works on many files

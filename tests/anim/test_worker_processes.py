"""Worker processes end when they are told to, also between jobs."""

from __future__ import annotations

import multiprocessing
import signal
import sys
import threading
import time
from multiprocessing.synchronize import Event

import pytest

from anim.worker_processes import Lifeline, follow_parent, open_lifeline

MAX_WAIT_S = 120.0  # of a busy machine


def _wait_as_a_pool_does(lifeline: Lifeline, ready: Event) -> None:
    """Wait again whatever is raised, as the pool of the standard library does when it sends a result."""
    follow_parent(lifeline, busy=threading.Event())
    ready.set()
    while True:
        try:
            time.sleep(MAX_WAIT_S)
        except BaseException:
            continue


@pytest.mark.skipif(sys.platform != "linux", reason="forked workers")
def test_a_worker_between_jobs_ends_at_once_by_sigterm() -> None:
    context = multiprocessing.get_context("fork")
    ready = context.Event()
    with open_lifeline(context, "fork") as lifeline:
        worker = context.Process(target=_wait_as_a_pool_does, args=(lifeline, ready))
        worker.start()
        assert ready.wait(MAX_WAIT_S)
        worker.terminate()
        worker.join(MAX_WAIT_S / 2)
        is_alive = worker.is_alive()
        worker.kill()
    assert not is_alive
    assert worker.exitcode == 128 + signal.SIGTERM

"""Signals that come while files change places: held, not lost."""

from __future__ import annotations

import signal
import threading

import pytest

from anim.files.signals import hold_signals


def test_an_interrupt_takes_effect_at_the_end() -> None:
    usual = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    done = []

    def work() -> None:
        with hold_signals():
            signal.raise_signal(signal.SIGINT)
            done.append(True)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == usual


def test_other_threads_hold_nothing() -> None:
    entered: list[bool] = []

    def work() -> None:
        with hold_signals():
            entered.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert entered

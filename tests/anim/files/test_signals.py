"""Signals that come while files change places: held, not lost."""

from __future__ import annotations

import signal
import tempfile
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.files import atomic, signals
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


def test_signals_take_effect_after_an_error_and_after_an_ignored_one(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = signal.signal(signal.SIGTERM, signal.SIG_IGN)  # as nohup does with SIGHUP
    monkeypatch.setattr(signals, "STOPS", (signal.SIGINT, signal.SIGTERM))

    def fail() -> None:
        with hold_signals():
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGINT)
            raise OSError

    try:
        with pytest.raises(KeyboardInterrupt):
            fail()
    finally:
        signal.signal(signal.SIGTERM, usual)


def test_a_signal_as_a_temporary_file_is_made_does_not_leave_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def mkstemp(**options: Any) -> tuple[int, str]:
        found = make(**options)
        signal.raise_signal(signal.SIGINT)
        return found

    make = tempfile.mkstemp
    monkeypatch.setattr(tempfile, "mkstemp", mkstemp)
    with pytest.raises(KeyboardInterrupt):
        atomic.write_file(tmp_path / "a.glb", [np.zeros(9, np.uint8)])
    staged = atomic.AtomicOutputs(tmp_path, "a.npz")
    with pytest.raises(KeyboardInterrupt):
        staged.create("a.npz")
    staged.clear()
    assert list(tmp_path.iterdir()) == []


def test_other_threads_hold_nothing() -> None:
    entered: list[bool] = []

    def work() -> None:
        with hold_signals():
            entered.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert entered

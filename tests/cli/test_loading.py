"""Interrupts while libraries load: kept, and not lost where a library swallows all that it can't name."""

from __future__ import annotations

import signal
import sys
import threading
from pathlib import Path

import pytest

from cli import loading

GREEDY = """
import signal
try:
    signal.raise_signal({signal})
except BaseException:
    pass
whole = True
"""


@pytest.fixture
def greedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A module that gets a signal while it loads, and swallows it."""
    (tmp_path / "greedy_library.py").write_text(GREEDY.format(signal=int(signal.SIGINT)))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "greedy_library", raising=False)
    return "greedy_library"


def test_an_interrupt_takes_effect_when_the_library_is_there(greedy: str) -> None:
    usual = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        loading.load(greedy)
    assert sys.modules[greedy].whole
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == usual


def test_what_is_not_installed_is_left_to_whoever_needs_it() -> None:
    loading.load("no_such_library")
    loading.load("")


def test_other_threads_load_as_usual() -> None:
    found: list[BaseException] = []

    def load() -> None:
        try:
            loading.load("json")
        except BaseException as error:
            found.append(error)

    thread = threading.Thread(target=load)
    thread.start()
    thread.join()
    assert not found

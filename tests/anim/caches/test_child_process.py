"""A function in a child process: its messages and errors, its end, and the limit of its memory."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.caches.child_process import ChildEndedError, run_in_child
from anim.errors import FormatError

GB = 10**9


def squares(count: int) -> Iterator[int]:
    """Yield squares, and print beside them as native packages do."""
    os.write(1, b"printed")
    os.write(2, b"printed")
    yield from (i * i for i in range(count))


def refused() -> Iterator[int]:
    yield 1
    raise FormatError("is none", where="mesh 'a'", help="look")


def crashed() -> Iterator[int]:
    yield 1
    os.abort()


def wrong() -> Iterator[int]:
    yield 1
    raise KeyError("of ours")


def greedy() -> Iterator[int]:
    yield len(np.ones(2 * GB, np.uint8))


def endless(path: str) -> Iterator[int]:
    yield os.getpid()
    Path(path).touch()
    while True:
        pass


def modules() -> Iterator[list[str]]:
    yield sys.path


def taken(function: Any, *arguments: Any) -> list[Any]:
    with run_in_child(function, *arguments, limit_bytes=GB) as messages:
        return list(messages)


def test_messages_come_in_order_without_what_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    assert taken(squares, 3) == [0, 1, 4]
    assert capfd.readouterr() == ("", "")
    assert taken(modules) == [sys.path]


def test_errors_of_ours_pass() -> None:
    with pytest.raises(FormatError) as caught:
        taken(refused)
    assert (str(caught.value), caught.value.help) == ("mesh 'a': is none", "look")
    assert caught.value.__notes__ == ["help: look"]


@pytest.mark.parametrize("function", [crashed, wrong])
def test_a_child_that_ends_is_an_error(function: Any) -> None:
    with pytest.raises(ChildEndedError):
        taken(function)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has this limit")
def test_memory_has_a_limit() -> None:
    with pytest.raises(MemoryError):
        taken(greedy)


@pytest.mark.skipif(os.name != "posix", reason="signal 0")
def test_the_child_ends_with_the_block(tmp_path: Path) -> None:
    with run_in_child(endless, str(tmp_path / "a"), limit_bytes=GB) as messages:
        child = next(messages)
        os.kill(child, 0)
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)

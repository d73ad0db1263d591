"""Packages that write only by name say why they can't in words of their own."""

from __future__ import annotations

import errno
import os
import tempfile
from typing import Any

import pytest

from anim.caches.storage import Memory
from anim.caches.temporary_files import temp_input, temp_output
from anim.errors import OutputError


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (f"Error in 'Write' at line 78:\n'{os.strerror(errno.ENOSPC)}', Error: 'file corrupt'", "no space left"),
        ("Error in 'Save' at line 3", "is there room?"),
    ],
)
def test_the_reason_of_the_system_is_picked_out_of_them(words: str, reason: str) -> None:
    with (
        pytest.raises(OutputError, match=rf"^a\.usdc: can't be written as \.usdc in .*\({reason}") as caught,
        temp_output(Memory("a.usdc"), "a.usdc", ".usdc", failures=(RuntimeError,)),
    ):
        raise RuntimeError(words)
    assert "TMPDIR" in caught.value.help


@pytest.mark.parametrize("use", [temp_input, temp_output])
def test_no_usable_folder_is_said_in_one_line(use: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """As with a limit of file sizes of 0, with which Python finds no folder to write into."""

    def fail(*_: object, **__: object) -> None:
        raise FileNotFoundError(errno.ENOENT, "No usable temporary directory found")

    monkeypatch.setattr(tempfile, "TemporaryDirectory", fail)
    with (
        pytest.raises(OutputError, match=r"^a temporary folder: can't be written \(no usable") as caught,
        use(Memory("a.usdc", {"a.usdc": b""}), "a.usdc", ".usdc"),
    ):
        pass
    assert "TMPDIR" in caught.value.help

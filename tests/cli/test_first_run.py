"""A person at a terminal reads why the first run takes longer; scripts don't."""

from __future__ import annotations

import io
import sys

import pytest

from anim.skinning.kernels import jit
from cli.progress import announce_compiling
from cli.text import Reporter


class Terminal(io.StringIO):
    """A stream that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("stream", "compiled", "quiet", "line"),
    [
        (Terminal(), False, False, "compiling kernels (first run only)\n"),
        (Terminal(), True, False, ""),
        (Terminal(), False, True, ""),
        (io.StringIO(), False, False, ""),
    ],
)
def test_a_first_run_is_announced_on_a_terminal(
    stream: io.StringIO, compiled: bool, quiet: bool, line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(jit, "is_compiled", lambda: compiled)
    announce_compiling(Reporter(quiet))
    assert stream.getvalue() == line

"""The line that explains why a first run takes seconds longer."""

from __future__ import annotations

import sys

from cli.text import Reporter


def announce_compiling(voice: Reporter) -> None:
    """Write to a terminal that kernels are compiled, where none is in the user's cache folder yet."""
    if voice.quiet or sys.stderr is None or not sys.stderr.isatty():
        return
    from anim.skinning.kernels.jit import is_compiled

    if not is_compiled():
        voice.info("compiling kernels (first run only)")

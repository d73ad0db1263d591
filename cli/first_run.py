"""Note on the compilation of kernels at the first run."""

from __future__ import annotations

import sys

from cli.text import Reporter


def announce_compiling(voice: Reporter) -> None:
    """Report the compilation of kernels to a terminal if the user's cache folder has none yet."""
    if voice.quiet or sys.stderr is None or not sys.stderr.isatty():
        return
    from anim.skinning.kernels.jit import is_compiled

    if not is_compiled():
        voice.info("compiling kernels (first run only)")

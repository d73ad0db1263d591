"""Libraries that are loaded whole: some of them swallow an interrupt that comes meanwhile."""

from __future__ import annotations

import importlib
from contextlib import suppress

from anim.files.signals import hold_signals


def load(name: str) -> None:
    """Import a module if it is installed, "" for none; an interrupt takes effect when it is there."""
    if name:
        with hold_signals(), suppress(ImportError):
            importlib.import_module(name)

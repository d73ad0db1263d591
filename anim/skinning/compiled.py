"""Kernels compiled when they are first used: numba costs more at start-up than all the rest of the program."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from threading import Lock
from types import FunctionType
from typing import Any, TypeAlias

Kernel: TypeAlias = Callable[..., None]

APP = "gltf-anim"  # whose folder in the user's cache keeps machine code from one run to the next
_one_at_a_time = Lock()  # numba is told its folder by a global


def compiled(kernel: Kernel) -> Kernel:
    """Return a plain function over arrays, with those of its module that it calls, as code free of Python's lock.

    Code is kept in the user's cache folder, wherever the package lies, and made anew in each process where there is
    no such folder. Without fast-math: sums and products come out the same on every machine.
    """
    with _one_at_a_time:
        return _compiled(kernel)


@cache
def _compiled(kernel: Kernel) -> Kernel:
    from numba.core import config

    given = config.CACHE_DIR
    folder = given or _folder()
    config.CACHE_DIR = folder
    try:
        fast: Kernel = _jit(kernel, keep=bool(folder))
    finally:
        config.CACHE_DIR = given
    return fast


def _jit(kernel: Any, *, keep: bool) -> Any:
    import numba

    called = [kernel.__globals__.get(name) for name in kernel.__code__.co_names]
    helpers = [each for each in called if isinstance(each, FunctionType) and each.__module__ == kernel.__module__]
    known = {**kernel.__globals__, **{each.__name__: _jit(each, keep=keep) for each in helpers}}
    copy = FunctionType(kernel.__code__, known, kernel.__name__)
    copy.__module__ = kernel.__module__
    inner = {"forceinline": True} if kernel.__name__.startswith("_") else {}  # rows of known length go fast
    return numba.njit(nogil=True, error_model="numpy", cache=keep, **inner)(copy)


def _folder() -> str:
    """The folder in the user's cache, there and writable; empty where that can't be."""
    from numba.misc.appdirs import AppDirs

    folder = str(AppDirs(appname=APP, appauthor=False).user_cache_dir)
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError:
        return ""
    return folder if os.access(folder, os.W_OK) else ""

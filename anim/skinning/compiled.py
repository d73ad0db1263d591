"""Kernels compiled when they are first used: numba costs more at start-up than all the rest of the program."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from functools import cache
from threading import Lock
from types import FunctionType
from typing import Any, TypeAlias

import numpy as np

Kernel: TypeAlias = Callable[..., Any]

APP = "gltf-anim"  # whose folder in the user's cache keeps machine code from one run to the next
ROOM = __name__.rpartition(".")[0]
NUMBERS = (int, float, np.generic)
_one_at_a_time = Lock()  # numba is told its folder by a global


def compiled(kernel: Kernel) -> Kernel:
    """Return a plain function over arrays, with those of this room that it calls, as code free of Python's lock.

    It must not make arrays: nothing counts who uses them, which takes half the time of a loop over rows, and more where
    threads share the counts. Without fast-math: sums and products come out the same on every machine.
    Code is kept in the user's cache folder (or $NUMBA_CACHE_DIR), wherever the package lies, under a name made of its
    source; it is made anew in each process where there is no such folder.
    """
    with _one_at_a_time:
        return _compiled(kernel)


@cache
def _compiled(kernel: Any) -> Kernel:
    from numba.core import config

    given = config.CACHE_DIR
    folder = _folder(given or _own(), _digest(kernel))
    config.CACHE_DIR = folder
    try:
        fast: Kernel = _jit(_linked(kernel, bool(folder)), keep=bool(folder))
    finally:
        config.CACHE_DIR = given
    return fast


@cache
def _inlined(helper: Any, keep: bool) -> Any:
    return _jit(_linked(helper, keep), keep=keep, forceinline=True)  # rows of known length go fast


def _jit(function: Any, *, keep: bool, **how: bool) -> Any:
    import numba

    return numba.njit(nogil=True, error_model="numpy", cache=keep, _nrt=False, **how)(function)


def _linked(function: Any, keep: bool) -> Any:
    """The function with compiled ones in place of those that it calls."""
    known = {**function.__globals__, **{each.__name__: _inlined(each, keep) for each in _called(function)}}
    copy = FunctionType(function.__code__, known, function.__name__)
    copy.__module__ = function.__module__
    return copy


def _called(function: Any) -> Iterator[Any]:
    for name in function.__code__.co_names:
        found = function.__globals__.get(name)
        if isinstance(found, FunctionType) and found.__module__.startswith(ROOM):
            yield found


def _digest(kernel: Any) -> str:
    """What tells versions of a kernel and all that it calls apart; numba looks at its file's time and size only."""
    found, ahead = hashlib.sha256(), [kernel]
    while ahead:
        function = ahead.pop()
        code, known = function.__code__, function.__globals__
        values = [known[name] for name in code.co_names if isinstance(known.get(name), NUMBERS)]
        found.update(code.co_code + repr((code.co_names, code.co_consts, values)).encode())
        ahead.extend(_called(function))
    return found.hexdigest()[:12]


def _own() -> str:
    """Our folder in the user's cache, there or not."""
    from numba.misc.appdirs import AppDirs

    return str(AppDirs(appname=APP, appauthor=False).user_cache_dir)


def _folder(base: str, name: str) -> str:
    """The folder of this name, there and writable; empty where that can't be."""
    folder = os.path.join(base, name)
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError:
        return ""
    return folder if os.access(folder, os.W_OK) else ""

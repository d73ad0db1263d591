"""Compilation of kernels by numba; machine code is cached in the user's cache folder."""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

import anim

KERNEL_FOLDERS = ("skinning/kernels", "simulation/cloth/kernels", "simulation/particles/kernels")  # in `anim`
MIN_FREE_BYTES = 1 << 20  # for machine code: a kernel takes about 100 kB
WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
Function = TypeVar("Function", bound=Callable[..., Any])


def jit(function: Function) -> Function:
    """Return a function that is compiled for its argument types on the first call.

    It runs without the GIL, divides by IEEE 754, and has no fast-math: equal numbers on every machine.
    """
    return cast(Function, numba.njit(nogil=True, error_model="numpy", cache=_has_cache())(function))


def callee(function: Function) -> Function:
    """Return a function that only kernels call, compiled without an entry from Python.

    The entry unpacks all arrays of nested tuples: a quarter of the time to compile the kernels of particles.
    """
    entry = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast(Function, numba.njit(nogil=True, error_model="numpy", cache=_has_cache(), **entry)(function))


def inline(function: Function) -> Function:
    """Return a function that is inlined into each kernel that calls it."""
    return cast(Function, numba.njit(nogil=True, error_model="numpy", inline="always")(function))


def is_compiled() -> bool:
    """Return whether any kernel is in the cache, so that a first run can be announced."""
    return _has_cache() and any(Path(numba.config.CACHE_DIR).glob("**/*.nbc"))


@cache
def _has_cache() -> bool:
    """Return whether there is a cache folder of this user alone; without it kernels are compiled in each process.

    Numba would fall back to `__pycache__` beside the kernels, which machine code of other sources may be in. It runs
    what it finds in the folder: nobody else may have put it there.
    """
    folder = numba.config.CACHE_DIR
    try:
        Path(folder).mkdir(mode=0o700, parents=True, exist_ok=True)
        return bool(folder) and os.access(folder, os.W_OK) and _is_usable(folder)
    except OSError:
        return False


def _is_usable(folder: str) -> bool:
    """Return whether a folder is the user's and has room.

    Raises OSError where it has none: numba would, in a bake. Also where all code is there already, which nobody knows.
    """
    if os.name == "posix" and not _is_private(folder):
        return False
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(bytes(MIN_FREE_BYTES))
    return True


def _is_private(folder: str) -> bool:
    """Return whether only the user can write to a folder, and only root, too, exchange it or one above it.

    As ssh's StrictModes; by the path as it is given and without links. In a folder as /tmp (sticky) names are safe.
    """
    user, own = os.geteuid(), os.stat(folder)
    if own.st_uid != user or own.st_mode & WRITABLE_BY_OTHERS:
        return False
    paths = Path(os.path.abspath(folder)), Path(os.path.realpath(folder))
    above = [each.stat() for each in {*paths[0].parents, *paths[1].parents}]
    return all(
        each.st_uid in (0, user) and (each.st_mode & stat.S_ISVTX or not each.st_mode & WRITABLE_BY_OTHERS)
        for each in above
    )


def _cache_folder() -> str:
    """The user's folder for this version and these sources; "" where there is none.

    Numba checks the file of a function for changes, but not those of its callees.
    """
    kernels = (path for folder in KERNEL_FOLDERS for path in (Path(__file__).parents[2] / folder).glob("*.py"))
    stamps = [(path.name, path.stat().st_size, path.stat().st_mtime_ns) for path in kernels]
    sources = hashlib.sha256(repr(sorted(stamps)).encode()).hexdigest()[:12]
    base = _user_caches()
    return "" if base is None else str(base / "gltf-anim" / f"{anim.__version__}-{sources}")


def _user_caches() -> Path | None:
    """The user's folder for caches."""
    given = Path(os.getenv("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME") or "")
    if given.is_absolute():  # the XDG standard ignores relative ones
        return given
    try:
        home = Path.home()
    except RuntimeError:  # a container's user may have no home
        return None
    if not home.is_dir():
        return None
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache")


if not numba.config.CACHE_DIR:  # $NUMBA_CACHE_DIR
    numba.config.CACHE_DIR = _cache_folder()

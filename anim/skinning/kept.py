"""Machine code in the user's cache folder, from one run to the next."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

from anim.skinning.machine_code import MachineCode

APP = "gltf-anim"  # whose folder it is
SEAL = 32  # bytes of SHA-256 before the rest: code that is not whole must not be run
NO_FOLDER = (OSError, RuntimeError)  # it can't be used, or the user has no home


def read(name: str) -> MachineCode | None:
    """Return what was written under a name, None where that is not there or not whole."""
    try:
        found = (_folder() / name).read_bytes()
    except NO_FOLDER:
        return None
    seal, content = found[:SEAL], found[SEAL:]
    if hashlib.sha256(content).digest() != seal:
        return None
    symbol, _, object_file = content.partition(b"\n")
    return MachineCode(symbol.decode(), object_file)


def write(name: str, code: MachineCode) -> None:
    """Keep machine code under a name, whole or not at all; where that can't be, nothing happens."""
    content = code.symbol.encode() + b"\n" + code.object
    try:
        path = _folder() / name
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = path.with_name(f"{name}.{os.getpid()}")
        try:
            aside.write_bytes(hashlib.sha256(content).digest() + content)
            aside.replace(path)
        finally:
            aside.unlink(missing_ok=True)
    except NO_FOLDER:
        return


def _folder() -> Path:
    given = os.environ.get("NUMBA_CACHE_DIR")
    return Path(given) if given else _caches() / APP


def _caches() -> Path:
    """Where programs of this user keep what can be made again."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")

"""Reading USD layers as the child process of `convert-cache` does, without starting one for each: 30 times as many."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from anim.caches.formats import usd_meshes
from anim.errors import AnimError
from anim.memory import limit_allocations, limit_for

NAME = "read-usd"  # stands for a command in the command lines of the fuzzers


def run(arguments: Sequence[str]) -> int:
    """Read the meshes of a layer at all times; return the exit code that `convert-cache` has."""
    _, path = arguments
    try:
        with limit_allocations(limit_for(Path(path).stat().st_size)):
            (stage,) = usd_meshes.summary(path, limit_for(0))
            directions = {"normals": stage.has_normals, "tangents": stage.handedness is not None}
            for _ in usd_meshes.frames(path, limit_for(0), codes=stage.codes, **directions):
                pass
    except AnimError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 3
    except MemoryError:
        return 4
    except Exception:
        traceback.print_exc()
        return 1
    return 0

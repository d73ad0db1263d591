"""Blender as a judge: the vertices of a file as Blender's own importer and its own evaluation place them.

It is tests/blender_play.py, run by a Python that has Blender's module: the one that $BLENDER_PYTHON names, or
`.venv-blender/bin/python` beside pyproject.toml (`make blender` makes it). bpy lives in a venv of its own, because it
is large, wants one certain version of Python, and brings its own numpy. Nothing of `anim` takes part. Tests that need
it carry `@needs_blender` and are skipped, with the reason, where it is absent; with $REQUIRE_BLENDER set, absence is an
error.

Traps of its importer (5.0), none of which is in files: it plays rotations by components, normalized, so that only keys
compare with slerp; CUBICSPLINE gets tangents of Blender's own; the sliders of shape keys, 0…1, widen by the first key
alone, and the weights of all others are clamped to them; vertices that no triangle uses are left out.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = ROOT / "tests" / "blender_play.py"
TIMEOUT = 600  # s, for one call
FPS = 100  # frames of the scene per second; times between its frames are reached too


def vertices(file: Path, times: Sequence[float], *, clip: str | None = None, fps: int = FPS) -> dict[str, Floats]:
    """Return the vertices (F, V, 3) of each object with a mesh, by its name: world space, m, Y up.

    times: s. clip: its name; None for the first. Objects are called as their nodes, where names differ and fit 63
    bytes. fps: frames per second of the scene; of USD that of the file. Raises RuntimeError with Blender's words where
    the file does not load.
    """
    return play(file, times, clip=clip, fps=fps)[0]


def play(
    file: Path,
    times: Sequence[float],
    *,
    clip: str | None = None,
    fps: int = FPS,
    picture: dict[str, Any] | None = None,
) -> tuple[dict[str, Floats], dict[str, Any]]:
    """Return the `vertices`, and for each object "coordinates", names of its UV layers, and "images".

    "images" are the sizes of those behind its base color. picture: also draw one: {"file": a .png, "time": s,
    "center": (3,), "size": of what is shown}, m, Y up.
    """
    if reason := missing():
        raise RuntimeError(reason)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.npz"
        task = json.dumps({"clip": clip, "times": [float(time) for time in times], "fps": fps, "picture": picture})
        command = [str(_python()), "-I", str(SCRIPT), str(file.resolve()), task, str(out)]
        own = {**os.environ, "BLENDER_USER_RESOURCES": folder}  # not the preferences of whoever runs this
        run = subprocess.run(command, capture_output=True, timeout=TIMEOUT, check=False, env=own)
        if run.returncode or not out.is_file():
            raise RuntimeError(f"{file.name}: {run.stderr.decode(errors='replace').strip()}")
        with np.load(out) as found:
            return {name: np.asarray(found[name]) for name in found.files}, json.loads(Path(f"{out}.json").read_text())


def missing() -> str:
    """Return why Blender can't be asked, or "" if it can."""
    if _python() is None:
        return "Blender's module is not installed (make blender, or set BLENDER_PYTHON to a Python that has bpy)"
    return ""


@cache
def _python() -> Path | None:
    given = os.environ.get("BLENDER_PYTHON")
    for python in ([Path(given)] if given else []) + [ROOT / ".venv-blender" / "bin" / "python"]:
        look = [
            str(python),
            "-I",
            "-c",
            "import importlib.util, sys; sys.exit(importlib.util.find_spec('bpy') is None)",
        ]
        if python.is_file() and subprocess.run(look, capture_output=True, check=False).returncode == 0:
            return python
    return None


if os.environ.get("REQUIRE_BLENDER") and missing():  # CI must not pass by skipping its judge
    raise RuntimeError(missing())

needs_blender = pytest.mark.skipif(bool(missing()), reason=missing() or "present")

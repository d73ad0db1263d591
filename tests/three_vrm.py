"""Spring bones as three-vrm plays them, in node and without a display.

It is the npm package `@pixiv/three-vrm`, looked for beside the package `three` (see `tests.judge`). Tests that need it
carry `@needs_three_vrm` and are skipped, with the reason, where it is absent.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests import judge

SCRIPT = Path(__file__).parent / "threejs" / "springs.mjs"
TIMEOUT = 120  # s

Array = NDArray[np.float64]


def play(file: Path, drivers: Mapping[int, tuple[Array, Array]], dt: float, *, cured: bool) -> tuple[list[int], Array]:
    """Return the joints (J) and their local rotations (F, J, 4), a step of `dt` s per frame.

    drivers: positions (F, 3) and rotations (F, 4) by node. cured: without the two faults that `plain_loop` names.
    """
    nodes = {str(node): {"position": p.tolist(), "quaternion": q.tolist()} for node, (p, q) in drivers.items()}
    command = ["node", str(SCRIPT), str(judge.package()), str(file), *(["cured"] if cured else [])]
    task = json.dumps({"dt": dt, "nodes": nodes}).encode()
    run = subprocess.run(command, input=task, capture_output=True, timeout=TIMEOUT, check=False)
    if run.returncode:
        raise RuntimeError(run.stderr.decode(errors="replace"))
    found = json.loads(run.stdout)
    return found["nodes"], np.array(found["frames"])


def missing() -> str:
    """Return why three-vrm can't run here, or "" if it can."""
    if reason := judge.missing():
        return reason
    folder = judge.package()
    if folder is None or not (folder.parent / "@pixiv" / "three-vrm-springbone").is_dir():
        return "three-vrm is not installed (npm install @pixiv/three-vrm, beside three)"
    return ""


if os.environ.get("REQUIRE_JUDGE") and missing():  # CI must not pass by skipping its judge
    raise RuntimeError(missing())

needs_three_vrm = pytest.mark.skipif(bool(missing()), reason=missing() or "present")

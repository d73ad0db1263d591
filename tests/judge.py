"""The independent judge: two files played in three.js, and how far apart their vertices get.

It is tests/threejs/judge.mjs on the npm package `three`, looked for in the folders $GLTF_THREE_DIR and
$GLTF_VALIDATOR_DIR and in `node_modules` beside pyproject.toml. Nothing of `anim` takes part. Tests that need it carry
`@needs_judge` and are skipped, with the reason, where it is absent; with $REQUIRE_JUDGE set, absence is an error.

three.js holds keys in float32, as files do, and computes in float64: it adds no noise. The same keys give exactly 0;
the same motion on other keys shows how finely float32 holds times and values, some 4e-7 of the diagonal. It plays no
KHR_animation_pointer (`ignored`), and takes quaternions as they are stored, unit or not.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = tuple(ROOT / "tests" / "threejs" / f"{name}.mjs" for name in ("judge", "load", "match", "play", "surfaces"))
RATE = 120  # frames per second looked at, besides both ends and every key of both files
TIMEOUT = 300  # s, for one call


@dataclass(frozen=True, slots=True)
class ClipVerdict:
    """The largest displacement in one clip of the truth, in metres: where, and when.

    other: the name of the clip it was compared with; None where there is none, and the other file rests.
    bare_error: the same for the places of nodes on which no vertex hangs.
    """

    name: str
    other: str | None
    duration: float
    other_duration: float | None
    times: int
    max_error: float
    node: str
    vertex: int | None
    time: float | None
    bare_error: float
    bare_node: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """How far a file's motion is from the truth's. diagonal: m, of the truth's vertices at rest.

    by_vertex: all meshes agreed by vertex; else the truth's own vertices were carried by the other file's nodes.
    missing, extra: clips without a counterpart. unmatched: nodes. ignored: channels that three.js does not play.
    """

    diagonal: float
    by_vertex: bool
    clips: tuple[ClipVerdict, ...]
    missing: tuple[str, ...]
    extra: tuple[str, ...]
    unmatched: tuple[str, ...]
    ignored: tuple[str, ...]

    @property
    def max_error(self) -> float:
        """The largest displacement of any vertex in any clip, in metres."""
        return max((clip.max_error for clip in self.clips), default=0.0)

    @property
    def share(self) -> float:
        """The same as a share of the diagonal."""
        return self.max_error / self.diagonal

    @property
    def worst(self) -> ClipVerdict:
        """The clip with the largest displacement."""
        return max(self.clips, key=lambda clip: clip.max_error)


def judge(truth: Path, other: Path, *, rate: float = RATE) -> Verdict:
    """Return how far `other` is from `truth`, .glb or .gltf, in all clips of the truth.

    Clips are matched by name, then by order; nodes by name. Raises RuntimeError with three's words where a file does
    not load, or where vertices hang on nodes that the other file has not.
    """
    if reason := missing():
        raise RuntimeError(reason)
    command = ["node", str(SCRIPTS[0]), str(package()), str(truth), str(other), str(rate)]
    run = subprocess.run(command, capture_output=True, timeout=TIMEOUT, check=False)
    if run.returncode:
        raise RuntimeError(f"{other.name}: {run.stderr.decode(errors='replace').strip()}")
    return _verdict(json.loads(run.stdout))


def vertices(file: Path, *, clip: int, time: float) -> NDArray[np.float32]:
    """Return all vertices (V, 3) at a time of a clip, in world space, in the order in which three.js meets them."""
    command = ["node", str(SCRIPTS[0].with_name("vertices.mjs")), str(package()), str(file), str(clip), str(time)]
    run = subprocess.run(command, capture_output=True, timeout=TIMEOUT, check=True)
    return np.frombuffer(run.stdout, np.float32).reshape(-1, 3)


def _verdict(found: dict[str, Any]) -> Verdict:
    return Verdict(
        diagonal=found["diagonal_m"],
        by_vertex=found["surfaces"] == found["surfaces_by_vertex"],
        clips=tuple(map(_clip, found["clips"])),
        missing=tuple(found["missing_clips"]),
        extra=tuple(found["extra_clips"]),
        unmatched=tuple(found["unmatched_nodes"]),
        ignored=tuple(f"{one['file']}: {one['clip']}: {one['pointer']}" for one in found["ignored_channels"]),
    )


def _clip(found: dict[str, Any]) -> ClipVerdict:
    return ClipVerdict(
        name=found["name"],
        other=found["other"],
        duration=found["duration_s"],
        other_duration=found["other_duration_s"],
        times=found["times"],
        max_error=found["max_error_m"],
        node=found["node"],
        vertex=found["vertex"],
        time=found["time_s"],
        bare_error=found["bare_error_m"],
        bare_node=found["bare_node"],
    )


def missing() -> str:
    """Return why the judge can't sit here, or "" if it can."""
    if shutil.which("node") is None:
        return "node is not installed"
    if package() is None:
        return "three is not installed (npm install three, or set GLTF_THREE_DIR)"
    return ""


@cache
def package() -> Path | None:
    """Return the folder of the npm package `three`, None where it is absent."""
    given = (os.environ.get(name) for name in ("GLTF_THREE_DIR", "GLTF_VALIDATOR_DIR"))
    for root in (*(Path(each).resolve() for each in given if each), ROOT):
        for folder in (root, root / "three", root / "node_modules" / "three"):
            if (folder / "build" / "three.module.js").is_file():
                return folder
    return None


if os.environ.get("REQUIRE_JUDGE") and missing():  # CI must not pass by skipping its judge
    raise RuntimeError(missing())

needs_judge = pytest.mark.skipif(bool(missing()), reason=missing() or "present")

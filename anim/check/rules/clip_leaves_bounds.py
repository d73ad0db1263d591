"""GA209: clips that move a skinned mesh out of its box at rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Floats
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule
from anim.model import Clip

MAX_FRAMES = 200
FPS = 15.0


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips of files with skins, with the largest excess over the limits."""
    motion = file.motion
    if not file.joints or not motion.is_skin or not len(motion.points):
        return
    rest = motion.points.places(motion.rest_world)
    center, edge = _boxes(rest)
    size = float(edge[0].max())
    for report, clip in file.clips:
        centers, edges = _boxes(motion.places(clip, _times(clip)))
        moved = float(np.sqrt(((centers - center) ** 2).sum(axis=1)).max()) / size if size else 0.0
        grown = float(edges.max()) / size if size else 0.0
        if moved > parameters["shift"] or grown > parameters["growth"]:
            yield file.in_clip(report.index, value=max(moved + 0.5, grown / 2))


def _times(clip: Clip) -> Floats:
    count = int(min(max((clip.end - clip.start) * FPS, 1), MAX_FRAMES - 1)) + 1
    return np.linspace(clip.start, clip.end, count)


def _boxes(points: Floats) -> tuple[Floats, Floats]:
    """Centers and edges (F, 3) of the boxes around points (P, F, 3)."""
    least, most = points.min(axis=0), points.max(axis=0)
    return (least + most) / 2, most - least


def problem(found: Sequence[Occurrence]) -> str:
    """Return the number of clips."""
    return f"{len(found)} clip{'s move' if len(found) > 1 else ' moves'} a skinned mesh out of its box at rest"


RULE = Rule(
    "GA209",
    "clip-leaves-bounds",
    Severity.WARNING,
    "A clip moves a skinned mesh out of its box at rest.",
    "Players that cull by the box at rest hide the mesh while it is in view: mrdoob/three.js#14499, "
    "BabylonJS/Babylon.js#11424, bevyengine/bevy#4971.",
    find,
    problem,
    "turn culling off for this mesh, or move its node with it, where the file is made or shown",
    parameters={
        "shift": Parameter(0.5, "x", "motion of the box's center, in edges of the box"),
        "growth": Parameter(1.5, "x", "growth of the longest edge"),
    },
    is_costly=True,
)

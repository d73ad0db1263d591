"""Error between two versions of a clip over time, and the joints that cause it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.measure.error.displacement import CHUNK, DisplacementField
from anim.measure.error.max_displacement import lengths
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import FPS, dense_times
from anim.model import Clip

JOINTS = 4  # number of worst joints with a curve of their own


class JointErrorCurve(NamedTuple):
    """Error of one joint: the largest displacement (F,) m of a vertex with its largest weight on it."""

    joint: str
    error: Floats


class ErrorCurve(NamedTuple):
    """Error of one clip. times: (F,) s. error: (F,) m, the largest of any vertex. joints: worst first."""

    name: str
    times: Floats
    error: Floats
    joints: tuple[JointErrorCurve, ...]


def error_curve(ruler: ErrorMetric, before: Clip, after: Clip, *, player: str = "spec", fps: float = FPS) -> ErrorCurve:
    """Return the error of `after` at each time of `dense_times`, with the interpolation of a player."""
    times = dense_times(before, after, fps=fps)
    courses: dict[int, Floats] = {}
    first = 0
    for block in ruler.blocks(before, after, times, player=player):
        for part in ruler.parts:
            field = part.field(block.old, block.new)
            if field is None:
                continue
            for group, vertices in enumerate(part.groups):
                course = courses.setdefault(part.leader(group), np.zeros(len(times)))
                here = course[first : first + len(block.times)]
                np.maximum(here, _largest(field, group, len(vertices), len(here)), out=here)
        first += len(block.times)
    worst = sorted(courses, key=lambda node: -float(courses[node].max()))[:JOINTS]
    error = np.max(list(courses.values()), axis=0) if courses else np.zeros(len(times))
    moving = (JointErrorCurve(ruler.called(node), courses[node]) for node in worst if courses[node].any())
    return ErrorCurve(before.name, times, error, tuple(moving))


def _largest(field: DisplacementField, group: int, vertices: int, frames: int) -> Floats:
    """The largest length (F,) of a vector of the group in each frame."""
    size = max(CHUNK // vertices, 1)
    starts = range(0, frames, size)
    return np.concatenate([lengths(field, group, np.arange(i, min(i + size, frames))).max(axis=0) for i in starts])

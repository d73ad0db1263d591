"""GA301: single frames that leave the motion around them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rotation_steps import rotation_steps
from anim.check.rule import Parameter, Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such keys."""
    motion = rotation_steps(file)
    q, at = motion.keys, np.flatnonzero(motion.is_inner)
    cubic = (4 * q[at - 1] + 4 * q[at + 1] - q[at - 2] - q[at + 2]) / 6
    off = 2 * np.sqrt(((q[at] - cubic) ** 2).sum(axis=1))
    change = np.sqrt(((motion.steps[at + 2] - motion.steps[at - 1]) ** 2).sum(axis=1))
    there_and_back = np.minimum(motion.angles[at], motion.angles[at + 1]) > off / 2  # not the end of a jump
    apart = (motion.cosines()[at] < -0.5) & there_and_back
    popped = np.zeros(len(q), np.bool_)
    popped[at] = (off > np.radians(parameters["angle"])) & (off > 2 * change) & apart
    yield from file.per_clip(motion.table, motion.table.count(popped))


RULE = Rule(
    "GA301",
    "pops",
    Severity.INFO,
    "A joint leaves its path for a single frame.",
    "One wrong frame of capture or cleanup. Real flicks of fingers and toes look alike: a hint, not an error.",
    find,
    counted("key leaves the motion around it", "keys leave the motion around them"),
    "look at the frame; correct it where the clip is made",
    parameters={"angle": Parameter(4, "deg", "smallest distance from the motion around")},
    is_default=False,
)

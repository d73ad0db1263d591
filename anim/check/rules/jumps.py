"""GA302: single steps far larger than those around."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.arrays import Bools
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rotation_steps import RotationSteps, rotation_steps
from anim.check.rule import Parameter, Parameters, Rule, counted

RATIO = 10.0  # to the two steps on each side


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such steps."""
    yield from file.at_keys((motion.table, _jumps(motion, parameters["angle"])) for motion in rotation_steps(file))


def _jumps(motion: RotationSteps, angle: float) -> Bools:
    """Mask (S,) of the keys at the end of such a step."""
    angles = motion.angles
    around = np.max([np.roll(angles, by) for by in (-2, -1, 1, 2)], axis=0, initial=0.0)
    return np.asarray(motion.is_inner & (angles > np.radians(angle)) & (angles > RATIO * around))


RULE = Rule(
    "GA302",
    "jumps",
    Severity.INFO,
    "A joint rotates far more in one step than in those around it.",
    "Typical of a flip of Euler angles, or of two takes put together.",
    find,
    counted("step is far larger than those around it", "steps are far larger than those around them"),
    "look at the step; correct it where the clip is made",
    parameters={"angle": Parameter(20, "deg", "smallest step")},
    is_default=False,
)

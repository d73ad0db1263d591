"""GA303: joints that tremble."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rotation_steps import rotation_steps
from anim.check.rule import Parameter, Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of trembling tracks."""
    motion = rotation_steps(file)
    reverses = (motion.cosines() < 0) & (motion.angles > np.radians(parameters["angle"]))
    running = reverses
    for shift in range(1, int(parameters["frames"])):
        running = running & np.concatenate((reverses[shift:], np.zeros(min(shift, len(reverses)), np.bool_)))
    yield from file.per_clip(motion.table, (motion.table.count(running) > 0).astype(np.int64))


RULE = Rule(
    "GA303",
    "jitter",
    Severity.INFO,
    "A joint reverses its rotation frame after frame.",
    "Noise of capture, or of a solver (fernandotonon/QtMeshEditor#509).",
    find,
    counted("track trembles", "tracks tremble"),
    "smooth it where the clip is made",
    parameters={
        "angle": Parameter(0.5, "deg", "smallest step that counts"),
        "frames": Parameter(6, "", "reversals in a row"),
    },
    is_default=False,
)

"""GA303: joints that tremble."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rotation_edits import edit_rotations
from anim.check.rotation_steps import RotationSteps, rotation_steps
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.gltf.document import Document


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of trembling tracks."""
    running = ((motion.table, _running(motion, parameters)) for motion in rotation_steps(file))
    yield from file.at_keys(running, lambda counts: (counts > 0).astype(np.int64))


def _running(motion: RotationSteps, parameters: Parameters) -> Bools:
    """Mask (S,) of the first keys of runs of reversals."""
    reverses = (motion.cosines() < 0) & (motion.angles > np.radians(parameters["angle"]))
    running = reverses
    for shift in range(1, int(parameters["frames"])):
        running = running & np.concatenate((reverses[shift:], np.zeros(min(shift, len(reverses)), np.bool_)))
    return np.asarray(running)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with the keys of these runs averaged with their neighbors."""
    frames = int(parameters["frames"])

    def in_runs(motion: RotationSteps) -> Bools:
        running = _running(motion, parameters)
        marked = np.any([_later(running, by) for by in range(frames)], axis=0)
        return np.asarray(marked & motion.is_inner)

    return edit_rotations(file, found, in_runs, _averaged)


def _averaged(keys: Floats, marked: Bools) -> Floats:
    at = np.flatnonzero(marked)
    return np.asarray((keys[at - 1] + 2 * keys[at] + keys[at + 1]) / 4)


def _later(mask: Bools, by: int) -> Bools:
    """The mask, some keys later."""
    return np.concatenate((np.zeros(min(by, len(mask)), np.bool_), mask[: max(len(mask) - by, 0)]))


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
    fix=Fix("average the keys with their neighbors", fix, is_safe=False),
)

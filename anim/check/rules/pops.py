"""GA301: single frames that leave the motion around them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rotation_edits import edit_rotations
from anim.check.rotation_steps import RotationSteps, rotation_steps
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.gltf.document import Document


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such keys."""
    yield from file.at_keys((motion.table, _popped(motion, parameters["angle"])[0]) for motion in rotation_steps(file))


def _cubic(keys: Floats, at: Ints) -> Floats:
    """Values (A, 4) at some keys of the cubics through two neighbors on each side."""
    return np.asarray((4 * keys[at - 1] + 4 * keys[at + 1] - keys[at - 2] - keys[at + 2]) / 6)


def _popped(motion: RotationSteps, angle: float) -> tuple[Bools, Floats]:
    """Mask (S,) of keys that leave the motion around them, and their distance (S,) from it in rad."""
    at = np.flatnonzero(motion.is_inner)
    off = 2 * np.sqrt(((motion.keys[at] - _cubic(motion.keys, at)) ** 2).sum(axis=1))
    change = np.sqrt(((motion.steps[at + 2] - motion.steps[at - 1]) ** 2).sum(axis=1))
    there_and_back = np.minimum(motion.angles[at], motion.angles[at + 1]) > off / 2  # not the end of a jump
    apart = (motion.cosines()[at] < -0.5) & there_and_back
    popped, distances = np.zeros(len(motion.keys), np.bool_), np.zeros(len(motion.keys))
    popped[at], distances[at] = (off > np.radians(angle)) & (off > 2 * change) & apart, off
    return popped, distances


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with these keys on the cubic through two neighbors on each side."""
    return edit_rotations(file, found, lambda motion: _isolated(*_popped(motion, parameters["angle"])), _on_cubic)


def _isolated(popped: Bools, off: Floats) -> Bools:
    """The marked keys that are farther off than marked ones within two keys."""
    sizes = np.where(popped, off, 0.0)
    around = np.max([np.roll(sizes, by) for by in (-2, -1, 1, 2)], axis=0, initial=0.0)
    return np.asarray(popped & (sizes >= around))


def _on_cubic(keys: Floats, marked: Bools) -> Floats:
    return _cubic(keys, np.flatnonzero(marked))


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
    fix=Fix("move the key to the cubic through its neighbors", fix, is_safe=False),
)

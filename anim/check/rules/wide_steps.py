"""GA101: rotations of 170° or more between two keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks, put_between
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.measure.inspect.track_statistics import WIDE_STEP_RAD
from anim.model import Interpolation


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips, at their first such step."""
    counts = {clip.index: clip.wide_steps for clip in file.facts.clips}
    yield from file.at_rotation_steps(counts, Interpolation.LINEAR, _is_wide)


def _is_wide(dots: Floats) -> Bools:
    return np.asarray(2 * np.arccos(np.minimum(np.abs(dots), 1.0)) > WIDE_STEP_RAD)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a key in the middle of each wide step, by slerp."""
    return edit_tracks(file, found, lambda track: put_between(track, WIDE_STEP_RAD))


RULE = Rule(
    "GA101",
    "wide-steps",
    Severity.WARNING,
    "Rotations of 170° or more between two keys.",
    "Players take different ways round: KhronosGroup/glTF-Blender-IO#1253, KhronosGroup/glTF#1515, "
    "godotengine/godot#87813.",
    find,
    counted("rotation of 170° or more between keys", "rotations of 170° or more between keys"),
    "players may differ on the shorter arc; to add keys: gltf-anim resample IN OUT --fps {finer}{clips}",
    fix=Fix("add a key in the middle by slerp", fix, is_safe=True),
)

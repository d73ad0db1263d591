"""GA103: sign changes between rotation keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.maths import quaternion
from anim.model import Interpolation, Track


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips, at their first sign change."""
    counts = {clip.index: clip.sign_flips - clip.sign_flips_in_splines for clip in file.facts.clips}
    yield from file.at_rotation_steps(counts, Interpolation.LINEAR, lambda dots: dots < 0)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with signs that follow each other along LINEAR tracks."""
    return edit_tracks(file, found, _same_signs)


def _same_signs(track: Track) -> Track:
    if track.path != "rotation" or track.interpolation is not Interpolation.LINEAR:
        return track
    signs = np.where(quaternion.dot(track.values[1:], track.values[:-1]) < 0, -1.0, 1.0)
    values = track.values * np.cumprod([1.0, *signs])[:, None]
    return track.with_keys(track.time_axis, values) if (signs < 0).any() else track


RULE = Rule(
    "GA103",
    "sign-flips",
    Severity.INFO,
    "Quaternions change sign between two keys.",
    "q and −q are one rotation: slerp sees no difference, players that blend components take the long way "
    "(KhronosGroup/glTF-Blender-IO#67).",
    find,
    counted("quaternion sign change between keys", "quaternion sign changes between keys"),
    "harmless for slerp; for players that blend components: gltf-anim resample IN OUT --fps {fps}{clips}",
    fix=Fix("negate quaternions, so that signs do not change", fix, is_safe=True),
)

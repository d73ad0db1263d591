"""GA103: sign changes between rotation keys."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.sign_flips - clip.sign_flips_in_splines:
            yield file.in_clip(clip.index, count)


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
)

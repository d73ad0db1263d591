"""GA118: morph weights outside 0 … 1."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted
from anim.model import Track, parse_weight_pointer

TOLERANCE = 1e-6


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such keys."""
    for report, clip in file.clips:
        weights = [track.values for track in clip.tracks if _moves_weights(track)]
        outside = [((values < -TOLERANCE) | (values > 1 + TOLERANCE)).any(axis=1).sum() for values in weights]
        if keys := int(sum(outside)):
            yield file.in_clip(report.index, keys)


def _moves_weights(track: Track) -> bool:
    return track.path == "weights" or (track.pointer is not None and parse_weight_pointer(track.pointer) is not None)


RULE = Rule(
    "GA118",
    "weights-out-of-range",
    Severity.INFO,
    "Keys have morph weights below 0 or above 1.",
    "glTF allows them. gltfpack, Blender and Unity clamp them, so that the motion differs.",
    find,
    counted("key has a morph weight outside 0 … 1", "keys have morph weights outside 0 … 1"),
    "scale the morph targets where the file is made, so that weights stay within 0 … 1",
)

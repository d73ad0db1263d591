"""GA105: clips whose first key is late."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule

MIN_LATE_START_S = 5e-4  # s; starts below come from rounding, and no display shows them


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if clip.start_s > MIN_LATE_START_S:
            yield file.in_clip(clip.index, value=clip.start_s, time_s=0.0)


def problem(found: Sequence[Occurrence]) -> str:
    """Return the range of the first keys."""
    starts = [each.value for each in found]
    least, most = (f"{each:.4f}".rstrip("0").rstrip(".") for each in (min(starts), max(starts)))
    return f"first key at {least if least == most else f'{least} to {most}'} s: players hold the first pose until then"


RULE = Rule(
    "GA105",
    "late-start",
    Severity.INFO,
    "The first key of a clip is later than 0 s.",
    "glTF counts from 0: the first pose stands still until then. Players differ: KhronosGroup/glTF#1327, #1408, "
    "KhronosGroup/glTF-Blender-IO#387.",
    find,
    problem,
    "if unintended: gltf-anim trim IN OUT --rebase",
    targets={"unity": Severity.WARNING},
)

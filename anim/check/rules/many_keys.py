"""GA110: tracks with more keys a second than a display shows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule

MIN_KEYS = 10  # of a track, for a rate


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with their highest rate."""
    for report, clip in file.clips():
        axes = [axis.times for axis in clip.time_axes if len(axis.times) >= MIN_KEYS]
        rates = [(len(times) - 1) / float(times[-1] - times[0]) for times in axes]
        if rates and max(rates) > parameters["rate"]:
            yield file.in_clip(report.index, value=max(rates))


def problem(found: Sequence[Occurrence]) -> str:
    """Return the highest rate."""
    return f"up to {max(each.value for each in found):.0f} keys per second"


RULE = Rule(
    "GA110",
    "many-keys",
    Severity.INFO,
    "Tracks have more keys per second than displays show.",
    "Godot bakes clips to 30 per second, raylib to 60. More keys cost bytes and are not seen.",
    find,
    problem,
    "to keep those that a vertex needs: gltf-anim optimize IN OUT",
    parameters={"rate": Parameter(61, "", "keys per second")},
)

"""GA120: sign changes between keys of CUBICSPLINE rotations."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted
from anim.model import Interpolation


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips, at their first sign change."""
    counts = {clip.index: clip.sign_flips_in_splines for clip in file.facts.clips}
    yield from file.at_rotation_steps(counts, Interpolation.CUBICSPLINE, lambda dots: dots < 0)


RULE = Rule(
    "GA120",
    "sign-flips-in-splines",
    Severity.WARNING,
    "Quaternions change sign between two keys of a CUBICSPLINE track.",
    "Splines interpolate components, so that the rotation takes the long way there: raysan5/raylib#3920.",
    find,
    counted(
        "quaternion sign change between keys of a CUBICSPLINE track",
        "quaternion sign changes between keys of CUBICSPLINE tracks",
    ),
    "the spline takes the long arc there; to compute new tangents: gltf-anim spline IN OUT{clips}",
)

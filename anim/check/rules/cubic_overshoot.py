"""GA115: cubic segments that leave the range of their keys."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.maths import hermite
from anim.model import Clip, Interpolation, Track

SAMPLES = np.linspace(0, 1, 17)[1:-1, None, None]  # of a segment: a cubic's extremum is flat, so this is close


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such tracks."""
    for report, clip in file.clips:
        splines = [track for track in clip.tracks if track.interpolation is Interpolation.CUBICSPLINE]
        excesses = [(excess, track) for track in splines if (excess := overshoot(track)) > parameters["excess"]]
        if excesses:
            _, worst = max(excesses, key=operator.itemgetter(0))
            yield file.in_clip(report.index, len(excesses), node=worst.node)


def overshoot(track: Track) -> float:
    """Return the largest distance of a spline from the range of its keys, as a fraction of that range."""
    if track.interpolation is not Interpolation.CUBICSPLINE or track.path == "rotation" or len(track.times) < 2:
        return 0.0
    if track.in_tangents is None or track.out_tangents is None:
        return 0.0
    h = np.diff(track.times)[:, None]
    values = track.values
    between = hermite.evaluate(SAMPLES, values[:-1], h * track.out_tangents[:-1], values[1:], h * track.in_tangents[1:])
    least, most = values.min(axis=0), values.max(axis=0)
    excess = np.maximum(between.max(axis=(0, 1)) - most, least - between.min(axis=(0, 1)))
    moving = most - least > 1e-6 * (np.abs(values).max() + 1e-30)
    return float((excess[moving] / (most - least)[moving]).max(initial=0.0))


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with monotone tangents in these tracks, as by `spline`."""
    return edit_clips(file, found, lambda clip: _within_range(clip, parameters["excess"]))


def _within_range(clip: Clip, excess: float) -> Clip:
    from anim.operations.spline import spline  # only fixes import operations

    tracks = frozenset(i for i, track in enumerate(clip.tracks) if overshoot(track) > excess)
    return spline(clip, tangents="monotone", tracks=tracks)


RULE = Rule(
    "GA115",
    "cubic-overshoot",
    Severity.INFO,
    "CUBICSPLINE tracks leave the range of their keys.",
    "Often wrong tangents: KhronosGroup/glTF-Blender-IO#361, #735. Morph weights then leave 0 … 1, and feet the floor.",
    find,
    counted("CUBICSPLINE track leaves the range of its keys", "CUBICSPLINE tracks leave the range of their keys"),
    "if unintended: gltf-anim spline IN OUT --tangents monotone{clips}",
    parameters={"excess": Parameter(0.1, "%", "distance from the range, as a fraction of it")},
    fix=Fix("give them monotone tangents", fix, is_safe=False),
)

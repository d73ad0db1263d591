"""GA305: loops whose root creeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule
from anim.gltf.document import Document
from anim.measure.inspect.root_motion import figure_nodes, root_motions
from anim.model import Clip, Track
from anim.units import format_number

VISIBLE_GAP = 1e-3  # of the model's size: larger gaps are no loop


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips that are closed but for a small displacement of the root."""
    for clip in file.facts.clips:
        way = clip.root_distance_m / file.diagonal if file.diagonal else 0.0
        closed = clip.duration_s > 0 and clip.seam_m <= VISIBLE_GAP * file.diagonal
        if closed and parameters["least"] < way < parameters["most"]:
            yield file.in_clip(clip.index, value=way)


def problem(found: Sequence[Occurrence]) -> str:
    """Return the largest displacement."""
    percent = format_number(100 * max(each.value for each in found), 2)
    return f"the root moves by {percent} % of the model's size each time round"


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without this displacement, taken off evenly over each clip."""
    return edit_clips(file, found, lambda clip: _in_place(clip, file))


def _in_place(clip: Clip, file: CheckedFile) -> Clip:
    (motion,) = root_motions(file.skeleton, [clip], figure=figure_nodes(file.json, file.skeleton))
    tracks = [
        _without_displacement(track) if track.node == motion.root and track.path == "translation" else track
        for track in clip.tracks
    ]
    return replace(clip, tracks=tuple(tracks))


def _without_displacement(track: Track) -> Track:
    times, away = track.times, track.values[-1] - track.values[0]
    speed = away / (times[-1] - times[0])
    values = track.values - (times - times[0])[:, None] * speed
    tangents = [None if each is None else each - speed for each in (track.in_tangents, track.out_tangents)]
    return track.with_keys(track.time_axis, values, *tangents)


RULE = Rule(
    "GA305",
    "residual-root-motion",
    Severity.INFO,
    "A loop in place moves its root a little each time round.",
    "Players that add up root motion let the figure creep away.",
    find,
    problem,
    "keep the root in place where the clip is made",
    parameters={
        "least": Parameter(1e-3, "%", "smallest displacement, of the model's size"),
        "most": Parameter(0.05, "%", "largest displacement; more is travel"),
    },
    is_default=False,
    fix=Fix("take it off evenly over the clip", fix, is_safe=False),
)

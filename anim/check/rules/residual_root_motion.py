"""GA305: loops whose root creeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule
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
)

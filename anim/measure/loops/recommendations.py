"""Recommendations for loops: command lines with IN and OUT for the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from anim.measure.loops.loop_kind import LoopKind
from anim.model import Clip

if TYPE_CHECKING:  # checks give the advice without the analysis
    from anim.measure.loops.loop_analysis import Loop

BLEND_S = 0.25  # s over which a gap is closed, in clips of at least four times that
MAX_VELOCITY_GAP = 3.0  # of the median speed of the fastest vertex; a larger one is visible
MIN_VELOCITY_GAP_M_S = 1e-3  # m/s; rounding of static clips is below

_CLOSING = "gltf-anim loop IN OUT{blend}{clips}"
ADVICE = {  # with {blend} and {clips} for the options
    LoopKind.OPEN_BY_ONE_FRAME: "to add the last frame that is missing: gltf-anim loop IN OUT{clips}",
    LoopKind.CLOSED_EXCEPT: f"to close the joints that are open: {_CLOSING}",
    LoopKind.NOT_A_LOOP: f"if it is to loop: {_CLOSING}",
    LoopKind.CLOSED: f"to close a velocity gap of more than {MAX_VELOCITY_GAP:g} times the usual speed: {_CLOSING}",
}


def recommend(found: Sequence[tuple[int, Loop]], *, fps: float | None = None) -> Iterator[str]:
    """Yield a line for each kind of open clips, in pose or velocity. found: indices and analysis. fps: if it was given.

    recommend([(0, open_by_one_frame)]) → "to add the last frame that is missing: gltf-anim loop IN OUT --clip '#0'"
    """
    rate = "" if fps is None else f" --fps {fps:.12g}"  # at which these kinds are found again
    for kind, advice in ADVICE.items():
        of_kind = [(number, each) for number, each in found if each.kind is kind and _is_open(each)]
        if of_kind:
            clips = "".join(f" --clip '#{number}'" for number, _ in of_kind)  # all: others stay unchanged
            blend = blend_option([each.end - each.start for _, each in of_kind])
            yield advice.format(blend=blend, clips=f"{rate}{clips}")


def _is_open(loop: Loop) -> bool:
    """Return whether pose or velocity of the end differ from those of the start."""
    usual_speed = loop.inside.typical * loop.fps
    return loop.kind is not LoopKind.CLOSED or loop.speed_seam > max(
        MAX_VELOCITY_GAP * usual_speed, MIN_VELOCITY_GAP_M_S
    )


def closing_command(clip: Clip, number: int) -> str:
    """Return the command that closes a clip of any kind."""
    return _CLOSING.format(blend=blend_option([clip.end - clip.start]), clips=f" --clip '#{number}'")


def blend_option(durations: Sequence[float]) -> str:
    """Return the option --blend for clips of these durations in seconds."""
    return f" --blend {min(map(blend_duration, durations)):.3g}"


def blend_duration(duration: float) -> float:
    """Return the time in s over which the gap of a clip of some duration in s is closed."""
    return min(BLEND_S, duration / 4)

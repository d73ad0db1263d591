"""Recommendations for loops: command lines with IN and OUT for the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.measure.loops.loop_analysis import Loop, LoopKind
from anim.model import Clip

BLEND_S = 0.25  # s over which a gap is closed, in clips of at least four times that
MAX_VELOCITY_GAP = 3.0  # of the median speed of the fastest vertex; a larger one is visible
MIN_VELOCITY_GAP_M_S = 1e-3  # m/s; rounding of static clips is below

_WORDS = {
    LoopKind.OPEN_BY_ONE_FRAME: "to add the last frame that is missing",
    LoopKind.CLOSED_EXCEPT: "to close the joints that are open",
    LoopKind.NOT_A_LOOP: "if it is to loop",
    LoopKind.CLOSED: f"to close a velocity gap of more than {MAX_VELOCITY_GAP:g} times the usual speed",
}


def recommend(found: Sequence[tuple[int, Loop]]) -> Iterator[str]:
    """Yield a line for each kind of open clips, in pose or velocity. found: indices and analysis.

    recommend([(0, open_by_one_frame)]) → "to add the last frame that is missing: gltf-anim loop IN OUT --clip '#0'"
    """
    for kind, words in _WORDS.items():
        of_kind = [(number, each) for number, each in found if each.kind is kind and _is_open(each)]
        if of_kind:
            durations = [each.end - each.start for _, each in of_kind]
            blend = "" if kind is LoopKind.OPEN_BY_ONE_FRAME else _blend(durations)
            clips = "".join(f" --clip '#{number}'" for number, _ in of_kind)  # all: others stay unchanged
            yield f"{words}: gltf-anim loop IN OUT{blend}{clips}"


def _is_open(loop: Loop) -> bool:
    """Return whether pose or velocity of the end differ from those of the start."""
    usual_speed = loop.inside.typical * loop.fps
    return loop.kind is not LoopKind.CLOSED or loop.speed_seam > max(
        MAX_VELOCITY_GAP * usual_speed, MIN_VELOCITY_GAP_M_S
    )


def closing_command(clip: Clip, number: int) -> str:
    """Return the command that closes a clip of any kind."""
    return f"gltf-anim loop IN OUT{_blend([clip.end - clip.start])} --clip '#{number}'"


def _blend(durations: Sequence[float]) -> str:
    """The option --blend for clips of these durations in seconds."""
    return f" --blend {min(BLEND_S, *(duration / 4 for duration in durations)):.3g}"

"""Verdicts on loops → what to do: the lines of commands of ours, with IN and OUT for the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.measure.loops.loop_analysis import Loop, LoopKind
from anim.model import Clip

BLEND_S = 0.25  # over which a seam is closed, where the clip is four times as long or more

_WORDS = {
    LoopKind.OPEN_BY_ONE_FRAME: "to add the last frame that is missing",
    LoopKind.CLOSED_EXCEPT: "to bend the joints that stay open",
    LoopKind.NOT_A_LOOP: "if it is to loop",
}


def recommend(found: Sequence[tuple[int, Loop]]) -> Iterator[str]:
    """Yield a line for each kind of whole clips that don't close. found: the clips' numbers, and verdicts.

    advice([(0, lacking_its_last_frame)]) → "to add the last frame that is missing: gltf-anim loop IN OUT --clip '#0'"
    """
    for kind, words in _WORDS.items():
        of_kind = [(number, each) for number, each in found if each.kind is kind]
        if of_kind:
            durations = [each.end - each.start for _, each in of_kind]
            blend = "" if kind is LoopKind.OPEN_BY_ONE_FRAME else _blend(durations)
            clips = "".join(f" --clip '#{number}'" for number, _ in of_kind)  # all: others must stay as they are
            yield f"{words}: gltf-anim loop IN OUT{blend}{clips}"


def closing_command(clip: Clip, number: int) -> str:
    """Return what makes a clip end as it starts, whatever its kind."""
    return f"gltf-anim loop IN OUT{_blend([clip.end - clip.start])} --clip '#{number}'"


def _blend(durations: Sequence[float]) -> str:
    """The option, for clips that last so many seconds."""
    return f" --blend {min(BLEND_S, *(duration / 4 for duration in durations)):.3g}"

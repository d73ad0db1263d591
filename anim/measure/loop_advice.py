"""Verdicts on loops → what to do: the lines of commands of ours, with IN and OUT for the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.measure.loop import Loop, LoopKind

BLEND_S = 0.25  # over which a seam is closed, where the clip is four times as long or more

_WORDS = {
    LoopKind.OPEN_BY_ONE_FRAME: "to add the last frame that is missing",
    LoopKind.CLOSED_EXCEPT: "to bend the joints that stay open",
    LoopKind.NOT_A_LOOP: "if it is to loop",
}


def advice(found: Sequence[tuple[int, Loop]]) -> Iterator[str]:
    """Yield a line for each kind of whole clips that don't close. found: the clips' numbers, and verdicts.

    advice([(0, lacking_its_last_frame)]) → "to add the last frame that is missing: gltf-anim loop IN OUT --clip '#0'"
    """
    for kind, words in _WORDS.items():
        of_kind = [(number, each) for number, each in found if each.kind is kind]
        if of_kind:
            seconds = min([BLEND_S, *((each.end - each.start) / 4 for _, each in of_kind)])
            blend = "" if kind is LoopKind.OPEN_BY_ONE_FRAME else f" --blend {seconds:.3g}"
            clips = "".join(f" --clip '#{number}'" for number, _ in of_kind)  # all: others must stay as they are
            yield f"{words}: gltf-anim loop IN OUT{blend}{clips}"

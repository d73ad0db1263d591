"""GA108: loops whose last frame is missing, or duplicate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import replace_clips
from anim.check.finding import Occurrence, Severity
from anim.check.loop_gaps import describe_gap, gaps_by_clip
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.end_frames import EndFrame, EndFrameKind
from anim.measure.loops.loop_kind import LoopKind
from anim.measure.loops.recommendations import ADVICE
from anim.model import Clip

MAX_DEVIATION_FRAMES = 0.1  # of a key from the frame that it represents


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips without their last frame."""
    gaps = gaps_by_clip(file, list(file.missing_frames))
    for i, frame in file.missing_frames.items():
        node = gaps[i][0].node if gaps[i] else None
        yield _in_clip(file, i, frame, node)


def find_duplicates(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with two last frames."""
    for i, frame in file.duplicate_frames.items():
        yield replace(_in_clip(file, i, frame, None), advice=_removal(i, frame_before(file.contents.clips[i], frame)))


def _in_clip(file: CheckedFile, number: int, frame: EndFrame, node: int | None) -> Occurrence:
    end = file.contents.clips[number].end
    return file.in_clip(number, value=frame.gap / file.diagonal, problem=frame.kind, time_s=end, node=node)


def _removal(number: int, end: float) -> str:
    """Advice for a duplicate frame. number: index of the clip. end: time of the frame before, s."""
    return f"to remove the frame: gltf-anim trim IN OUT --to {end:.9g}{reader.choose_option([number])}"


def problem(found: Sequence[Occurrence]) -> str:
    """Return the fault, which is the same in all occurrences, and the largest gap."""
    if found[0].problem == EndFrameKind.DUPLICATE:
        return "two frames at the end have the first pose: a loop pauses for a frame"
    return f"{LoopKind.OPEN_BY_ONE_FRAME}: {describe_gap(found)}"


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with the first pose as a last frame of these clips, or without their last frame."""
    frames = {**file.missing_frames, **file.duplicate_frames}
    clips = {each.number: file.contents.clips[each.number] for each in found}
    return replace_clips(file, {i: _corrected(clip, frames[i], file) for i, clip in clips.items()})


def _corrected(clip: Clip, frame: EndFrame, file: CheckedFile) -> Clip:
    from anim.operations.loop import append_first_frame  # only fixes import operations
    from anim.operations.trim import trim

    if frame.kind is EndFrameKind.DUPLICATE:
        return trim(clip, end=frame_before(clip, frame))
    return append_first_frame(clip, fps=1 / frame.duration, root=root_motion_node(file.skeleton, clip))


def frame_before(clip: Clip, frame: EndFrame) -> float:
    """Return the time of the frame before the last one, in s: of the key nearest to it, if one is near."""
    time = clip.end - frame.duration
    keys = clip.key_times
    nearest = float(keys[np.abs(keys - time).argmin()])
    return nearest if abs(nearest - time) < MAX_DEVIATION_FRAMES * frame.duration else time


RULE = Rule(
    "GA108",
    "end-frame",
    Severity.INFO,
    "A clip lacks the frame that would close its loop, or has it twice.",
    "Loops that are exported without their last frame jump by one frame each time round; with two of them they pause.",
    find,
    problem,
    ADVICE[LoopKind.OPEN_BY_ONE_FRAME],
    find_costly=find_duplicates,
    fix=Fix("add the first pose as a frame, or remove the second one", fix, is_safe=False),
)

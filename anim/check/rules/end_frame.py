"""GA108: loops whose last frame is missing, or duplicate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import replace_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.equal_clips import first_equal
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.end_frames import EndFrame, EndFrameKind, find_end_frames
from anim.model import Clip

MAX_DEVIATION_FRAMES = 0.1  # of a key from the frame that it represents
PROBLEMS = {
    EndFrameKind.MISSING: "the clip is open by one frame",
    EndFrameKind.DUPLICATE: "two frames at the end have the first pose: a loop pauses for a frame",
}
ADVICE = {
    EndFrameKind.MISSING: "to add the frame: gltf-anim loop IN OUT{clip}",
    EndFrameKind.DUPLICATE: "to remove the frame: gltf-anim trim IN OUT --to {end:.9g}{clip}",
}


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for number, clip, frame in _end_frames(file):
        found = file.in_clip(number, value=frame.gap, problem=PROBLEMS[frame.kind], time_s=clip.end)
        advice = ADVICE[frame.kind].format(clip=reader.choose_option([number]), end=frame_before(clip, frame))
        yield replace(found, advice=advice)


def _end_frames(file: CheckedFile) -> Iterator[tuple[int, Clip, EndFrame]]:
    clips = [(report.index, clip) for report, clip in file.clips]
    first = first_equal([(clip,) for _, clip in clips])
    distinct = {n: clip for n, (_, clip) in enumerate(clips) if first[n] == n}
    roots = [root_motion_node(file.skeleton, clip) for clip in distinct.values()]
    frames = dict(zip(distinct, find_end_frames(file.motion, list(distinct.values()), roots), strict=True))
    for n, (number, clip) in enumerate(clips):
        if (frame := frames[first[n]]) is not None:
            yield number, clip, frame


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with the first pose as a last frame of these clips, or without their last frame."""
    wanted = {each.number for each in found}
    return replace_clips(
        file, {i: _corrected(clip, frame, file) for i, clip, frame in _end_frames(file) if i in wanted}
    )


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
    is_costly=True,
    fix=Fix("add the first pose as a frame, or remove the second one", fix, is_safe=False),
)

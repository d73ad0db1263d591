"""GA108: loops whose last frame is missing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.loop_analysis import VISIBLE_GAP_PER_SIZE, LoopKind, analyze_loop
from anim.model import Clip
from anim.operations.close_loop import close_loop


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips that `loop` calls open by one frame."""
    for report, clip in file.clips():
        if report.seam_m > VISIBLE_GAP_PER_SIZE * file.motion.size:
            loop = analyze_loop(file.motion, clip, root=root_motion_node(file.skeleton, clip))
            if loop.kind is LoopKind.OPEN_BY_ONE_FRAME:
                yield file.in_clip(report.index, value=loop.seam, time_s=loop.end)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with the first pose as a last frame of these clips, as by `loop`."""
    return edit_clips(file, found, lambda clip: _close(clip, file))


def _close(clip: Clip, file: CheckedFile) -> Clip:
    root = root_motion_node(file.skeleton, clip)
    return close_loop(clip, analyze_loop(file.motion, clip, root=root), root=root)


RULE = Rule(
    "GA108",
    "missing-end-frame",
    Severity.INFO,
    "A clip lacks the frame that would close its loop.",
    "Loops that are exported without their last frame jump by one frame each time round.",
    find,
    counted("clip is open by one frame", "clips are open by one frame"),
    "to add the frame: gltf-anim loop IN OUT{clips}",
    is_costly=True,
    fix=Fix("add the frame", fix, is_safe=False),
)

"""GA107: clips that nearly loop."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

from anim.check.advice import MIN_REGULAR_FRACTION
from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips
from anim.check.finding import Occurrence, Severity
from anim.check.loop_gaps import describe_gap, gaps_by_clip
from anim.check.rule import Fix, Parameter, Parameters, Rule
from anim.gltf.document import Document
from anim.measure.inspect.frame_rate import GRID_TOLERANCE_FRAMES, estimate_frame_rate, usual_frame_rate
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.loop_kind import LoopKind
from anim.measure.loops.recommendations import ADVICE, BLEND_S, blend_duration
from anim.model import Clip

LOOP_NAME = r"(?i)(^|[^a-z])(loop|cycle|idle)([^a-z]|$)"
MIN_FPS = 20.0  # of the keys added there
MIN_FRAMES = 2  # in it: the last one has the speed of the first one of the clip


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with a small loop gap, and those that loop by name and don't; not those of GA108."""
    sizes = {clip.index: clip.seam_m / file.diagonal if file.diagonal else 0.0 for clip in file.facts.clips}
    found = [
        clip
        for clip in file.facts.clips
        if (sizes[clip.index] < parameters["limit"] or re.search(LOOP_NAME, clip.name) is not None)
        and sizes[clip.index] > parameters["gap"]
        and clip.duration_s > 0
    ]
    found = [clip for clip in found if clip.index not in file.missing_frames]
    gaps = gaps_by_clip(file, [clip.index for clip in found if clip.seam_measured_on == "skin"])
    for clip in found:
        joints = gaps.get(clip.index)
        node = joints[0].node if joints else None
        yield file.in_clip(clip.index, value=sizes[clip.index], time_s=clip.end_s, node=node)


def problem(found: Sequence[Occurrence]) -> str:
    """Return the largest gap."""
    return describe_gap(found)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with the end of these clips corrected, as by `loop --blend`."""
    return edit_clips(file, found, lambda clip: _close(clip, file))


def _close(clip: Clip, file: CheckedFile) -> Clip:
    from anim.measure.loops.loop_analysis import analyze_loop
    from anim.operations.close_loop import close_loop  # only fixes import these

    root = root_motion_node(file.skeleton, clip)
    fps = _frame_rate(clip)
    blend = blend_duration(clip.end - clip.start) if fps is None else _whole_frames(clip, fps)
    return close_loop(clip, analyze_loop(file.motion, clip, root=root), root=root, blend=blend, frame_rate=fps)


def _frame_rate(clip: Clip) -> float | None:
    """Rate of a grid with all keys of the clip; None without one. Keys added on it leave nothing for GA109 to fix."""
    duration = clip.end - clip.start
    if (usual := usual_frame_rate(clip.key_times, MIN_FPS)) is not None:
        fps = usual
    elif (estimated := estimate_frame_rate(clip.key_times)) is None:
        fps = round(duration * MIN_FPS) / duration  # the start and the end are its only keys
    else:
        fps = estimated.fps if estimated.regular >= MIN_REGULAR_FRACTION else 0.0
    return fps if duration * fps > MIN_FRAMES - GRID_TOLERANCE_FRAMES else None


def _whole_frames(clip: Clip, fps: float) -> float:
    """Length of a blend of about `blend_duration` that starts on a frame, in s."""
    frames = (clip.end - clip.start) * fps
    blended = max(blend_duration(clip.end - clip.start) * fps, MIN_FRAMES)
    first = max(math.floor(frames - blended + GRID_TOLERANCE_FRAMES), 0)
    return min((frames - first) / fps, clip.end - clip.start)


RULE = Rule(
    "GA107",
    "loop-seam",
    Severity.WARNING,
    "Clips nearly loop: the last pose is close to the first, but not equal.",
    "The jump is visible each time round: KhronosGroup/glTF#573, KhronosGroup/glTF-Blender-IO#1901.",
    find,
    problem,
    ADVICE[LoopKind.NOT_A_LOOP],
    parameters={
        "gap": Parameter(0.001, "%", "smallest visible jump, of the model's size"),
        "limit": Parameter(0.05, "%", "largest jump of a clip that nearly loops, of the model's size"),
    },
    fix=Fix(f"correct the last {BLEND_S:g} s to end as they start", fix, is_safe=False),
)

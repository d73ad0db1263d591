"""Loop analysis: kind of loop, size of the loop gap, and the time ranges that loop best."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import Floats
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.joint_gaps import JointGap, moving_nodes
from anim.measure.loops.loop_criteria import (
    NOISE_PER_SIZE,
    VISIBLE_GAP_PER_SIZE,
    are_few,
    frame_duration,
    is_one_frame,
    loop_frame_rate,
    open_joints,
)
from anim.measure.loops.seam import Seam, measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip
from anim.sampling.pose import sample_pose
from anim.sampling.world import world_by_node

INVISIBLE_GAP_PER_FRAME = 0.1  # of the usual motion per frame: a gap between those two is visible above this
MAX_COUNT = 10**12  # frames that indices in float64 tell apart
MAX_FRAMES = 600  # frames that `best_ranges` compares
MAX_STEPS = 300  # pairs of frames, and keys, that are measured inside a clip
MIN_INTERIOR_S = 2e-4  # s, from an end to a key inside


class LoopKind(StrEnum):
    """Kind of a loop, by the difference between a clip's end and its start."""

    CLOSED = "closed"
    OPEN_BY_ONE_FRAME = "open by one frame"
    CLOSED_EXCEPT = "closed except some joints"
    NOT_A_LOOP = "not a loop"
    SINGLE_POSE = "a single pose"


@dataclass(frozen=True, slots=True)
class Steps:
    """Largest motion of any vertex from frame to frame.

    largest, typical: m, maximum and median over all frames. speed: m/s, the largest change of velocity at a key,
    measured like the velocity gap.
    """

    largest: float = 0.0
    typical: float = 0.0
    speed: float = 0.0


@dataclass(frozen=True, slots=True)
class Loop:
    """A clip, or a time range of it, as a loop, measured on the skin.

    start, end: seconds. seam: m, loop gap: the largest distance of a vertex from its position at the start, without
    root motion. speed_seam: m/s, velocity gap. node: joint with the largest gap, by velocity if the loop is closed.
    frame: m, the motion per frame at the gap. inside: the motion from frame to frame. travel: m, root motion. fps: the
    frame rate of the analysis. joints: those that are open, the largest gap first; none of a closed loop.
    """

    kind: LoopKind
    start: float
    end: float
    seam: float
    speed_seam: float
    node: str
    frame: float
    inside: Steps
    travel: float
    fps: float
    joints: tuple[JointGap, ...] = ()


def analyze_loop(skin: SkinMotion, clip: Clip, *, root: int = -1) -> Loop:
    """Return the kind of loop of a clip.

    Closed: no visible jump of a vertex. Closed except some joints: fewer joints are open than close while they move,
    and they jump no further than the clip moves from frame to frame. Open by one frame: the gap is about the next
    frame's motion. root: node whose displacement is ignored, −1 for none.
    """
    return _judge(skin, clip, clip.start, clip.end, root)


def best_ranges(skin: SkinMotion, clip: Clip, *, root: int = -1, shortest: float = 0.0, count: int = 3) -> list[Loop]:
    """Return the time ranges of a clip that loop best, the best first.

    None is shorter than `shortest` seconds, by default half of the clip. Poses and velocities are compared at the
    clip's frame rate, or at MAX_FRAMES frames if there are more; ranges that start and end within two frames of a
    better one are left out.
    """
    duration = clip.end - clip.start
    if duration <= 0:
        return []
    fps = min(loop_frame_rate(clip), (MAX_FRAMES - 1) / duration)
    times = clip.start + np.arange(int(duration * fps + 1e-6) + 1) / fps
    points = skin.places(clip, times, root)
    speeds = np.gradient(points, axis=1) if points.shape[1] > 1 else np.zeros_like(points)
    features = np.concatenate((points, speeds), axis=0).transpose(1, 0, 2).reshape(len(times), -1)
    squares = (features * features).sum(axis=1)
    apart = squares[:, None] + squares[None] - 2 * features @ features.T
    frames = max(int(np.ceil((shortest or duration / 2) * fps - 1e-6)), 1)
    apart[np.tril_indices(len(times), frames - 1)] = np.inf
    found: list[Loop] = []
    taken: list[tuple[int, int]] = []
    for flat in np.argsort(apart, axis=None)[: 400 * count].tolist():
        a, b = divmod(flat, len(times))
        if not np.isfinite(apart[a, b]) or len(found) == count:
            break
        if all(abs(a - c) > 2 or abs(b - d) > 2 for c, d in taken):
            taken.append((a, b))
            found.append(_judge(skin, clip, float(times[a]), float(times[b]), root))
    looping = [each for each in found if each.kind is not LoopKind.NOT_A_LOOP] or found
    return sorted(looping, key=lambda each: (list(LoopKind).index(each.kind), each.seam))


def _judge(skin: SkinMotion, clip: Clip, start: float, end: float, root: int) -> Loop:
    fps = loop_frame_rate(clip)
    frame_step = frame_duration(fps, start, end)
    if not len(skin.points) or frame_step == 0:
        kind = LoopKind.NOT_A_LOOP if end > start else LoopKind.SINGLE_POSE
        return Loop(kind, start, end, 0.0, 0.0, "", 0.0, Steps(), 0.0, fps)
    (seam,) = measure_seams(skin, [LoopRange(clip, start, end, frame_step, root)])
    inside = _steps(skin, clip, start, end, frame_step, root)
    size = seam.gap
    joints = open_joints(skin, clip, start, end, root)
    if size <= min(
        max(INVISIBLE_GAP_PER_FRAME * inside.typical, NOISE_PER_SIZE * skin.size),
        VISIBLE_GAP_PER_SIZE * skin.size,
    ):
        kind, joints = LoopKind.CLOSED, ()
    else:
        few = are_few(joints, moving_nodes(skin, clip, start, end, frame_step, root))
        kind = _open_kind(seam, size, inside.largest, few=few)
    worst = joints[0].joint if joints else seam.fastest
    travel = _travel(skin, clip, start, end, root)
    return Loop(kind, start, end, size, seam.speed, worst, seam.frame, inside, travel, fps, joints)


def _open_kind(seam: Seam, size: float, inside: float, *, few: bool) -> LoopKind:
    """few: whether more joints close while they move than are open; then no frame is missing."""
    if few and size <= inside:
        return LoopKind.CLOSED_EXCEPT
    return LoopKind.OPEN_BY_ONE_FRAME if not few and is_one_frame(seam) else LoopKind.NOT_A_LOOP


def _steps(skin: SkinMotion, clip: Clip, start: float, end: float, step: float, root: int) -> Steps:
    count = max(round(min((end - start) / step, MAX_COUNT)), 2)
    chosen = np.linspace(0, count - 1, min(count, MAX_STEPS))
    frames = start + step * chosen.round()
    moved = skin.steps(clip, np.minimum(np.stack((frames, frames + step)), end), root)
    keys = clip.key_times
    keys = _some(keys[(keys > start + MIN_INTERIOR_S) & (keys < end - MIN_INTERIOR_S)])
    changes = skin.velocity_changes(clip, keys, root) if len(keys) else np.zeros(1)
    return Steps(float(moved.max()), float(np.median(moved)), float(changes.max()))


def _some(numbers: Floats) -> Floats:
    """At most MAX_STEPS of some values, evenly chosen."""
    count = min(len(numbers), MAX_STEPS)
    return np.asarray(numbers[np.linspace(0, len(numbers) - 1, count).round().astype(int)])


def _travel(skin: SkinMotion, clip: Clip, start: float, end: float, root: int) -> float:
    if root < 0:
        return 0.0
    both = world_by_node(skin.skeleton, sample_pose(skin.skeleton, clip, np.array([start, end])))[root, :, :, 3]
    return float(np.linalg.norm(both[1] - both[0]))

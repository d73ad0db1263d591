"""Loop analysis: kind of loop, size of the loop gap, and the time ranges that loop best."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, group_indices
from anim.errors import RangeError
from anim.measure.loops.clip_ends import LoopRange
from anim.measure.loops.divided_ranges import measure_on_parts
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
from anim.measure.loops.loop_kind import LoopKind
from anim.measure.loops.seam import Seam, measure_seams
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip
from anim.sampling.clips import sample_world_matrices
from anim.sampling.times import check_fps

INVISIBLE_GAP_PER_FRAME = 0.1  # of the usual motion per frame: a gap between those two is visible above this
MAX_COUNT = 10**12  # frames that indices in float64 tell apart
MAX_FRAMES = 600  # frames that `best_ranges` compares
MAX_STEPS = 300  # pairs of frames, and keys, that are measured inside a clip
MIN_INTERIOR_S = 2e-4  # s, from an end to a key inside


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
    frame rate of `frame` and `inside`. joints: those that are open, the largest gap first; none of a closed loop.
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


def analyze_loop(skin: SkinMotion, clip: Clip, *, root: int = -1, fps: float | None = None) -> Loop:
    """Return the kind of loop of a clip. root: node whose displacement is ignored, −1 for none. fps: its frame rate."""
    return analyze_loops(skin, [clip], [root], fps=fps)[0]


def analyze_loops(
    skin: SkinMotion, clips: Sequence[Clip], roots: Sequence[int], *, fps: float | None = None
) -> list[Loop]:
    """Return the kind of loop of each clip: thousands are measured in as few calls as one.

    Closed: no visible jump of a vertex. Closed except some joints: fewer joints are open than close while they move,
    and they jump no further than the clip moves from frame to frame. Open by one frame: the gap is about the next
    frame's motion. roots: nodes whose displacement is ignored, −1 for none. fps: frame rate of all clips, for steps
    that are compared with those of other keys; None for that of each clip's keys. Raises RangeError unless above 0.
    """
    rate = None if fps is None else check_fps(fps)
    ranges = [LoopRange(each, each.start, each.end, root=i) for each, i in zip(clips, roots, strict=True)]
    return measure_on_parts(skin, ranges, lambda some, parts: _judge(some, parts, rate))


def best_ranges(
    skin: SkinMotion,
    clip: Clip,
    *,
    root: int = -1,
    shortest: float = 0.0,
    count: int = 3,
    fps: float | None = None,
) -> list[Loop]:
    """Return the time ranges of a clip that loop best, the best first.

    None is shorter than `shortest` seconds, by default half of the clip. Poses and velocities are compared at the
    clip's frame rate (`fps`, None for that of its keys), or at MAX_FRAMES frames if there are more; ranges that start
    and end within two frames of a better one are left out. Raises RangeError for a negative `shortest`, or one that
    isn't finite, and unless fps is above 0.
    """
    if not 0 <= shortest < np.inf:
        raise RangeError(f"`shortest` is {shortest:g} s (expected 0 or more)")
    duration = clip.end - clip.start
    if duration <= 0:
        return []
    rate = None if fps is None else check_fps(fps)
    compared = min(rate or loop_frame_rate(clip), (MAX_FRAMES - 1) / duration)
    times = clip.start + np.arange(int(duration * compared + 1e-6) + 1) / compared
    points = skin.places(clip, times, root)
    speeds = np.gradient(points, axis=1) if points.shape[1] > 1 else np.zeros_like(points)
    features = np.concatenate((points, speeds), axis=0).transpose(1, 0, 2).reshape(len(times), -1)
    squares = (features * features).sum(axis=1)
    apart = squares[:, None] + squares[None] - 2 * features @ features.T
    frames = max(int(min(np.ceil((shortest or duration / 2) * compared - 1e-6), MAX_FRAMES)), 1)
    apart[np.tril_indices(len(times), frames - 1)] = np.inf
    taken: list[tuple[int, int]] = []
    for flat in np.argsort(apart, axis=None)[: 400 * count].tolist():
        a, b = divmod(flat, len(times))
        if not np.isfinite(apart[a, b]) or len(taken) == count:
            break
        if all(abs(a - c) > 2 or abs(b - d) > 2 for c, d in taken):
            taken.append((a, b))
    found = _judge(skin, [LoopRange(clip, float(times[a]), float(times[b]), root=root) for a, b in taken], rate)
    looping = [each for each in found if each.kind is not LoopKind.NOT_A_LOOP] or found
    return sorted(looping, key=lambda each: (list(LoopKind).index(each.kind), each.seam))


class _Facts(NamedTuple):
    """Measurements of a time range. travel: m."""

    seam: Seam
    inside: Steps
    joints: tuple[JointGap, ...]
    travel: float


def _judge(skin: SkinMotion, parts: Sequence[LoopRange], fps: float | None) -> list[Loop]:
    """The analyses of time ranges, whatever their `frame`. fps: of all of them, None for those of their keys."""
    rates = [fps or loop_frame_rate(each.clip) for each in parts]
    parts = [
        each._replace(frame=frame_duration(fps, each.start, each.end)) for each, fps in zip(parts, rates, strict=True)
    ]
    moving = [i for i, each in enumerate(parts) if len(skin.points) and each.frame]
    facts = dict(zip(moving, _measure(skin, [parts[i] for i in moving]), strict=True))
    wide = [i for i in moving if not _is_closed(skin, facts[i])]
    nodes = dict(zip(wide, moving_nodes(skin, [parts[i] for i in wide]), strict=True))
    return [
        _loop(part, fps, facts[i], nodes.get(i)) if i in facts else _unmeasured(part, fps)
        for i, (part, fps) in enumerate(zip(parts, rates, strict=True))
    ]


def _measure(skin: SkinMotion, parts: Sequence[LoopRange]) -> list[_Facts]:
    measured = measure_seams(skin, parts), _steps(skin, parts), open_joints(skin, parts), _travel(skin, parts)
    return [_Facts(*each) for each in zip(*measured, strict=True)]


def _is_closed(skin: SkinMotion, facts: _Facts) -> bool:
    hidden = max(INVISIBLE_GAP_PER_FRAME * facts.inside.typical, NOISE_PER_SIZE * skin.size)
    return facts.seam.gap <= min(hidden, VISIBLE_GAP_PER_SIZE * skin.size)


def _loop(part: LoopRange, fps: float, facts: _Facts, moving: set[int] | None) -> Loop:
    """moving: nodes that move next to the gap, None for a closed loop."""
    seam, inside, joints, travel = facts
    kind = LoopKind.CLOSED
    if moving is None:
        joints = ()
    else:
        kind = _open_kind(seam, inside.largest, few=are_few(joints, moving))
    worst = joints[0].joint if joints else seam.fastest
    return Loop(kind, part.start, part.end, seam.gap, seam.speed, worst, seam.frame, inside, travel, fps, joints)


def _unmeasured(part: LoopRange, fps: float) -> Loop:
    """The analysis of a single pose, or without points."""
    kind = LoopKind.NOT_A_LOOP if part.end > part.start else LoopKind.SINGLE_POSE
    return Loop(kind, part.start, part.end, 0.0, 0.0, "", 0.0, Steps(), 0.0, fps)


def _open_kind(seam: Seam, inside: float, *, few: bool) -> LoopKind:
    """few: whether more joints close while they move than are open; then no frame is missing."""
    if few and seam.gap <= inside:
        return LoopKind.CLOSED_EXCEPT
    return LoopKind.OPEN_BY_ONE_FRAME if not few and is_one_frame(seam) else LoopKind.NOT_A_LOOP


def _steps(skin: SkinMotion, parts: Sequence[LoopRange]) -> list[Steps]:
    moved = _by_length(skin.steps, parts, [_frames(each) for each in parts])
    changes = _by_length(skin.velocity_changes, parts, [_keys_inside(each) for each in parts])
    return [
        Steps(float(of_frames.max()), float(np.median(of_frames)), float(of_keys.max(initial=0.0)))
        for of_frames, of_keys in zip(moved, changes, strict=True)
    ]


def _by_length(
    measure: Callable[[Sequence[LoopRange], Floats], Floats], parts: Sequence[LoopRange], times: Sequence[Floats]
) -> list[Floats]:
    """Values at times (..., F) of each range, measured together for ranges with the same number of times."""
    found = [np.zeros(0)] * len(parts)
    for length, group in group_indices(each.shape[-1] for each in times).items():
        if length:
            rows = measure([parts[i] for i in group], np.stack([times[i] for i in group]))
            for i, row in zip(group, rows, strict=True):
                found[i] = row
    return found


def _frames(part: LoopRange) -> Floats:
    """Start and end (2, F) of at most MAX_STEPS frames of a range, evenly chosen."""
    count = max(round(min((part.end - part.start) / part.frame, MAX_COUNT)), 2)
    frames = part.start + part.frame * np.linspace(0, count - 1, min(count, MAX_STEPS)).round()
    return np.minimum(np.stack((frames, frames + part.frame)), part.end)


def _keys_inside(part: LoopRange) -> Floats:
    """Times (K,) of at most MAX_STEPS keys inside a range, evenly chosen."""
    keys = part.clip.key_times
    keys = keys[(keys > part.start + MIN_INTERIOR_S) & (keys < part.end - MIN_INTERIOR_S)]
    count = min(len(keys), MAX_STEPS)
    return np.asarray(keys[np.linspace(0, len(keys) - 1, count).round().astype(int)])


def _travel(skin: SkinMotion, parts: Sequence[LoopRange]) -> list[float]:
    """Displacements of the roots in m, 0 without one."""
    found = [0.0] * len(parts)
    rooted = [i for i, each in enumerate(parts) if each.root >= 0]
    size = skin.posed_at_once(2)
    for first in range(0, len(rooted), size):
        some = rooted[first : first + size]
        times = np.array([(parts[i].start, parts[i].end) for i in some])
        world, _ = sample_world_matrices(skin.skeleton, [parts[i].clip for i in some], times)
        for k, i in enumerate(some):
            places = world[parts[i].root, 2 * k : 2 * k + 2, :, 3]
            found[i] = float(np.linalg.norm(places[1] - places[0]))
    return found

"""What kind of loop is a clip, how large is its seam, and which part of it would loop best?"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import Floats, sorted_unique
from anim.measure import levers, rate
from anim.model import Clip, Skeleton
from anim.sampling import pose
from anim.sampling.pose import world_by_node

CLOSED = 1e-3  # of the skeleton's size; a seam below a thousandth is not seen
ONE_FRAME = 1.6  # an open loop's seam against the motion per frame next to it: about one frame's worth
MAX_FRAMES = 600  # looked at by `best_ranges`
DEFAULT_FPS = 30.0


class LoopKind(StrEnum):
    """How a clip's end meets its start."""

    CLOSED = "closed"
    OPEN_BY_ONE_FRAME = "open by one frame"
    NOT_A_LOOP = "not a loop"


@dataclass(frozen=True, slots=True)
class Loop:
    """A clip, or a part of it, as a loop.

    start, end: seconds. seam: m, how far the worst node, or what turns with it, is from where it started; the way that
    the root has made is taken off. speed_seam: m/s. node: the worst one's name, by speed where the loop is closed.
    frame: m, the motion per frame at the
    seam. travel: m, the root's way. fps: the rate that frames were counted at.
    """

    kind: LoopKind
    start: float
    end: float
    seam: float
    speed_seam: float
    node: str
    frame: float
    travel: float
    fps: float


def loop(skeleton: Skeleton, clip: Clip, *, root: int = -1) -> Loop:
    """Return what kind of loop the clip is. root: the node whose way does not count, −1 for none."""
    return _judged(skeleton, clip, clip.start, clip.end, root)


def best_ranges(skeleton: Skeleton, clip: Clip, *, root: int = -1, shortest: float = 0.0, count: int = 3) -> list[Loop]:
    """Return the parts of a clip that loop best, the best first, none shorter than `shortest` seconds.

    Poses and their speeds are compared at the clip's frame rate, or at as many frames as fit in MAX_FRAMES; parts that
    start and end within two frames of a better one are left out. shortest: by default half of the clip.
    """
    duration = clip.end - clip.start
    if duration <= 0:
        return []
    fps = min(_fps(clip), (MAX_FRAMES - 1) / duration)
    times = clip.start + np.arange(int(duration * fps + 1e-6) + 1) / fps
    points = _points(skeleton, clip, times, root)
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
            found.append(_judged(skeleton, clip, float(times[a]), float(times[b]), root))
    looping = [each for each in found if each.kind is not LoopKind.NOT_A_LOOP] or found
    return sorted(looping, key=lambda each: (list(LoopKind).index(each.kind), each.seam))


def _judged(skeleton: Skeleton, clip: Clip, start: float, end: float, root: int) -> Loop:
    fps = _fps(clip)
    frame_step = min(1 / fps, (end - start) / 2) if end > start else 0.0
    if not len(skeleton) or frame_step == 0:
        return Loop(LoopKind.NOT_A_LOOP, start, end, 0.0, 0.0, "", 0.0, 0.0, fps)
    step = min(levers.SPEED_STEP, frame_step / 2)
    times = np.array([start, start + step, start + frame_step, end - frame_step, end - step, end])
    points = _points(skeleton, clip, times, root)
    first, just_after, second, last_but_one, just_before, last = (points[:, i] for i in range(len(times)))
    size = levers.size(points)
    off = np.linalg.norm(last - first, axis=1)
    speeds = np.linalg.norm((last - just_before) - (just_after - first), axis=1) / step
    frame = max(_longest(second - first), _longest(last - last_but_one))
    seam = float(off.max())
    going_on = _longest(last + (last - last_but_one) - first)  # how far the start is from where the end was heading
    kind = LoopKind.NOT_A_LOOP
    if seam <= CLOSED * size:
        kind = LoopKind.CLOSED
    elif seam <= ONE_FRAME * frame and going_on <= frame:
        kind = LoopKind.OPEN_BY_ONE_FRAME
    worst = int((speeds if kind is LoopKind.CLOSED else off).argmax()) // levers.PER_NODE
    travel = _travel(skeleton, clip, times, root)
    name = skeleton.names[worst] or f"node {worst}"
    return Loop(kind, start, end, seam, float(speeds.max()), name, frame, travel, fps)


def _fps(clip: Clip) -> float:
    found = rate.estimate(sorted_unique(np.concatenate(clip.axes))) if clip.axes else None
    return found.fps if found is not None and found.regular > 0.9 else DEFAULT_FPS


def _points(skeleton: Skeleton, clip: Clip, times: Floats, root: int) -> Floats:
    """Points per node (see `levers`); the root's way taken off."""
    world = world_by_node(skeleton, pose(skeleton, clip, times))
    if root >= 0:
        way = world[root, :, :, 3] - world[root, :1, :, 3]
        world[..., 3] -= skeleton.below(root)[:, None, None] * way
    return levers.points(world)


def _travel(skeleton: Skeleton, clip: Clip, times: Floats, root: int) -> float:
    if root < 0:
        return 0.0
    places = world_by_node(skeleton, pose(skeleton, clip, times[[0, -1]]))[root, :, :, 3]
    return float(np.linalg.norm(places[1] - places[0]))


def _longest(vectors: Floats) -> float:
    return float(np.sqrt((vectors * vectors).sum(axis=-1)).max())

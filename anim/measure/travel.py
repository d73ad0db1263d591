"""Where a clip leads: how far its end is from its start, in pose and speed, and how far its root travels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.measure import levers
from anim.model import Clip, Pose, Skeleton
from anim.sampling.joined import Joined, joined
from anim.sampling.pose import world_by_node

ONWARD = 0.7
ENDS = 4  # times that a clip is looked at
PARTS = ("translation", "rotation", "scale")


@dataclass(frozen=True, slots=True)
class Travel:
    """The seam between a clip's end and start, and the way of its root.

    seam: m, the largest distance of any node, or of what turns with it, between end and start; the way of a root that
    leads somewhere is taken off.
    speed_seam: m/s, the largest difference of any node's velocity between end and start.
    root: number of the node whose way was taken, −1 where no translation moves. distance: m. speed: m/s.
    """

    seam: float
    speed_seam: float
    root: int
    distance: float
    speed: float


def travels(skeleton: Skeleton, clips: Sequence[Clip], groups: Sequence[Joined] | None = None) -> list[Travel]:
    """Return one Travel per clip; a clip without time between start and end has none.

    groups: the tracks of all clips, `joined`, for callers that have them.
    """
    if not len(skeleton) or not clips:
        return [Travel(0.0, 0.0, -1, 0.0, 0.0) for _ in clips]
    if groups is None:
        groups = joined([track for clip in clips for track in clip.tracks])
    times = np.array([_ends(clip) for clip in clips])
    of_track = np.repeat(np.arange(len(clips)), [len(clip.tracks) for clip in clips])
    points = levers.points(world_by_node(skeleton, _poses(skeleton, groups, of_track, times)))
    places = points.reshape(len(skeleton), levers.PER_NODE, len(clips), ENDS, 3)
    depth = _depths(skeleton)
    return [_travel(skeleton, clip, times[i], places[:, :, i], depth) for i, clip in enumerate(clips)]


def traveling_root(skeleton: Skeleton, clip: Clip) -> int:
    """Return the node whose way carries a character along, −1 where none does.

    It is the moved node nearest to the root, if others hang on it and its way leads somewhere: at least ONWARD of the
    length of its path lies between its ends.
    """
    root = _root(clip, _depths(skeleton)) if len(skeleton) else -1
    return root if _leads(skeleton, clip, root) else -1


def _leads(skeleton: Skeleton, clip: Clip, root: int) -> bool:
    """Whether the keys of a root's translation lead somewhere, and others hang on it."""
    if root < 0 or not (skeleton.parents == root).any():
        return False
    path = next(t.values for t in clip.tracks if t.node == root and t.path == "translation")
    steps = np.diff(path, axis=0)
    length = float(np.sqrt((steps * steps).sum(axis=1)).sum())
    return length > 0 and float(np.linalg.norm(path[-1] - path[0])) > ONWARD * length


def _poses(skeleton: Skeleton, groups: Sequence[Joined], clip_of_track: Ints, times: Floats) -> Pose:
    """All clips, each at its own times (clips, ENDS), one after the other: one pose of clips × ENDS frames."""
    parts = {name: np.tile(getattr(skeleton, name), (*times.shape, 1, 1)) for name in PARTS}
    for group in groups:
        if group.path in parts:
            clip = clip_of_track[group.numbers]
            node = np.array([track.node for track in group.tracks])
            parts[group.path][clip[:, None], np.arange(ENDS), node[:, None]] = group.sample(times[clip])
    translation, rotation, scale = (part.reshape(-1, *part.shape[2:]) for part in parts.values())
    return Pose(times.reshape(-1), translation, rotation, scale)


def _ends(clip: Clip) -> Floats:
    """ENDS times in seconds: the start, just after it, just before the end, and the end."""
    start, end = clip.start, clip.end
    step = min(levers.SPEED_STEP, (end - start) / 4)
    return np.array([start, start + step, end - step, end])


def _travel(skeleton: Skeleton, clip: Clip, times: Floats, places: Floats, depth: Floats) -> Travel:
    """places: (N, points, ENDS, 3) at `times` (ENDS,)."""
    duration = float(times[-1] - times[0])
    if duration <= 0:
        return Travel(0.0, 0.0, -1, 0.0, 0.0)
    step = min(levers.SPEED_STEP, duration / 4)
    away = places[:, :, 3] - places[:, :, 0]
    root = _root(clip, depth)
    own = away[root, 0] if root >= 0 else np.zeros(3)
    carried = away
    if _leads(skeleton, clip, root):
        carried = away - skeleton.below(root)[:, None, None] * own
    speeds = ((places[:, :, 3] - places[:, :, 2]) - (places[:, :, 1] - places[:, :, 0])) / step
    distance = float(np.linalg.norm(own))
    return Travel(_longest(carried), _longest(speeds), root, distance, distance / duration)


def _root(clip: Clip, depth: Floats) -> int:
    """The moved node nearest to the root of the hierarchy: what carries a character along."""
    tracks = {track.node: track for track in clip.tracks if track.path == "translation" and track.node is not None}
    from_root = sorted(tracks, key=lambda node: (depth[node], node))
    return next((node for node in from_root if (tracks[node].values != tracks[node].values[0]).any()), -1)


def _longest(vectors: Floats) -> float:
    return float(np.sqrt((vectors * vectors).sum(axis=-1)).max())


def _depths(skeleton: Skeleton) -> Floats:
    depth = np.zeros(len(skeleton))
    for level, nodes in enumerate(skeleton.levels()):
        depth[nodes] = level
    return depth

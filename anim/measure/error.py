"""How far apart two versions of a clip are, in metres on the surface: where, and when.

A displacement |D·p| is convex in p, so over a box it is largest at a corner, and over a blend of joints no larger than
the largest joint's. That bounds every time cheaply; vertices are only gone through at the times whose bound could beat
the largest displacement found so far. What is reported is never less than the truth at the times looked at.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, sorted_unique
from anim.maths import matrix
from anim.measure.surface import Surface, diagonal, placed, surfaces
from anim.model import Clip, Kind, Pose, Scene, Track
from anim.sampling import pose
from anim.sampling.pose import world_by_node
from anim.sampling.track import sample

SIDES = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])  # of a box's corners
NOISE = 1e-7  # of the diagonal: float32 files can't say more, so no vertex is searched below this
SLACK = 1.02  # a bound this close to what was found is as good as found
MAX_SEARCHED = 4_000_000  # vertices gone through per surface; beyond, the bound of what is left is reported


@dataclass(frozen=True, slots=True)
class MotionError:
    """The largest distance between two versions of a clip.

    max_error: m, never less than the true one at the times looked at. time: s. place: the mesh or node.
    joint: the joint that contributes most there. times: how many were looked at.
    max_pointer_error: largest difference in the value of a track that moves no node, as a share of its range.
    """

    max_error: float
    time: float
    place: str
    joint: str
    times: int
    max_pointer_error: float = 0.0
    pointer: str = ""


class Ruler:
    """Measures clips on one scene: what does not depend on the clip is prepared once."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.diagonal = diagonal(scene)
        self._parts = [_Part(surface) for surface in surfaces(scene)]

    def error(self, before: Clip, after: Clip) -> MotionError:
        """Return how far `after` is from `before`: at all keys of both, and half-way between."""
        return self.error_at(before, after, check_times(before, after))

    def error_at(self, before: Clip, after: Clip, times: Floats) -> MotionError:
        """Return how far `after` is from `before` at `times` (F,) in seconds."""
        skeleton = self.scene.skeleton
        old, new = pose(skeleton, before, times), pose(skeleton, after, times)
        old_world, new_world = world_by_node(skeleton, old), world_by_node(skeleton, new)
        worst = (0.0, 0, "", -1)
        for part in self._parts:
            found = part.largest(old, new, old_world, new_world, max(worst[0], NOISE * self.diagonal))
            worst = max(worst, found, key=lambda each: each[0])
        size, frame, place, node = worst
        pointer_error, pointer = _pointer_error(before, after, times)
        joint = (skeleton.names[node] or f"node {node}") if node >= 0 else ""
        time = float(times[frame]) if len(times) else 0.0
        return MotionError(size, time, place, joint, len(times), pointer_error, pointer)


def check_times(*clips: Clip) -> Floats:
    """Return every key time of the clips and the middle of every gap, in seconds, increasing."""
    axes = [times for clip in clips for times in clip.axes]
    if not axes:
        return np.zeros(1)
    keys = sorted_unique(np.concatenate(axes))
    return np.sort(np.concatenate((keys, (keys[1:] + keys[:-1]) / 2)))


class _Part:
    """One surface with, for each of its joints, the box around the vertices that the joint carries."""

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._extents = np.abs(surface.targets).max(axis=1, initial=0.0)  # (M, 3)
        self._share = max(float(surface.weights.sum(axis=1).max(initial=0.0)), 1e-30)
        self._used: list[int] = []
        corners = []
        for joint in sorted(set(surface.joints[surface.weights > 0].tolist())):
            carried = surface.points[((surface.joints == joint) & (surface.weights > 0)).any(axis=1)]
            self._used.append(joint)
            corners.append(_corners(carried.min(axis=0), carried.max(axis=0)))
        self._corners = np.array(corners).reshape(-1, 8, 3)

    def largest(
        self, old: Pose, new: Pose, old_world: Floats, new_world: Floats, floor: float
    ) -> tuple[float, int, str, int]:
        """Return (distance, frame, name, node) of the largest displacement, searched only above `floor`."""
        surface = self._surface
        if not self._used or not len(old.times):
            return 0.0, 0, surface.name, -1
        bounds = self._bounds(old, new, old_world, new_world)
        by_frame = bounds.max(axis=0)
        best, best_frame = 0.0, int(by_frame.argmax())
        order = np.argsort(by_frame)[::-1]
        for count, frame in enumerate(order.tolist()):
            if by_frame[frame] <= max(best * SLACK, floor) or count * len(surface.points) > MAX_SEARCHED:
                best = max(best, float(by_frame[frame]))
                break
            size = self._searched(frame, old, new, old_world, new_world)
            if size > best:
                best, best_frame = size, frame
        node = int(surface.nodes[self._used[int(bounds[:, best_frame].argmax())]])
        return best, best_frame, surface.name, node

    def _bounds(self, old: Pose, new: Pose, old_world: Floats, new_world: Floats) -> Floats:
        """For every used joint and frame, how far any vertex that it carries can be displaced (J, F), in metres."""
        surface = self._surface
        nodes, bind = surface.nodes[self._used], surface.bind[self._used][:, None]
        moved = matrix.multiply(new_world[nodes] - old_world[nodes], bind)
        corners = self._corners
        difference, reach = self._weight_ranges(old, new)
        if len(self._extents):
            corners = corners + SIDES * (reach @ self._extents).max(axis=0)
        points = moved[..., :3] @ np.swapaxes(corners, -1, -2)[:, None]  # (J, F, 3, 8)
        points += moved[..., 3, None]
        points *= points
        bounds = np.sqrt(points.sum(axis=-2).max(axis=-1))
        if len(self._extents):
            stretched = np.sqrt((matrix.multiply(new_world[nodes], bind)[..., :3] ** 2).sum(axis=(-1, -2)))
            bounds = bounds + stretched * np.linalg.norm(difference @ self._extents, axis=1)
        return np.asarray(bounds * self._share)

    def _weight_ranges(self, old: Pose, new: Pose) -> tuple[Floats, Floats]:
        """Morph weights of both versions: how much they differ, and how large they get, both (F, M)."""
        a, b = (self._weights(each) for each in (old, new))
        return np.abs(a - b), np.maximum(np.abs(a), np.abs(b))

    def _weights(self, pose: Pose) -> Floats:
        found = pose.weights.get(self._surface.owner)
        at_rest = self._surface.rest_weights
        return found if found is not None else np.broadcast_to(at_rest, (len(pose.times), len(at_rest)))

    def _searched(self, frame: int, old: Pose, new: Pose, old_world: Floats, new_world: Floats) -> float:
        surface = self._surface
        moved = placed(surface, new_world[surface.nodes, frame], self._weights(new)[frame])
        moved -= placed(surface, old_world[surface.nodes, frame], self._weights(old)[frame])
        return float(np.sqrt((moved * moved).sum(axis=1).max()))


def _corners(low: Floats, high: Floats) -> Floats:
    return np.where(SIDES < 0, low, high)


def _pointer_error(before: Clip, after: Clip, times: Floats) -> tuple[float, str]:
    """The largest difference between tracks that move no node, as a share of the old track's range, and whose."""
    worst, where = 0.0, ""
    new = {track.target: track for track in after.tracks if track.path == "pointer"}
    for track in before.tracks:
        if track.path != "pointer" or track.target not in new:
            continue
        size = _relative_difference(track, new[track.target], times)
        if size > worst:
            worst, where = size, track.pointer or ""
    return worst, where


def _relative_difference(old: Track, new: Track, times: Floats) -> float:
    a, b = sample(old, times), sample(new, times)
    if old.kind is Kind.ROTATION:
        return float(np.minimum(np.abs(a - b).max(axis=1), np.abs(a + b).max(axis=1)).max())
    extent = float((a.max(axis=0) - a.min(axis=0)).max())
    return float(np.abs(a - b).max()) / (extent or max(float(np.abs(a).max()), 1e-30))

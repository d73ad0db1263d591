"""Statistics of the error between two versions of a clip: mean, percentile, rotation, speed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Self

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import hierarchy, quaternion
from anim.measure.error.max_displacement import lengths_by_group, max_displacement
from anim.measure.error.merged_groups import MergedGroups
from anim.measure.error.metric import MAX_SEARCHED, Block, ErrorMetric
from anim.measure.error.point_groups import PointGroups
from anim.measure.error.sample_times import FPS, SAME_MOMENT, dense_times, grid_times
from anim.measure.error.shell_points import ShellPoints
from anim.model import Clip, Pose, Skeleton

FRAMES = 64  # maximum number of times for mean and p99
MAX_SAMPLES = 4_000_000  # maximum number of vertices × frames for mean and p99
SLACK = 1.01  # factor: the speed error is at most this much above the true one
SPEED_TOLERANCE = 1e-6  # diagonals per second; smaller speed errors are not searched


class Peak(NamedTuple):
    """A maximum: its size, time (s) and position: mesh or node, joint, vertex or −1."""

    size: float = 0.0
    time: float = 0.0
    place: str = ""
    joint: str = ""
    vertex: int = -1


class Statistics(NamedTuple):
    """Errors between two versions of a clip besides the largest distance.

    mean, p99: m, over all vertices at up to 64 of the times, evenly chosen (fewer for very large meshes).
    angle: rad, the largest difference between the world rotations of a node; over all nodes of both scenes.
    speed: m/s, the largest difference in a vertex's velocity, by differences from frame to frame of a regular grid.
    weight: the largest difference of a morph weight; its vertex is the index of the target.
    """

    mean: float
    p99: float
    angle: Peak
    speed: Peak
    weight: Peak

    def capped(self, max_error: float) -> Self:
        """Return these statistics with no distance above the largest one, m: they are rounded, it is not."""
        return self._replace(mean=min(self.mean, max_error), p99=min(self.p99, max_error))


def statistics(
    ruler: ErrorMetric,
    before: Clip,
    after: Clip,
    *,
    times: Floats | None = None,
    block: Block | None = None,
    player: str = "spec",
    fps: float = FPS,
) -> Statistics:
    """Return the statistics of the error of `after`, on the scenes of the metric.

    times: (F,) s, samples of distances, rotations and weights; `dense_times` by default.
    block: the poses at `times`, if the caller has them. player: a name in PLAYERS, for both clips.
    fps: frames per second of the grid for speeds, 120 by default.
    """
    times = dense_times(before, after, fps=fps) if times is None else times
    vertices = ruler.num_static_points + sum(len(group) for part in ruler.parts for group in part.groups)
    count = int(np.clip(MAX_SAMPLES // max(vertices, 1), 2, FRAMES))
    chosen = np.array(sorted(set(np.linspace(0, len(times) - 1, count).round().astype(np.int64).tolist())))
    found: list[Floats] = []
    for each in ruler.blocks(before, after, times[chosen], player=player) if block is None else [_take(block, chosen)]:
        found += _distances(ruler, each)
    angle, weight = Peak(), Peak()
    for each in ruler.blocks(before, after, times, player=player) if block is None else [block]:
        angle = max(angle, _rotation_errors(ruler, each), key=lambda peak: peak.size)
        weight = max(weight, _weighted(ruler, each), key=lambda peak: peak.size)
    zeros = ruler.num_static_points * len(chosen)
    found = [each for each in found if len(each)] or [np.zeros(0 if zeros else 1)]
    every = found.pop() if len(found) == 1 else np.concatenate(found)
    found.clear()
    speed = speed_error(ruler, before, after, player=player, fps=fps, block=block)
    mean = float(every.sum(dtype=np.float64)) / (len(every) + zeros)
    return Statistics(mean, _percentile(every, zeros, 0.99), angle, speed, weight)


def speed_error(
    ruler: ErrorMetric,
    before: Clip,
    after: Clip,
    *,
    player: str = "spec",
    fps: float = FPS,
    block: Block | None = None,
) -> Peak:
    """Return the largest difference in a vertex's velocity, m/s, by differences over a grid of `fps`.

    It is an upper bound on that grid, at most 1 % above the true one. time: the middle of the frame's step.
    block: poses at other times too, if the caller has them: those of the grid are taken from it where it has them.
    """
    times = grid_times(before, after, fps=fps)
    taken = None if block is None else _take_grid(block, times)
    worst = Peak()
    for block in ruler.blocks(before, after, times, player=player, overlap=1) if taken is None else [taken]:
        step = np.diff(block.times)
        if not len(step):
            continue
        for part in ruler.combined:
            field = part.field(block.old, block.new)
            if field is None:
                continue
            rate = field.rate(step)
            floor = max(worst.size, SPEED_TOLERANCE * ruler.diagonal)
            top = max_displacement(rate, floor=floor, slack=SLACK, most=MAX_SEARCHED)
            if top.length > worst.size:
                joint = ruler.called(part.node(rate.joint(top.group, top.frame, top.vertex)))
                time = float(block.times[top.frame] + block.times[top.frame + 1]) / 2
                worst = Peak(top.length, time, part.name_of(top) or joint, joint, part.vertex(top))
    return worst


def _take_grid(block: Block, times: Floats) -> Block | None:
    """The block's poses at times (F,), which may differ by rounding; None if one is missing.

    Times before the block's first are left out: nothing moves before the first key.
    """
    times = times[times >= block.times[0] - SAME_MOMENT]
    after = np.minimum(np.searchsorted(block.times, times), len(block.times) - 1)
    ahead = np.maximum(after - 1, 0)
    frames = np.where(times - block.times[ahead] < block.times[after] - times, ahead, after)
    is_grid = (np.abs(block.times[frames] - times) <= SAME_MOMENT).all() and (np.diff(frames) > 0).all()
    return _take(block, frames) if is_grid and len(frames) else None


def _take(block: Block, frames: Ints) -> Block:
    return Block(block.times[frames], block.old.take(frames), block.new.take(frames))


def _distances(ruler: ErrorMetric, block: Block) -> Iterator[Floats]:
    """Distances of moving vertices at all times of the block; without vertices, of the points of shells."""
    frames = np.arange(len(block.times))
    surfaces = [part for part in ruler.parts if not _is_shell(part)]
    for part in surfaces if surfaces or ruler.pairs.surfaces else ruler.parts:
        field = part.field(block.old, block.new)
        if field is not None:
            yield from lengths_by_group(field, len(part.groups), frames)


def _is_shell(part: PointGroups) -> bool:
    return isinstance(part, ShellPoints | MergedGroups) and not part.has_vertices


def _percentile(values: Floats, zeros: int, share: float) -> float:
    """The value below which this fraction of all is, with so many zeros. values: not negative, reordered."""
    count = len(values) + zeros
    place = min(int(np.ceil(share * count)), count) - 1 - zeros
    if place < 0:
        return 0.0
    values.partition(place)
    return float(values[place])


def _rotation_errors(ruler: ErrorMetric, block: Block) -> Peak:
    """The largest angle between the world rotations of a node in both versions."""
    old, new = (_world_rotations(each.skeleton, each.pose) for each in (block.old, block.new))
    partners = ruler.partners
    both = np.flatnonzero(partners >= 0)
    if not len(both):
        return Peak()
    angles = quaternion.angle_between(old[both], new[partners[both]])
    node, frame = np.unravel_index(int(angles.argmax()), angles.shape)
    name = ruler.called(int(both[node]))
    return Peak(float(angles[node, frame]), float(block.times[frame]), name, name) if angles[node, frame] else Peak()


def _world_rotations(skeleton: Skeleton, pose: Pose) -> Floats:
    """World rotations of all nodes (N, F, 4), without scales."""
    local = quaternion.normalize(np.swapaxes(pose.rotation, 0, 1))
    return hierarchy.accumulate(local, skeleton.parents, skeleton.levels(), quaternion.multiply)


def _weighted(ruler: ErrorMetric, block: Block) -> Peak:
    """The largest difference of a morph weight."""
    worst = Peak()
    for part in ruler.parts:
        for owner, old, new in part.weights(block.old, block.new):
            apart = np.abs(old - new)
            frame, target = np.unravel_index(int(apart.argmax()), apart.shape)
            if apart[frame, target] > worst.size:
                name = ruler.called(owner)
                worst = Peak(float(apart[frame, target]), float(block.times[frame]), name, name, int(target))
    return worst

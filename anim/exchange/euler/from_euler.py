"""Euler curves → a skeleton and a clip of quaternion tracks, correct between keys too."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from anim.curves.fitting.adaptive_keys import TrackFunction, linear_keys
from anim.errors import AnimError, RangeError, UnsupportedError
from anim.exchange.euler.baked_keys import Float32Times, KeyPlacement, curves_of, is_baked
from anim.exchange.euler.curve import Mode, travel
from anim.exchange.euler.equal_nodes import first_equal_nodes
from anim.exchange.euler.evaluate import (
    bounding_size,
    evaluate_rotation,
    evaluate_scale,
    evaluate_translation,
    skeleton,
)
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode
from anim.exchange.euler.node_stack import PATHS, path_curves
from anim.exchange.euler.stacked_tracks import NodeKeys, divide_nodes, fit_nodes
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Skeleton, TimeAxis, Track
from anim.model.time_axis import merge_times
from anim.model.track import share_time_axes

MIN_TOLERANCE = 1e-6  # rad; the resolution of float32 quaternions
KEYS_PER_SOURCE_KEY, MIN_KEY_LIMIT = 100, 100_000  # of all nodes: two keys can name a million turns
FEWER_KEYS = "a larger angle tolerance needs fewer keys, and `keys` grid adds none"
CONSTANT_TOLERANCE = 1e-9  # fraction of the skeleton's size


@dataclass(frozen=True, slots=True)
class ImportedMotion:
    """A skeleton in its rest pose, and its motion.

    ends: indices of nodes that only mark the end of their parent. tolerance: rad, the clip's maximum error between its
    keys; None for recordings, which keep their grid.
    """

    skeleton: Skeleton
    clip: Clip
    ends: frozenset[int]
    tolerance: float | None = None


def from_euler(
    motion: EulerMotion, *, tolerance: float, keys: KeyPlacement = KeyPlacement.AUTO, name: str = ""
) -> ImportedMotion:
    """Return the skeleton of the motion, and a clip with slerp following the Euler motion.

    Every axis curve is evaluated on its own keys, then the axes are combined; source key times are kept (rounded to
    float32, as in glTF), and keys are added where slerp would leave the path, or a segment would rotate by more than
    120°. Steps remain steps. Signs are continuous.

    tolerance: rad; the maximum error of translations is tolerance × the skeleton's size, of scales tolerance × 1.
    keys: ADAPTIVE as above; GRID adds no key and ignores jumps of angles by multiples of 360°; AUTO is GRID for
    recordings: BVH, or linear curves on one even grid of 10 keys a second or more.
    Raises RangeError for a tolerance below 1e-6 or above pi, UnsupportedError for more keys than 100 000 and
    than 100 times those of the source.
    XYZ (0, 0, 0) at 0 s → (90°, 90°, 0) at 1 s, tolerance 0.1° → a rotation track of 15 keys
    """
    if not MIN_TOLERANCE <= tolerance <= np.pi:
        raise RangeError(f"`tolerance` is {tolerance:g} rad (expected {MIN_TOLERANCE:g} to pi; radians, not degrees)")
    bones = skeleton(motion)
    size = bounding_size(bones) or 1.0
    builder = _TrackBuilder(motion.nodes, size)
    adaptive = False
    distinct = sorted(builder.equal)
    for block in divide_nodes([motion.nodes[number] for number in distinct]):
        nodes = {number: motion.nodes[number] for number in (distinct[i] for i in block)}
        on_grid = {number: is_baked(motion, node, keys) for number, node in nodes.items()}
        adaptive = adaptive or any(not on_grid[number] and _changes(node) for number, node in nodes.items())
        builder.add(nodes, tolerance, sampled={number for number in nodes if on_grid[number]})
    ends = frozenset(i for i, node in enumerate(motion.nodes) if node.end)
    tracks = tuple(share_time_axes(sorted(builder.tracks, key=lambda track: track.node or 0)))
    return ImportedMotion(bones, Clip(name, tracks), ends, tolerance if adaptive else None)


def _changes(node: EulerNode) -> bool:
    return any(not curve.is_constant for curve in curves_of(node))


class _TrackBuilder:
    """Tracks of nodes, by path for each node; those at rest are omitted.

    equal: indices of the nodes that move alike, by the first of them. size: of the skeleton, in metres.
    """

    def __init__(self, nodes: Sequence[EulerNode], size: float) -> None:
        self.tracks: list[Track] = []
        self.equal: dict[int, list[int]] = {}
        for number, first in enumerate(first_equal_nodes(nodes)):
            self.equal.setdefault(first, []).append(number)
        num_keys = sum(len(curve.values) for node in nodes for curve in curves_of(node))
        self._limit = self._left = max(KEYS_PER_SOURCE_KEY * num_keys, MIN_KEY_LIMIT)
        self._nodes = nodes
        self._size = size
        self._units = {"translation": size, "rotation": 1.0, "scale": 1.0}
        self._stored = Float32Times()
        self._axes: dict[bytes, TimeAxis] = {}

    def add(self, nodes: Mapping[int, EulerNode], tolerance: float, *, sampled: Collection[int]) -> None:
        """Add the tracks of nodes and of those that move alike. tolerance: rad. sampled: without added keys."""
        found = fit_nodes(nodes, tolerance, self._units, sampled=sampled, limit=self._left)
        for number, node in nodes.items():
            try:
                for path in PATHS:
                    if path_curves(node, path):
                        keys = found.get((number, path)) or self._alone(
                            node, path, None if number in sampled else tolerance
                        )
                        self._count(len(keys.times))
                        for other in self.equal[number]:
                            self._add(other, self._nodes[other], path, keys)
            except AnimError as error:
                raise error.at(f"node '{node.name}'") from None

    def _alone(self, node: EulerNode, path: str, tolerance: float | None) -> NodeKeys:
        unit = self._units[path]
        allowed = None if tolerance is None else tolerance * unit
        try:
            return fit_node(self._stored.node(node), path, allowed, self._left)
        except UnsupportedError as error:
            if self._left < self._limit:  # what nodes before this one have left, which is no limit to be named
                raise self._too_many_keys() from None
            raise UnsupportedError(str(error), help=FEWER_KEYS) from None

    def _count(self, num_keys: int) -> None:
        self._left -= num_keys
        if self._left < 0:
            raise self._too_many_keys()

    def _too_many_keys(self) -> UnsupportedError:
        return UnsupportedError(f"the motion up to here needs over {self._limit} keys", help=FEWER_KEYS)

    def _add(self, number: int, node: EulerNode, path: str, keys: NodeKeys) -> None:
        """Add a track unless it is equal to the rest pose: many recorders write six channels for every joint."""
        if path == "translation" and (node.parent >= 0 or node.pivots is not NO_PIVOTS):
            still = node.translation if node.pivots is NO_PIVOTS else keys.values[0]
            if (np.abs(keys.values - still) <= CONSTANT_TOLERANCE * self._size).all():
                return
        content = keys.times.tobytes()
        axis = self._axes.get(content)
        if axis is None:
            axis = self._axes[content] = TimeAxis(keys.times)
        self.tracks.append(Track(number, path, keys.interpolation, axis, keys.values))


def fit_node(node: EulerNode, path: str, tolerance: float | None, limit: int | None = None) -> NodeKeys:
    """Return the keys of one path of a node; tolerance, in the path's own unit: None adds no keys.

    limit: of keys; see `linear_keys`. The node's times are those of float32. `fit_nodes` gives many short nodes the
    same keys.
    """
    curves = path_curves(node, path)
    knots = merge_times(curve.time_axis for curve in curves)
    changing = [curve for curve in curves if not curve.is_constant]
    stepped = bool(changing) and all((curve.modes[:-1] == Mode.STEP).all() for curve in changing)
    motion = _function(node, path)
    if stepped or tolerance is None:
        values = motion.values(knots, False)
        values = quaternion.align_signs(values) if motion.rotation else values
        return NodeKeys(Interpolation.STEP if stepped else Interpolation.LINEAR, knots, values)
    return NodeKeys(Interpolation.LINEAR, *linear_keys(motion, knots, tolerance=tolerance, limit=limit))


def _function(node: EulerNode, path: str) -> TrackFunction:
    if path == "translation":
        return TrackFunction(lambda at, before: evaluate_translation(node, at, before), rotation=False)
    if path == "scale":
        return TrackFunction(lambda at, before: evaluate_scale(node, at, before), rotation=False)
    return TrackFunction(
        lambda at, before: evaluate_rotation(node, at, before),
        rotation=True,
        travel=lambda a, b: np.asarray(sum((travel(c, a, b) for c in path_curves(node, path)), np.zeros(len(a)))),
    )

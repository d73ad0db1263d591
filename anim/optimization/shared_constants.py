"""What is known of all clips before any is searched: which properties never leave rest, and which values they share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track
from anim.optimization.search.context import Context
from anim.optimization.search.source_motion import PATHS
from anim.optimization.tracks import morph_weights

CONSTANT_TOLERANCE = 0.5  # of the bound: a track that stays this near a value may be held at it

Target = tuple[int, str]


@dataclass(frozen=True, slots=True)
class Constants:
    """unused: properties that no clip moves away from rest. values: by property, where clips hold it, most first."""

    unused: frozenset[Target]
    values: dict[Target, tuple[Floats, ...]]


def find_constants(setting: Context, clips: Sequence[Clip]) -> Constants:
    """Return what all clips have in common, judged with levers of the rest pose."""
    meters = _meters(setting)
    moved: set[Target] = set()
    seen: set[Target] = set()
    values: dict[Target, list[_Value]] = {}
    bound = CONSTANT_TOLERANCE * setting.bounds.max_error
    for clip in clips:
        for track in clip.tracks:
            if track.node is None or track.path == "pointer":
                continue
            target = (track.node, track.path)
            if track.path == "weights":
                seen.add(target)
                if not _weights_rest(setting, track, bound):
                    moved.add(target)
                continue
            unit = meters[PATHS.index(track.path)][track.node]
            seen.add(target)
            if unit * _difference(track, getattr(setting.skeleton, track.path)[track.node]) > bound:
                moved.add(target)
                _note(values.setdefault(target, []), track, unit, bound)
    chosen = {
        target: tuple(each.value for each in sorted(found, key=lambda each: -each.clips))
        for target, found in values.items()
    }
    return Constants(frozenset(seen - moved), chosen)


def _weights_rest(setting: Context, track: Track, bound: float) -> bool:
    """Whether morph weights leave every vertex within `bound` of the rest pose; splines that move never do."""
    assert track.node is not None
    reach = setting.morph_reach(track.node)
    if not reach.size or track.interpolation is Interpolation.CUBICSPLINE:
        return False
    return morph_weights.weight_error(track, setting.weights_at_rest(track.node), reach) <= bound


class _Value:
    """A value at which clips hold a property."""

    def __init__(self, value: Floats) -> None:
        self.value = value
        self.clips = 1


def _note(found: list[_Value], track: Track, unit: float, bound: float) -> None:
    """Count the track for a value that is near all of its keys, its own middle where none is."""
    for each in found:
        if unit * _difference(track, each.value) <= bound:
            each.clips += 1
            return
    rows = quaternion.align_signs(track.values) if track.path == "rotation" else track.values
    middle = (rows.min(axis=0) + rows.max(axis=0)) / 2
    if track.path == "rotation" and np.abs(middle).max() > 1e-6:
        middle = quaternion.normalize(middle)
    if unit * _difference(track, middle) <= bound:
        found.append(_Value(middle))


def _difference(track: Track, value: Floats) -> float:
    """How far the track's keys are from a value, at most, in its own units; a spline that moves, endlessly."""
    if track.interpolation is Interpolation.CUBICSPLINE and track.in_tangents is not None:
        assert track.out_tangents is not None
        if track.in_tangents.any() or track.out_tangents.any():
            return float("inf")
    apart = np.linalg.norm(track.values - value, axis=1)
    if track.path == "rotation":
        apart = np.minimum(apart, np.linalg.norm(track.values + value, axis=1))
    return float(apart.max())


def _meters(setting: Context) -> tuple[Floats, Floats, Floats]:
    """How far a point moves per unit of each node's translation, rotation and scale (N,), in the rest pose."""
    world, skeleton = setting.rest_world, setting.skeleton
    places = setting.points.places(world[:, None])[:, 0]
    count = len(skeleton)
    reach = np.zeros(count)
    for node in range(count):
        mine = places[setting.points.on(skeleton.descendants(node))]
        reach[node] = np.linalg.norm(mine - world[node, :, 3], axis=1).max(initial=0.0)
    lengths = np.sqrt((world[..., :3] ** 2).sum(axis=-2)).max(axis=1)
    widening = np.where(skeleton.parents < 0, 1.0, lengths[skeleton.parents])
    return widening, 2 * reach, reach / np.maximum(np.abs(skeleton.scale).min(axis=1), 1e-6)

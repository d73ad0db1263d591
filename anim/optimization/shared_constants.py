"""Constants common to all clips, found before any search: properties at rest, and shared values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track
from anim.optimization.search.context import Context
from anim.optimization.search.source_motion import PATHS
from anim.optimization.tracks import morph_weights

CONSTANT_TOLERANCE = 0.5  # of the bound: a track this close to a value may become that constant

Target = tuple[int, str]


@dataclass(frozen=True, slots=True)
class Constants:
    """Constants of all clips.

    unused: properties at rest in all clips. values: by property, constants of its tracks, the most frequent first.
    """

    unused: frozenset[Target]
    values: dict[Target, tuple[Floats, ...]]


def find_constants(context: Context, clips: Sequence[Clip]) -> Constants:
    """Return the constants of all clips; distances use the rest pose's moment arms."""
    animated = {track.node for clip in clips for track in clip.tracks if track.node is not None}
    meters = _meters_per_unit(context, animated)
    moved: set[Target] = set()
    seen: set[Target] = set()
    values: dict[Target, list[_Value]] = {}
    bound = CONSTANT_TOLERANCE * context.bounds.max_error
    for clip in clips:
        for track in clip.tracks:
            if track.node is None or track.path == "pointer":
                continue
            target = (track.node, track.path)
            if track.path == "weights":
                seen.add(target)
                if not _weights_rest(context, track, bound):
                    moved.add(target)
                continue
            unit = meters[PATHS.index(track.path)][track.node]
            seen.add(target)
            if unit * _difference(track, getattr(context.skeleton, track.path)[track.node]) > bound:
                moved.add(target)
                _count_constant(values.setdefault(target, []), track, unit, bound)
    chosen = {
        target: tuple(each.value for each in sorted(found, key=lambda each: -each.clips))
        for target, found in values.items()
    }
    return Constants(frozenset(seen - moved), chosen)


def _weights_rest(context: Context, track: Track, bound: float) -> bool:
    """Return whether morph weights keep every vertex within `bound` of rest; false for splines that move."""
    assert track.node is not None
    reach = context.morph_reach(track.node)
    if not reach.size or track.interpolation is Interpolation.CUBICSPLINE:
        return False
    return morph_weights.weight_error(track, context.weights_at_rest(track.node), reach) <= bound


class _Value:
    """A constant of a property, with the number of clips that use it."""

    def __init__(self, value: Floats) -> None:
        self.value = value
        self.clips = 1


def _count_constant(found: list[_Value], track: Track, unit: float, bound: float) -> None:
    """Count the track for a constant near all of its keys; without one, add its own middle if near."""
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
    """Largest distance of the track's keys from a value, in its units; infinite for a spline that moves."""
    if track.interpolation is Interpolation.CUBICSPLINE and track.in_tangents is not None:
        assert track.out_tangents is not None
        if track.in_tangents.any() or track.out_tangents.any():
            return float("inf")
    apart = np.linalg.norm(track.values - value, axis=1)
    if track.path == "rotation":
        apart = np.minimum(apart, np.linalg.norm(track.values + value, axis=1))
    return float(apart.max())


def _meters_per_unit(context: Context, animated: Iterable[int]) -> tuple[Floats, Floats, Floats]:
    """Displacement of a point per unit of translation, rotation and scale (N,) of animated nodes, at rest."""
    world, skeleton = context.rest_world, context.skeleton
    places = context.points.places(world[:, None])[:, 0]
    count = len(skeleton)
    reach = np.zeros(count)
    for node in animated:
        mine = places[context.points.on(skeleton.descendants(node))]
        reach[node] = np.linalg.norm(mine - world[node, :, 3], axis=1).max(initial=0.0)
    lengths = np.sqrt((world[..., :3] ** 2).sum(axis=-2)).max(axis=1)
    widening = np.where(skeleton.parents < 0, 1.0, lengths[skeleton.parents])
    return widening, 2 * reach, reach / np.maximum(np.abs(skeleton.scale).min(axis=1), 1e-6)

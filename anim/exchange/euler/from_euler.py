"""Euler curves → a skeleton and a clip of quaternion tracks, correct between keys too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.curves.fitting.adaptive_keys import TrackFunction, linear_keys
from anim.errors import AnimError, RangeError
from anim.exchange.euler.baked_keys import Float32Times, KeyPlacement, curves_of, is_baked
from anim.exchange.euler.curve import Curve, Mode, travel
from anim.exchange.euler.evaluate import (
    bounding_size,
    evaluate_rotation,
    evaluate_scale,
    evaluate_translation,
    skeleton,
)
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Skeleton, Track
from anim.model.time_axis import merge_times
from anim.model.track import share_time_axes

MIN_TOLERANCE = 1e-6  # rad; the resolution of float32 quaternions
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
    Raises RangeError for a tolerance below 1e-6 or above pi.
    XYZ (0, 0, 0) at 0 s → (90°, 90°, 0) at 1 s, tolerance 0.1° → a rotation track of 15 keys
    """
    if not MIN_TOLERANCE <= tolerance <= np.pi:
        raise RangeError(f"`tolerance` is {tolerance:g} rad (expected {MIN_TOLERANCE:g} to pi; radians, not degrees)")
    bones = skeleton(motion)
    size = bounding_size(bones) or 1.0
    stored = Float32Times()
    tracks: list[Track] = []
    adaptive = False
    for number, node in enumerate(motion.nodes):
        on_grid = is_baked(motion, node, keys)
        adaptive |= not on_grid and any(not curve.is_constant for curve in curves_of(node))
        try:
            tracks += _tracks(number, stored.node(node), None if on_grid else tolerance, size)
        except AnimError as error:
            raise error.at(f"node '{node.name}'") from None
    ends = frozenset(i for i, node in enumerate(motion.nodes) if node.end)
    return ImportedMotion(bones, Clip(name, tuple(share_time_axes(tracks))), ends, tolerance if adaptive else None)


def _tracks(number: int, node: EulerNode, tolerance: float | None, size: float) -> list[Track]:
    """Tracks of one node; tolerance None adds no keys."""
    turning = [curve for curve in node.rotation if curve is not None]
    moving, scaling = [*node.moves.values()], [*node.scales.values()]
    if node.pivots is not NO_PIVOTS:
        moving = curves_of(node)
    translation = TrackFunction(lambda at, before: evaluate_translation(node, at, before), rotation=False)
    rotation = TrackFunction(
        lambda at, before: evaluate_rotation(node, at, before),
        rotation=True,
        travel=lambda a, b: np.asarray(sum((travel(curve, a, b) for curve in turning), np.zeros(len(a)))),
    )
    scale = TrackFunction(lambda at, before: evaluate_scale(node, at, before), rotation=False)
    parts = (
        ("translation", moving, translation, size),
        ("rotation", turning, rotation, 1.0),
        ("scale", scaling, scale, 1.0),
    )
    tracks = [
        _track(number, name, curves, path, None if tolerance is None else tolerance * unit)
        for name, curves, path, unit in parts
        if curves
    ]
    return [track for track in tracks if not _is_rest(track, node, size)]


def _track(number: int, name: str, curves: list[Curve], path: TrackFunction, tolerance: float | None) -> Track:
    knots = merge_times(curve.time_axis for curve in curves)
    changing = [curve for curve in curves if not curve.is_constant]
    stepped = bool(changing) and all((curve.modes[:-1] == Mode.STEP).all() for curve in changing)
    if stepped or tolerance is None:
        values = path.values(knots, False)
        values = quaternion.align_signs(values) if path.rotation else values
        return Track(number, name, Interpolation.STEP if stepped else Interpolation.LINEAR, knots, values)
    times, values = linear_keys(path, knots, tolerance=tolerance)
    return Track(number, name, Interpolation.LINEAR, times, values)


def _is_rest(track: Track, node: EulerNode, size: float) -> bool:
    """True for a track equal to the rest pose: many recorders write six channels for every joint."""
    if track.path != "translation" or (node.parent < 0 and node.pivots is NO_PIVOTS):
        return False
    still = evaluate_translation(node, track.times[:1])[0] if node.pivots is not NO_PIVOTS else node.translation
    return bool((np.abs(track.values - still) <= CONSTANT_TOLERANCE * size).all())

"""What a track's keys tell about it: does it move anything, which keys say nothing, which steps are dangerous."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Kind, Skeleton, Track

FLOAT32 = 2.0**-22  # relative; twice the spacing of float32, within which two stored values are the same
REDUNDANT = 1e-6  # of a track's range: a key this close to what its neighbors give says nothing
UNIT = 1e-3  # a quaternion whose length is further off 1 than this was not meant
UNIT_BYTE = 0.00769  # the same for quaternions in normalized bytes, by the Khronos validator
WIDE_STEP = np.radians(170.0)  # rad; from here on players disagree about which way round is shorter


@dataclass(frozen=True, slots=True)
class TrackStats:
    """Facts about T tracks; arrays (T,).

    constant: never changes. no_effect: constant, and the node rests there anyway. redundant: keys that could go.
    non_unit, flips, wide: keys with a length off 1, sign changes from key to key, steps of 170° or more (rotations).
    widest: largest step in rad.
    """

    constant: Bools
    no_effect: Bools
    redundant: Ints
    non_unit: Ints
    flips: Ints
    wide: Ints
    widest: Floats

    def __getitem__(self, part: slice) -> TrackStats:
        """Return the facts about some of the tracks."""
        return TrackStats(*(getattr(self, each.name)[part] for each in fields(self)))


def stats(tracks: Sequence[Track], skeleton: Skeleton) -> TrackStats:
    """Return the facts about tracks, in their order: those with as many keys and components are counted together."""
    zeros = [np.zeros(len(tracks), kind) for kind in (bool, bool, int, int, int, int, float)]
    result = TrackStats(*zeros)
    groups: dict[tuple[object, ...], list[int]] = {}
    for i, track in enumerate(tracks):
        key = (len(track.times), track.values.shape[1], track.path, track.kind, track.interpolation)
        groups.setdefault(key, []).append(i)
    for numbers in groups.values():
        _count(_Group([tracks[i] for i in numbers]), skeleton, result, np.array(numbers))
    return result


class _Group:
    """G tracks with equally many keys: times (K, G), values and tangents (K, G, C)."""

    def __init__(self, tracks: list[Track]) -> None:
        self.tracks = tracks
        self.kind, self.interpolation, self.path = tracks[0].kind, tracks[0].interpolation, tracks[0].path
        self.times = np.stack([track.times for track in tracks], axis=1)
        self.values = np.stack([track.values for track in tracks], axis=1)
        self.tangents: tuple[Floats, Floats] | None = None
        if self.interpolation is Interpolation.CUBICSPLINE:
            arriving = [track.in_tangents for track in tracks if track.in_tangents is not None]
            leaving = [track.out_tangents for track in tracks if track.out_tangents is not None]
            self.tangents = np.stack(arriving, axis=1), np.stack(leaving, axis=1)


def _count(group: _Group, skeleton: Skeleton, result: TrackStats, numbers: Ints) -> None:
    values = group.values
    if group.kind is Kind.ROTATION:
        lengths = np.sqrt(quaternion.dot(values, values))
        bytes_only = np.array([track.storage.component_type in (5120, 5121) for track in group.tracks])
        result.non_unit[numbers] = (np.abs(lengths - 1) > np.where(bytes_only, UNIT_BYTE, UNIT)).sum(axis=0)
        values = values / np.where(lengths > 0, lengths, 1)[..., None]
        dots = quaternion.dot(values[1:], values[:-1])
        angles = 2 * np.arccos(np.minimum(np.abs(dots), 1.0))
        result.flips[numbers] = (dots < 0).sum(axis=0)
        result.wide[numbers] = (angles > WIDE_STEP).sum(axis=0)
        result.widest[numbers] = angles.max(axis=0, initial=0.0)
        values = quaternion.align_signs(values)
    constant = _same_values(group, values)
    result.constant[numbers] = constant
    result.no_effect[numbers] = _at_rest(group, constant, skeleton)
    result.redundant[numbers] = _redundant(group, values, constant)


def _same_values(group: _Group, values: Floats) -> Bools:
    size = np.abs(values).max(axis=(0, 2))
    same: Bools = np.abs(values - values[:1]).max(axis=(0, 2)) <= FLOAT32 * size
    if group.tangents is not None:
        arriving, leaving = group.tangents
        same &= (np.abs(arriving[1:]).max(axis=(0, 2)) == 0) & (np.abs(leaving[:-1]).max(axis=(0, 2)) == 0)
    return same


def _at_rest(group: _Group, constant: Bools, skeleton: Skeleton) -> Bools:
    if group.path not in ("translation", "rotation", "scale") or not constant.any():
        return np.zeros(len(constant), np.bool_)
    nodes = [track.node if track.node is not None else -1 for track in group.tracks]
    resting: Floats = getattr(skeleton, group.path)[nodes]
    values = group.values[0]
    if group.kind is Kind.ROTATION:
        values = values * np.where(quaternion.dot(values, resting) < 0, -1.0, 1.0)[:, None]
    near: Bools = np.abs(values - resting).max(axis=1) <= 1e-6 * (1 + np.abs(resting).max(axis=1))
    return constant & near


def _redundant(group: _Group, values: Floats, constant: Bools) -> Ints:
    """Keys that what is around them gives anyway: all but one of a constant track, inner ones of the others."""
    keys = len(values)
    result: Ints = np.where(constant, keys - 1, 0)
    moving = np.flatnonzero(~constant)
    if keys >= 3 and len(moving):
        result[moving] = _inner_redundant(group, values[:, moving], moving).sum(axis=0)
    return result


def _inner_redundant(group: _Group, values: Floats, moving: Ints) -> Bools:
    """For every inner key of the moving tracks (K − 2, G), whether its neighbors give it."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    if group.interpolation is Interpolation.STEP:
        return np.asarray(np.abs(here - before).max(axis=2) == 0)
    extent = (values.max(axis=0) - values.min(axis=0)).max(axis=1)
    allowed = REDUNDANT * extent + FLOAT32 * np.abs(values).max(axis=(0, 2))
    times = group.times[:, moving]
    duration = times[2:] - times[:-2]
    u = (times[1:-1] - times[:-2]) / duration
    if group.tangents is not None:
        return _inner_cubic(group.tangents, values, moving, u, duration, allowed)
    if group.kind is Kind.ROTATION:
        given = quaternion.slerp(before, after, u)
    else:
        given = before + u[..., None] * (after - before)
    return np.asarray(np.abs(here - given).max(axis=2) <= allowed)


def _inner_cubic(
    tangents: tuple[Floats, Floats], values: Floats, moving: Ints, u: Floats, duration: Floats, allowed: Floats
) -> Bools:
    arriving, leaving = tangents[0][:, moving], tangents[1][:, moving]
    u, duration = u[..., None], duration[..., None]
    piece = (values[:-2], duration * leaving[:-2], values[2:], duration * arriving[2:])
    off = np.abs(values[1:-1] - hermite.evaluate(u, *piece)).max(axis=2)
    slope = hermite.first_derivative(u, *piece)  # per u of the joined piece: as large as the values
    bend = np.maximum(np.abs(duration * arriving[1:-1] - slope), np.abs(duration * leaving[1:-1] - slope)).max(axis=2)
    return np.asarray((off <= allowed) & (bend <= 10 * allowed))

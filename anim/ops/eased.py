"""What an ease makes of a track: as cubic pieces where there is a closed form, as functions of time where not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.ease import Easing, Piece, evaluate
from anim.curves.easing import EASINGS
from anim.curves.fit import cubic_pieces
from anim.curves.fit_rotation import fit_rotation
from anim.maths import hermite, quaternion
from anim.model import Interpolation, Kind, Track
from anim.ops.assemble import JUMP, Pieces, joined
from anim.sampling import piece

JOINT = 1e-12  # of an ease; nearer than this to where two of its cubics meet is there
LINE = (Piece(0, 1, 0, 1, 1, 1),)


def eased_pieces(track: Track, inside: Bools, easing: Easing, tolerance: float, angle_tolerance: float) -> Pieces:
    """Return the cubics of a LINEAR track with the pieces `inside` (K − 1,) eased, the others as they are.

    tolerance: share of a piece's range, where the ease is not cubic. angle_tolerance: radians, for rotations.
    """
    if track.kind is Kind.ROTATION:
        q = quaternion.normalize(track.values)
        eases = (easing if eased else EASINGS["linear"] for eased in inside.tolist())
        return joined([_turn(track, q, k, each, angle_tolerance) for k, each in enumerate(eases)])
    cubics = cubic_pieces(easing, tolerance=tolerance)
    return joined([_move(track, k, cubics if eased else LINE) for k, eased in enumerate(inside.tolist())])


def stepped_pieces(track: Track, inside: Bools, easing: Easing, *, angle_tolerance: float) -> Pieces:
    """Return the pieces of a track that holds and jumps by a stepped ease where `inside`, and stays itself elsewhere.

    Where the last one is inside, a piece of one jump's length ends at the last key's value.
    """
    assert easing.exact is not None
    levels = np.array([(p.start, p.end, p.value0) for p in easing.exact])
    parts = []
    for k in range(len(track.times) - 1):
        if not inside[k]:
            parts.append(_unchanged(track, k, angle_tolerance))
            continue
        at = track.times[k] + (track.times[k + 1] - track.times[k]) * levels[:, :2]
        values = piece.values(track, np.full(len(levels), k), levels[:, 2])
        parts.append(_still(at[:, 0], at[:, 1], values, values))
    if inside[-1]:
        end = track.times[-1:]
        parts.append(_still(end if inside.all() else end - JUMP, end, values[-1:], track.values[-1:]))
        parts[-2].end[-1] = parts[-1].start[0]
    return joined(parts) if not inside.all() else _without_last_start(joined(parts))


class EasedTrack:
    """An eased track as functions of time: values and, just before or after, rates."""

    def __init__(self, track: Track, inside: Bools, cubics: Sequence[Piece]) -> None:
        self._track, self._inside, self._cubics = track, inside, tuple(cubics)

    def values(self, times: Floats) -> Floats:
        """Return the values (F, C) at times (F,)."""
        left, u = self._place(times, before=False)
        return piece.values(self._track, left, np.where(self._inside[left], evaluate(self._cubics, u), u))

    def rates(self, times: Floats, before: bool) -> Floats:
        """Return the change per second (F, C), of rotations the angular velocity (F, 3), on one side of times (F,)."""
        left, u = self._place(times, before=before)
        inside = self._inside[left]
        share = np.where(inside, evaluate(self._cubics, u), u)
        tempo = np.where(inside, slope(self._cubics, u, before=before), 1.0)
        duration = self._track.times[left + 1] - self._track.times[left]
        return piece.rates(self._track, left, share) * (tempo / duration)[:, None]

    def _place(self, times: Floats, *, before: bool) -> tuple[Ints, Floats]:
        keys = self._track.times
        found = np.searchsorted(keys, times, side="left" if before else "right") - 1
        left = np.clip(found, 0, len(keys) - 2)
        return left, np.clip((times - keys[left]) / (keys[left + 1] - keys[left]), 0.0, 1.0)


def slope(cubics: tuple[Piece, ...], u: Floats, *, before: bool) -> Floats:
    """Return the slope of an ease given as cubics, just before or just after u (F,)."""
    start, end, value0, value1, slope0, slope1 = _columns(cubics).T
    shifted = u - JOINT if before else u + JOINT
    at = np.clip(np.searchsorted(start, shifted, side="right") - 1, 0, len(cubics) - 1)
    length = (end - start)[at]
    inside = np.clip((u - start[at]) / length, 0.0, 1.0)
    rise = hermite.first_derivative(inside, value0[at], length * slope0[at], value1[at], length * slope1[at])
    return np.asarray(rise / length)


def _columns(cubics: Sequence[Piece]) -> Floats:
    return np.array([(p.start, p.end, p.value0, p.value1, p.slope0, p.slope1) for p in cubics])


def _move(track: Track, k: int, cubics: Sequence[Piece]) -> Pieces:
    duration, way = track.times[k + 1] - track.times[k], track.values[k + 1] - track.values[k]
    rows = _columns(cubics)
    at = track.times[k] + duration * rows[:, :2]
    value = track.values[k] + rows[:, 2:4, None] * way
    slope = rows[:, 4:, None] * (way / duration)
    value[0, 0], value[-1, 1], at[-1, 1] = track.values[k], track.values[k + 1], track.times[k + 1]
    return Pieces(at[:, 0], at[:, 1], value[:, 0], value[:, 1], slope[:, 0], slope[:, 1])


def _turn(track: Track, q: Floats, k: int, easing: Easing, tolerance: float) -> Pieces:
    duration = track.times[k + 1] - track.times[k]
    keys = fit_rotation(q[k], q[k + 1], easing, tolerance)
    at = track.times[k] + duration * keys.u
    at[-1] = track.times[k + 1]
    r, leaving, arriving = keys.rotations, keys.out_tangents / duration, keys.in_tangents / duration
    return Pieces(at[:-1], at[1:], r[:-1], r[1:], leaving[:-1], arriving[1:])


def _unchanged(track: Track, k: int, angle_tolerance: float) -> Pieces:
    if track.interpolation is Interpolation.LINEAR:
        if track.kind is Kind.ROTATION:
            return _turn(track, quaternion.normalize(track.values), k, EASINGS["linear"], angle_tolerance)
        return _move(track, k, LINE)
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    here, there = slice(k, k + 1), slice(k + 1, k + 2)
    ends = (track.times[here], track.times[there], track.values[here], track.values[there])
    return Pieces(*ends, track.out_tangents[here], track.in_tangents[there])


def _still(start: Floats, end: Floats, value0: Floats, value1: Floats) -> Pieces:
    none = np.zeros_like(value0)
    return Pieces(start.copy(), end.copy(), value0, value1, none, none)


def _without_last_start(pieces: Pieces) -> Pieces:
    """For STEP: the last piece, which only carries the last key's value, has no key of its own at its start."""
    ended = np.concatenate((pieces.value1[:-2], pieces.value1[-1:]))
    parts = (pieces.start[:-1], pieces.end[:-1], pieces.value0[:-1], ended, pieces.slope0[:-1], pieces.slope1[:-1])
    return Pieces(*parts)

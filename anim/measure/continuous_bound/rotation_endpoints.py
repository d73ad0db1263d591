"""Quaternions at both ends of every interval by player, and their arcs between.

Within an interval a quaternion is a mix c of two keys, on a line (c″ = 0), on an arc (c″ = −ν²c) or on a cubic,
unchanged or normalized. L pairs of a node and an interval are those of `node_tracks`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.measure.continuous_bound.endpoints import keys_of, of_batch
from anim.measure.continuous_bound.node_tracks import NodeTracks, pairs_of
from anim.model import Interpolation
from anim.sampling.players import GLTF, PLAYERS, is_divided


class RotationEndpoints(NamedTuple):
    """Mixes of P players, in L pairs of a node and an interval.

    value: (2, 4, P, L), at both ends. turn: (P, L) rad, ν times the interval's length; 0 on lines and cubics.
    unit: (P, L) whether the mix is normalized. next_unit: the same after the interval; the opposite if unknown.
    cubic: slope per s and bend per s² (2, 2, 4, 1, L) of cubics, 0 of others; None without cubics.
    is_cubic: (L,).
    """

    value: Floats
    turn: Floats
    unit: Bools
    next_unit: Bools
    cubic: Floats | None
    is_cubic: Bools


class _Keys(NamedTuple):
    """Keys of tracks in L pairs of a node and an interval.

    keys: (2, 4, L), the stored keys on both sides. shares: (2, L) interpolation parameters at both ends of intervals.
    mixed: (L,) whether LINEAR keys are interpolated there. tracked: (L,) whether there is a track. last: (L,) whether
    it is the node's last interval. ended: (L,), whether there is no key after that. cubic, is_cubic: as in
    `RotationEndpoints`.
    """

    keys: Floats
    shares: Floats
    mixed: Bools
    tracked: Bools
    last: Bools
    ended: Bools
    cubic: Floats
    is_cubic: Bools


def rotation_endpoints(tracks: Sequence[NodeTracks], *, players: Sequence[str]) -> RotationEndpoints:
    """Return the rotations of nodes in intervals, all pairs of one clip after those of another.

    players: names in PLAYERS.
    """
    of = _keys(tracks)
    a, b = _stored_for(of, players)
    b *= np.where((a * b).sum(axis=0) < 0, -1.0, 1.0)
    theta, unit = np.zeros(a.shape[1:]), np.zeros(a.shape[1:], np.bool_)
    for p, player in enumerate(players):
        angle, divided = PLAYERS[player].arc(a[:, p], b[:, p])
        theta[p] = np.where(of.mixed, angle, 0.0)
        unit[p] = np.where(of.mixed, divided, of.tracked & is_divided(player)) | of.is_cubic
    value = _blend(a, b, theta, of.shares)
    has_cubics = bool(of.is_cubic.any())
    if has_cubics:
        value[..., of.is_cubic] = of.keys[:, :, None, of.is_cubic]
    at_end = np.where(of.ended, [[is_divided(player)] for player in players] & of.tracked, ~unit) | of.is_cubic
    after = np.where(of.last, at_end, np.roll(unit, -1, axis=1))
    turn = theta * (of.shares[1] - of.shares[0])
    return RotationEndpoints(value, turn, unit, after, of.cubic if has_cubics else None, of.is_cubic)


def _keys(tracks: Sequence[NodeTracks]) -> _Keys:
    num_pairs = sum(each.num_pairs for each in tracks)
    is_cubic = any(lazy.is_cubic for each in tracks for lazy in each.tracks)
    cubic = np.zeros((2, 2, 4, 1, num_pairs if is_cubic else 0))
    mixed, tracked, last, ended, cubics = np.zeros((5, num_pairs), np.bool_)
    found = _Keys(np.empty((2, 4, num_pairs)), np.zeros((2, num_pairs)), mixed, tracked, last, ended, cubic, cubics)
    for each, pairs in pairs_of(tracks):
        parts: list[Any] = [each.view(whole[..., pairs]) if whole.size else whole for whole in found]
        _write_keys(each, _Keys(*parts))
    return found


def _write_keys(of: NodeTracks, into: _Keys) -> None:
    """Write the keys of one clip's nodes into views (..., U, G) of those of all pairs."""
    into.keys[...] = of.rest.T[:, :, None]
    into.last[:, -1:], into.ended[...] = True, True
    for lazy in of.tracks:
        rows = of.rows(lazy)
        into.tracked[rows], into.ended[rows] = True, of.where.edges[-1] >= lazy.time_axis.times[-1]
        batch, at = keys_of(lazy, of.where)
        if batch.tangents is not None:
            value, slope, bend = of_batch(batch, at)
            into.keys[..., rows, :], into.is_cubic[rows] = value, True
            into.cubic[..., rows, :] = np.stack((slope, bend))[:, :, :, None]
            continue
        into.keys[0][:, rows] = batch.values[at.left].T
        is_linear = batch.interpolation is Interpolation.LINEAR
        into.keys[1][:, rows] = batch.values[at.right].T if is_linear else into.keys[0][:, rows]
        if is_linear:
            into.shares[:, rows] = np.stack((at.start, at.end))[:, None]
            into.mixed[rows] = at.inside


def _stored_for(of: _Keys, players: Sequence[str]) -> tuple[Floats, Floats]:
    """The keys on both sides (4, P, L) as each player uses them before interpolation."""
    directed = of.keys
    if GLTF in players:
        length = np.sqrt((of.keys * of.keys).sum(axis=1))
        directed = of.keys / np.where(of.tracked & ~of.is_cubic, length, 1.0)[:, None]
    a, b = (np.stack([(directed if player == GLTF else of.keys)[k] for player in players], axis=1) for k in (0, 1))
    return a, b


def _blend(a: Floats, b: Floats, angle: Floats, shares: Floats) -> Floats:
    """Mixes (2, 4, P, L) of quaternions (4, P, L) with `angle` (P, L), at parameters (2, L)."""
    angle = np.maximum(angle, quaternion.MIN_ANGLE)
    whole = np.sin(angle)
    result = np.empty((2, *a.shape))
    for k, u in enumerate(shares):
        if not (u - k).any():  # the keys themselves
            result[k] = (a, b)[k]
            continue
        np.multiply(np.sin((1 - u) * angle) / whole, a, out=result[k])
        result[k] += (np.sin(u * angle) / whole) * b
    return result

"""Quaternions at both ends of every interval by player, and their arcs between.

Within an interval a quaternion is a mix c of two keys, on a line (c″ = 0), on an arc (c″ = −ν²c) or on a cubic,
unchanged or normalized.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats
from anim.measure.continuous_bound.endpoints import of_batch
from anim.measure.continuous_bound.intervals import Intervals
from anim.model import Interpolation
from anim.sampling.batch import Batch
from anim.sampling.players import GLTF, PLAYERS, is_divided


class RotationEndpoints(NamedTuple):
    """Mixes of P players, in G intervals, of U nodes.

    value: (2, 4, P, G, U), at both ends. turn: (P, G, U) rad, ν times the interval's length; 0 on lines and cubics.
    unit: (P, G, U) whether the mix is normalized. next_unit: the same after the interval; the opposite if unknown.
    cubic: slope per s and bend per s² (2, 2, 4, 1, G, U) of cubics, 0 of others; None without cubics.
    is_cubic: (U,).
    """

    value: Floats
    turn: Floats
    unit: Bools
    next_unit: Bools
    cubic: Floats | None
    is_cubic: Bools


class _Keys(NamedTuple):
    """Keys of tracks in G intervals and U nodes.

    keys: (2, 4, G, U), the stored keys on both sides. shares: (2, G, U) interpolation parameters at both ends of
    intervals. mixed: (G, U) whether LINEAR keys are interpolated there. tracked: (U,) whether there is a track. ended:
    (U,), whether it has no key after the last interval. cubic, is_cubic: as in `RotationEndpoints`.
    """

    keys: Floats
    shares: Floats
    mixed: Bools
    tracked: Bools
    ended: Bools
    cubic: Floats | None
    is_cubic: Bools


def rotation_endpoints(
    rest: Floats, tracks: Sequence[Batch], place: Mapping[int, int], where: Intervals, *, players: Sequence[str]
) -> RotationEndpoints:
    """Return the rotations of nodes, `rest` (U, 4) for those without a track.

    place: index of each node among them, by node index. players: names in PLAYERS.
    """
    of = _keys(rest, tracks, place, where)
    a, b = _stored_for(of, players)
    b *= np.where((a * b).sum(axis=0) < 0, -1.0, 1.0)
    theta, unit = np.zeros(a.shape[1:]), np.zeros(a.shape[1:], np.bool_)
    for p, player in enumerate(players):
        angle, divided = PLAYERS[player].arc(a[:, p], b[:, p])
        theta[p] = np.where(of.mixed, angle, 0.0)
        unit[p] = np.where(of.mixed, divided, of.tracked & is_divided(player)) | of.is_cubic
    value = _blend(a, b, theta, of.shares)
    if of.cubic is not None:
        value[..., of.is_cubic] = of.keys[:, :, None, :, of.is_cubic]
    last = np.where(of.ended, [[is_divided(player)] for player in players] & of.tracked, ~unit[:, -1]) | of.is_cubic
    after = np.concatenate((unit[:, 1:], last[:, None]), axis=1)
    return RotationEndpoints(value, theta * (of.shares[1] - of.shares[0]), unit, after, of.cubic, of.is_cubic)


def _keys(rest: Floats, tracks: Sequence[Batch], place: Mapping[int, int], where: Intervals) -> _Keys:
    shape = (len(where), len(rest))
    keys = np.broadcast_to(rest.T[:, None], (2, 4, *shape)).copy()
    shares, mixed = np.zeros((2, *shape)), np.zeros(shape, np.bool_)
    tracked, ended, is_cubic = (np.zeros(len(rest), np.bool_) for _ in range(3))
    ended[:] = True
    has_cubic = any(batch.interpolation is Interpolation.CUBICSPLINE for batch in tracks)
    cubic = np.zeros((2, 2, 4, 1, *shape)) if has_cubic else None
    for batch in tracks:
        columns = [place[track.node] for track in batch.tracks if track.node is not None]
        tracked[columns], ended[columns] = True, where.edges[-1] >= batch.times[-1]
        if batch.tangents is not None and cubic is not None:
            value, slope, bend = of_batch(batch, where)
            keys[..., columns], is_cubic[columns] = value, True
            cubic[..., columns] = np.stack((slope, bend))[:, :, :, None]
            continue
        at = where.on(batch.time_axis)
        keys[0][..., columns] = np.moveaxis(batch.values[at.left], -1, 0)
        is_linear = batch.interpolation is Interpolation.LINEAR
        keys[1][..., columns] = np.moveaxis(batch.values[at.right], -1, 0) if is_linear else keys[0][..., columns]
        if is_linear:
            shares[..., columns] = np.stack((at.start, at.end))[..., None]
            mixed[:, columns] = at.inside[:, None]
    return _Keys(keys, shares, mixed, tracked, ended, cubic, is_cubic)


def _stored_for(of: _Keys, players: Sequence[str]) -> tuple[Floats, Floats]:
    """The keys on both sides (4, P, G, U) as each player uses them before interpolation."""
    directed = of.keys
    if GLTF in players:
        length = np.sqrt((of.keys * of.keys).sum(axis=1))
        directed = of.keys / np.where(of.tracked & ~of.is_cubic, length, 1.0)[:, None]
    a, b = (np.stack([(directed if player == GLTF else of.keys)[k] for player in players], axis=1) for k in (0, 1))
    return a, b


def _blend(a: Floats, b: Floats, angle: Floats, shares: Floats) -> Floats:
    """Mixes (2, 4, P, G, U) of quaternions (4, P, G, U) with `angle` (P, G, U), at parameters (2, G, U)."""
    angle = angle / np.pi
    whole = np.sinc(angle)
    result = np.empty((2, *a.shape))
    for k, u in enumerate(shares):
        if not (u - k).any():  # the keys themselves
            result[k] = (a, b)[k]
            continue
        np.multiply((1 - u) * np.sinc((1 - u) * angle) / whole, a, out=result[k])
        result[k] += (u * np.sinc(u * angle) / whole) * b
    return result

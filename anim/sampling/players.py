"""Interpolation of LINEAR rotations by different players.

Each player is a row of PLAYERS with its arc, from which values and bounds on derivatives follow.

glTF specifies slerp. Quaternions stored as integers or rounded floats are rarely of unit length, though; players differ
in their treatment of that, and some do not rotate at constant speed. An error bound holds in a player only if it was
measured with that player's interpolation.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import RangeError, check_type
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Skeleton, ValueKind
from anim.sampling.pose import PoseSampler, Sampler, Tracks, sample_batch
from anim.sampling.track import KeyInterval

THREE_NLERP_DOT = 0.9995  # three.js r187, Quaternion.slerpFlat: from this dot product on the chord, normalized
BABYLON_LERP_DOT = 0.999999  # Babylon.js 7, Quaternion.SlerpToRef: from this dot product on the chord, not normalized


class PlayerModel(NamedTuple):
    """Interpolation of rotations by a player.

    about: players that use it. normalizes: whether values at keys, of STEP and outside the keys are normalized.
    arc: (a, b) with keys (4, ...) in one hemisphere, normalized for GLTF → the angle θ (...) in radians, 0 for a line,
    of (sin((1 − u)θ)·a + sin(uθ)·b) / sin θ, and a mask (...) of those that are then normalized.
    """

    about: str
    arc: Callable[[Floats, Floats], tuple[Floats, Bools]]
    normalizes: bool = True


def sampler_for(skeleton: Skeleton, clip: Clip, *, player: str = "spec") -> PoseSampler:
    """Return the sampler of a clip on a skeleton with the interpolation of a player.

    player: a name in PLAYERS. With one that does not normalize, rotations of the poses are not of unit length, and
    world matrices from them scale, as they do in that player.
    """
    return PoseSampler(skeleton, clip, sampler(player))


def parse_pair(player: str) -> tuple[str, str]:
    """Return the players of the clips before and after: "nlerp" for both, "spec,nlerp" for one each.

    Raises RangeError for a name that is not in PLAYERS.
    """
    check_type(player, str, "player")
    names = player.split(",")
    if len(names) > 2 or any(name not in PLAYERS for name in names):
        raise RangeError(f"players are '{player}' (expected one or two of {', '.join(PLAYERS)}, with a comma between)")
    return names[0], names[-1]


def sampler(player: str) -> Sampler:
    """Return the function that samples tracks like a player, a name in PLAYERS."""
    if player == GLTF:
        return sample_batch
    chosen = PLAYERS[player]
    return lambda batch, at, place: _sample_batch(chosen, batch, at, place)


def _sample_batch(player: PlayerModel, batch: Tracks, at: Floats, place: KeyInterval) -> Floats:
    """Values as of `sample_batch`; players differ in LINEAR and STEP rotations only."""
    if batch.kind is not ValueKind.ROTATION or batch.interpolation is Interpolation.CUBICSPLINE:
        return batch.sample(at, place)
    start = batch.values[place.left]
    held = quaternion.normalize(start) if player.normalizes else start
    inside = batch.is_inside(at)
    if batch.interpolation is Interpolation.STEP or not inside.any():
        return held
    u = place.u[inside]
    held[inside] = _mix(
        player, batch.values, place.left[inside], u.reshape(u.shape + (1,) * (held.ndim - inside.ndim - 1))
    )
    return held


def _mix(player: PlayerModel, keys: Floats, left: Ints, u: Floats) -> Floats:
    """Mixes of neighboring keys (K, ..., 4): each of `left` (F,) and the next, at parameters u (F, ...).

    What depends on the keys alone is computed once per key or once per time, whichever is less.
    """
    first, last = int(left.min()), int(left.max())
    if last - first < len(left):
        a, b, left = keys[first : last + 1], keys[first + 1 : last + 2], left - first
    else:  # as of a few times of many tracks, whose keys are concatenated
        a, b, left = keys[left], keys[left + 1], np.arange(len(left))
    b = np.where(quaternion.dot(a, b)[..., None] < 0, -b, b)
    theta, divided = player.arc(np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0))
    if not u.any():  # all at keys
        mixed = a[left]
    elif theta.any():
        theta = np.maximum(theta, quaternion.MIN_ANGLE)
        angle, whole = theta[left], np.sin(theta)[left]
        of_a, of_b = np.sin((1 - u) * angle) / whole, np.sin(u * angle) / whole
        mixed = of_a[..., None] * a[left] + of_b[..., None] * b[left]
    else:
        mixed = (1 - u)[..., None] * a[left] + u[..., None] * b[left]
    divided = divided[left]
    if divided.any():
        mixed[divided] = quaternion.normalize(mixed[divided])
    return np.asarray(mixed)


def _slerp_arc(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    minus, plus = b - a, b + a
    theta = 2 * np.arctan2(np.sqrt((minus * minus).sum(axis=0)), np.sqrt((plus * plus).sum(axis=0)))
    return theta, np.zeros(theta.shape, np.bool_)


def _chord_arc(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    del b
    return np.zeros(a.shape[1:]), np.ones(a.shape[1:], np.bool_)


def _three_arc(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    return _stored_arc(a, b, THREE_NLERP_DOT)


def _babylon_arc(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    theta, line = _stored_arc(a, b, BABYLON_LERP_DOT)
    return theta, np.zeros(line.shape, np.bool_)


def _stored_arc(a: Floats, b: Floats, short: float) -> tuple[Floats, Bools]:
    """Slerp angle of keys of any length, 0 from the dot product `short` on, and a mask of these."""
    dot = (a * b).sum(axis=0)
    equal = (a == b).all(axis=0)
    is_line = (dot >= short) | equal
    return np.arccos(np.where(is_line, 1.0, dot)), is_line & ~equal


GLTF = "spec"  # the player that normalizes keys first; arcs between them are of unit length

PLAYERS = {
    GLTF: PlayerModel("glTF: slerp of normalized keys", _slerp_arc),
    "three": PlayerModel("three.js: slerp of keys as stored, normalized only if they are close", _three_arc, False),
    "raw": PlayerModel("Babylon.js: slerp of keys as stored, never normalized", _babylon_arc, False),
    "nlerp": PlayerModel("Unity (glTFast), Blender: linear by component, then normalized", _chord_arc),
}


def is_divided(player: str) -> bool:
    """Return whether a player normalizes constant values; GLTF has normalized the keys before."""
    return PLAYERS[player].normalizes and player != GLTF

"""Interpolation of LINEAR rotations by different players.

Each player is a row of PLAYERS with its values and, for bounds on derivatives, its arc; a test compares the two.

glTF specifies slerp. Quaternions stored as integers or rounded floats are rarely of unit length, though; players differ
in their treatment of that, and some do not rotate at constant speed. An error bound holds in a player only if it was
measured with that player's interpolation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import RangeError, check_type
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Skeleton, ValueKind
from anim.sampling.batch import Batch, MixedBatch
from anim.sampling.pose import PoseSampler, Sampler, sample_batch
from anim.sampling.track import KeyInterval

THREE_NLERP_DOT = 0.9995  # three.js r187, Quaternion.slerpFlat: from this dot product on the chord, normalized
BABYLON_LERP_DOT = 0.999999  # Babylon.js 7, Quaternion.SlerpToRef: from this dot product on the chord, not normalized


@dataclass(frozen=True, slots=True)
class PlayerModel:
    """Interpolation of rotations by a player.

    about: players that use it. between: (a, b, u) with keys (..., 4) and u (..., 1) → (..., 4), None for glTF's slerp.
    normalizes: whether values at keys, of STEP and outside the keys are normalized.
    arc: (a, b) with keys (4, ...) in one hemisphere, normalized for GLTF → the angle θ (...) in radians, 0 for a line,
    of (sin((1 − u)θ)·a + sin(uθ)·b) / sin θ, and a mask (...) of those that are then normalized.
    """

    about: str
    arc: Callable[[Floats, Floats], tuple[Floats, Bools]]
    between: Callable[[Floats, Floats, Floats], Floats] | None = None
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
    chosen = PLAYERS[player]
    if chosen.between is None:
        return sample_batch
    return lambda batch, at, place: _sample_batch(chosen, batch, at, place)


def _sample_batch(player: PlayerModel, batch: Batch | MixedBatch, at: Floats, place: KeyInterval) -> Floats:
    """Values (F, G, C) of tracks; players differ in LINEAR and STEP rotations only."""
    if player.between is None or batch.kind is not ValueKind.ROTATION:
        return batch.sample(at, place)
    if batch.interpolation is Interpolation.CUBICSPLINE:
        return batch.sample(at, place)
    start = batch.values[place.left]
    held = quaternion.normalize(start) if player.normalizes else start
    inside = batch.is_inside(at)
    if batch.interpolation is Interpolation.STEP or not inside.any():
        return held
    result = held.copy()
    end, u = batch.values[place.right[inside]], place.u[inside]
    result[inside] = player.between(start[inside], end, u.reshape(u.shape + (1,) * (end.ndim - u.ndim)))
    return result


def _chord(a: Floats, b: Floats, u: Floats) -> Floats:
    """Normalized chord on the shorter side, of keys as stored."""
    return quaternion.normalize(a + u * (_align_sign(a, b) - a))


def _three_slerp(a: Floats, b: Floats, u: Floats) -> Floats:
    """Interpolation by three.js: slerp of keys as stored, for near keys the normalized chord."""
    return _slerp_stored(a, b, u, THREE_NLERP_DOT, quaternion.normalize)


def _babylon_slerp(a: Floats, b: Floats, u: Floats) -> Floats:
    return _slerp_stored(a, b, u, BABYLON_LERP_DOT, lambda chord: chord)


def _slerp_stored(a: Floats, b: Floats, u: Floats, short: float, finish: Callable[[Floats], Floats]) -> Floats:
    """Shoemake's formula on keys as stored, of any length; from the dot product `short` on the chord."""
    b = _align_sign(a, b)
    dot = (a * b).sum(axis=-1, keepdims=True)
    is_short = dot >= short
    theta = np.arccos(np.where(is_short, 0.0, dot))
    arc = (np.sin((1 - u) * theta) * a + np.sin(u * theta) * b) / np.sin(theta)
    chord = finish(a + u * (b - a))
    return np.where((a == b).all(axis=-1, keepdims=True), a, np.where(is_short, chord, arc))


def _align_sign(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.where((a * b).sum(axis=-1, keepdims=True) < 0, -b, b))


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
    "three": PlayerModel(
        "three.js: slerp of keys as stored, normalized only if they are close",
        _three_arc,
        _three_slerp,
        False,
    ),
    "raw": PlayerModel("Babylon.js: slerp of keys as stored, never normalized", _babylon_arc, _babylon_slerp, False),
    "nlerp": PlayerModel("Unity (glTFast), Blender: linear by component, then normalized", _chord_arc, _chord),
}


def is_divided(player: str) -> bool:
    """Return whether a player normalizes constant values; GLTF has normalized the keys before."""
    return PLAYERS[player].normalizes and player != GLTF

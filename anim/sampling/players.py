"""Interpolation of LINEAR rotations by different players.

glTF specifies slerp. Quaternions stored as integers or rounded floats are rarely of unit length, though; players differ
in their treatment of that, and some do not rotate at constant speed. An error bound holds in a player only if it was
measured with that player's interpolation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError, check_type
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Skeleton, ValueKind
from anim.sampling.batch import Batch
from anim.sampling.pose import PoseSampler, Sampler
from anim.sampling.track import KeyInterval

THREE_NLERP_DOT = 0.9995  # three.js r187, Quaternion.slerpFlat: from this dot product on the chord, normalized
BABYLON_LERP_DOT = 0.999999  # Babylon.js 7, Quaternion.SlerpToRef: from this dot product on the chord, not normalized


@dataclass(frozen=True, slots=True)
class PlayerModel:
    """Interpolation of rotations by a player.

    about: players that use it. between: (a, b, u) with keys (..., 4) and u (..., 1) → (..., 4), None for glTF's slerp.
    normalizes: whether values at keys, of STEP and outside the keys are normalized.
    """

    about: str
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
        return Batch.sample
    return lambda batch, at, place: _sample_batch(chosen, batch, at, place)


def _sample_batch(player: PlayerModel, batch: Batch, at: Floats, place: KeyInterval) -> Floats:
    """Values (F, G, C) of tracks on one time axis; players differ in LINEAR and STEP rotations only."""
    if player.between is None or batch.kind is not ValueKind.ROTATION:
        return batch.sample(at, place)
    if batch.interpolation is Interpolation.CUBICSPLINE:
        return batch.sample(at, place)
    start = batch.values[place.left]
    held = quaternion.normalize(start) if player.normalizes else start
    inside = (at >= batch.times[0]) & (at < batch.times[-1])
    if batch.interpolation is Interpolation.STEP or not inside.any():
        return held
    result = held.copy()
    end = batch.values[place.right[inside]]
    result[inside] = player.between(start[inside], end, place.u[inside][:, None, None])
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
    """Shoemake's formula on keys of any length; from the dot product `short` on the chord; equal keys as stored."""
    b = _align_sign(a, b)
    dot = (a * b).sum(axis=-1, keepdims=True)
    is_short = dot >= short
    theta = np.arccos(np.where(is_short, 0.0, dot))
    arc = (np.sin((1 - u) * theta) * a + np.sin(u * theta) * b) / np.sin(theta)
    chord = finish(a + u * (b - a))
    return np.where((a == b).all(axis=-1, keepdims=True), a, np.where(is_short, chord, arc))


def _align_sign(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.where((a * b).sum(axis=-1, keepdims=True) < 0, -b, b))


PLAYERS = {
    "spec": PlayerModel("as glTF says: slerp of normalized keys"),
    "three": PlayerModel(
        "three.js: slerp of keys as stored, normalized only where they are near each other", _three_slerp, False
    ),
    "raw": PlayerModel("Babylon.js: slerp of keys as stored, never normalized", _babylon_slerp, False),
    "nlerp": PlayerModel("Unity (glTFast), Blender: component by component, then normalized", _chord, True),
}

"""How players differ in what they make of LINEAR rotations: stored quaternions are rarely of unit length.

The format says slerp. Integers and rounded floats are a little too long or too short, though, and what a player does
about that, and whether it turns at constant speed at all, is its own. A bound on the error holds in a player only if
it was measured as that player plays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Skeleton, ValueKind
from anim.sampling.batch import Batch
from anim.sampling.pose import PoseSampler, Sampler
from anim.sampling.track import KeyInterval

SHORT_OF_THREE = 0.9995  # three.js r187, Quaternion.slerpFlat: from this dot product on the chord, normalized
SHORT_OF_RAW = 0.999999  # Babylon.js 7, Quaternion.SlerpToRef: from this dot product on the chord as it is


@dataclass(frozen=True, slots=True)
class PlayerModel:
    """A way to play rotations.

    about: who does so. between: (a, b, u) with keys (..., 4) and shares (..., 1) → (..., 4), None for glTF's own rule.
    normalizes: whether keys that are held or stepped come out at unit length.
    """

    about: str
    between: Callable[[Floats, Floats, Floats], Floats] | None = None
    normalizes: bool = True


def sampler_for(skeleton: Skeleton, clip: Clip, *, player: str = "spec") -> PoseSampler:
    """Return the clip on the skeleton as a player shows it, to be asked for poses at any times.

    player: a name in PLAYERS. With one that does not normalize, rotations of the poses are not of unit length, and
    world matrices from them scale, as they do in that player.
    """
    return PoseSampler(skeleton, clip, sampler(player))


def parse_pair(player: str) -> tuple[str, str]:
    """Return who plays the clip before and who the one after: "nlerp" plays both, "spec,nlerp" one each.

    Raises RangeError for a name that is not in PLAYERS.
    """
    names = player.split(",")
    if len(names) > 2 or any(name not in PLAYERS for name in names):
        raise RangeError(f"players are '{player}' (expected one or two of {', '.join(PLAYERS)}, with a comma between)")
    return names[0], names[-1]


def sampler(player: str) -> Sampler:
    """Return how a player, a name in PLAYERS, gets the values of tracks."""
    chosen = PLAYERS[player]
    if chosen.between is None:
        return Batch.sample
    return lambda batch, at, place: _sampled(chosen, batch, at, place)


def _sampled(player: PlayerModel, batch: Batch, at: Floats, place: KeyInterval) -> Floats:
    """Values (F, G, C) of tracks on one axis; all but linear and stepped rotations are played the same everywhere."""
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
    """The normalized chord on the shorter side, of keys as they are stored."""
    return quaternion.normalize(a + u * (_near(a, b) - a))


def _as_three(a: Floats, b: Floats, u: Floats) -> Floats:
    """What three.js makes of two keys: slerp of them as they are, near each other the normalized chord."""
    return _slerped(a, b, u, SHORT_OF_THREE, quaternion.normalize)


def _as_stored(a: Floats, b: Floats, u: Floats) -> Floats:
    return _slerped(a, b, u, SHORT_OF_RAW, lambda chord: chord)


def _slerped(a: Floats, b: Floats, u: Floats, short: float, finish: Callable[[Floats], Floats]) -> Floats:
    """Shoemake's formula on keys of any length; from the dot product `short` on the chord; equal keys as stored."""
    b = _near(a, b)
    dot = (a * b).sum(axis=-1, keepdims=True)
    is_short = dot >= short
    theta = np.arccos(np.where(is_short, 0.0, dot))
    arc = (np.sin((1 - u) * theta) * a + np.sin(u * theta) * b) / np.sin(theta)
    chord = finish(a + u * (b - a))
    return np.where((a == b).all(axis=-1, keepdims=True), a, np.where(is_short, chord, arc))


def _near(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.where((a * b).sum(axis=-1, keepdims=True) < 0, -b, b))


PLAYERS = {
    "spec": PlayerModel("as glTF says: slerp of normalized keys"),
    "three": PlayerModel(
        "three.js: slerp of keys as stored, normalized only where they are near each other", _as_three, False
    ),
    "raw": PlayerModel("Babylon.js: slerp of keys as stored, never normalized", _as_stored, False),
    "nlerp": PlayerModel("Unity (glTFast), Blender: component by component, then normalized", _chord, True),
}

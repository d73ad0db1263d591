"""How players go from one quaternion key to the next: along which arc, and whether what they mix is normalized.

`anim.sampling.players` plays; this says the same in terms that have derivatives, and a test holds the two together.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from anim.arrays import Bools, Floats
from anim.sampling.players import BABYLON_LERP_DOT, PLAYERS, THREE_NLERP_DOT

GLTF = "spec"  # the player that normalizes keys first; arcs between them are of unit length


def is_divided(player: str) -> bool:
    """Return whether a player divides by its length a key that is held; GLTF has done so before."""
    return PLAYERS[player].normalizes and player != GLTF


def _slerp_arcs(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    minus, plus = b - a, b + a
    theta = 2 * np.arctan2(np.sqrt((minus * minus).sum(axis=0)), np.sqrt((plus * plus).sum(axis=0)))
    return theta, np.zeros(theta.shape, np.bool_)


def _nlerp_chords(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    del b
    return np.zeros(a.shape[1:]), np.ones(a.shape[1:], np.bool_)


def _both_arcs(a: Floats, b: Floats, short: float) -> tuple[Floats, Bools]:
    """Shoemake's angle of keys of any length, 0 where they are nearer than `short`, and where they are but differ."""
    dot = (a * b).sum(axis=0)
    equal = (a == b).all(axis=0)
    is_line = (dot >= short) | equal
    return np.arccos(np.where(is_line, 1.0, dot)), is_line & ~equal


def _as_three(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    return _both_arcs(a, b, THREE_NLERP_DOT)


def _as_stored(a: Floats, b: Floats) -> tuple[Floats, Bools]:
    theta, line = _both_arcs(a, b, BABYLON_LERP_DOT)
    return theta, np.zeros(line.shape, np.bool_)


# By players' names: for keys a and b (4, ...) on one side, normalized for GLTF, the angle θ (...) in radians, 0 for a
# line, of (sin((1 − u)θ)·a + sin(uθ)·b) / sin θ, and whether that is divided by its length. Players that do so stand
# together, so that others need not be looked at for that.
ARCS: dict[str, Callable[[Floats, Floats], tuple[Floats, Bools]]] = {
    "spec": _slerp_arcs,
    "raw": _as_stored,
    "three": _as_three,
    "nlerp": _nlerp_chords,
}

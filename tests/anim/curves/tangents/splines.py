"""What tests of tangent rules share: uneven keys, the names of all rules, and the written cubic."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.curves.tangents.rule import SplineKeys
from anim.curves.tangents.table import TANGENTS
from anim.maths import hermite
from anim.maths import quaternion as quat

RNG = np.random.default_rng(11)
TIMES = np.cumsum(RNG.uniform(0.2, 1.5, 9)) - 0.2
VALUES = RNG.normal(size=(9, 3))
TURNS = quat.align_signs(np.asarray(Rotation.from_rotvec(VALUES).as_quat()))
EVERY = [*TANGENTS, "cardinal(0.5)", "tcb(0.2, 0, -0.3)"]
C1 = [name for name in EVERY if name != "centripetal"]


def piece(times: Floats, keys: SplineKeys, k: int, u: Floats, order: int = 0) -> Floats:
    """Return value, speed or acceleration (S, C) of the piece after key k, as a glTF player has it."""
    h = times[k + 1] - times[k]
    of = (hermite.evaluate, hermite.first_derivative, hermite.second_derivative)[order]
    ends = (keys.values[k], h * keys.out_tangents[k], keys.values[k + 1], h * keys.in_tangents[k + 1])
    return np.asarray(of(u[:, None], *ends) / h**order)

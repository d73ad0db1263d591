"""Key values that serve the whole motion between them, not only the moments at which they stand."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.optimize import play
from anim.sampling.track import Located

ENDS = 4.0  # weight of the first and the last moment: loops and cuts must still meet
STEPS = 1  # Gauss-Newton steps for rotations


class Fit:
    """Least squares on one time axis, prepared once for all tracks that use it."""

    def __init__(self, place: Located, keys: int) -> None:
        moments = len(place.u)
        hats = np.zeros((moments, keys))
        every = np.arange(moments)
        hats[every, place.left] += 1 - place.u
        hats[every, place.right] += place.u
        weights = np.ones(moments)
        weights[0] = weights[-1] = ENDS
        weighted = hats.T * weights
        self._place = place
        self._solve = np.linalg.solve(weighted @ hats, weighted)

    def vectors(self, values: Floats) -> Floats:
        """Return keys (K, G, C) whose lines are nearest to the values (W, G, C)."""
        return np.asarray(np.tensordot(self._solve, values, axes=1))

    def rotations(self, values: Floats, keys: Floats) -> Floats:
        """Return unit keys (K, G, 4) whose arcs are nearest to the rotations (W, G, 4), from `keys` on.

        Only what is left at a right angle to the curve counts: a linear fit of quaternions would also make up for the
        chord's shorter length, by keys that lie beside the motion.
        """
        for _ in range(STEPS):
            shown = play.along_arcs(keys, self._place)
            near = np.where(quaternion.dot(values, shown)[..., None] < 0, -values, values)
            off = near - shown
            off -= quaternion.dot(off, shown)[..., None] * shown
            keys = quaternion.normalize(keys + np.tensordot(self._solve, off, axes=1))
        return keys

"""One track of each kind on the same uneven keys, for tests of operations."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.model import Track
from tests import clips
from tests.clips import CUBICSPLINE, STEP

KEYS = np.array([0.0, 0.5, 1.25, 3.0])
RNG = np.random.default_rng(7)


def _tangents(width: int) -> tuple[Floats, Floats]:
    return 0.3 * RNG.normal(size=(4, width)), 0.3 * RNG.normal(size=(4, width))


TURNS = quaternion.align_signs(quaternion.normalize(RNG.normal(size=(4, 4))))
TRACKS = {
    "linear": clips.track("translation", KEYS, RNG.normal(size=(4, 3))),
    "cubic": clips.track("scale", KEYS, RNG.normal(size=(4, 3)), CUBICSPLINE, tangents=_tangents(3)),
    "slerp": clips.track("rotation", KEYS, TURNS),
    "turning": clips.track("rotation", KEYS, TURNS, CUBICSPLINE, tangents=_tangents(4)),
    "step": clips.track("translation", KEYS, RNG.normal(size=(4, 3)), STEP),
    "short": clips.track("translation", KEYS[1:3], RNG.normal(size=(2, 3))),
    "short step": clips.track("translation", KEYS[1:3], RNG.normal(size=(2, 3)), STEP),
    "flipped": clips.track("rotation", KEYS, TURNS * [[1], [-1], [-1], [1]]),
    "long arc": clips.track("rotation", KEYS, TURNS * [[1], [1], [-1], [1]], CUBICSPLINE, tangents=_tangents(4)),
}
ANCHOR = clips.track("scale", [0, 3], np.ones((2, 3)), node=9)  # gives every clip the range 0 … 3 s


def distance(track: Track, a: Floats, b: Floats) -> float:
    """Return the largest difference, of rotations the largest angle in rad."""
    return float(quaternion.angle_between(a, b).max() if track.path == "rotation" else np.abs(a - b).max())

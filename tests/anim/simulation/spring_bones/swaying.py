"""Chain of two joints on a root that sways, for tests of simulated clips."""

from __future__ import annotations

import numpy as np

from anim.model import Clip
from anim.simulation.spring_bones.chains import SpringBones, SpringChain, SpringJoint, SpringParameters
from tests.clips import about, skeleton, track

DOWN = [0, -0.2, 0]
CHAIN = skeleton([-1, 0, 1, 2], translation=[[0, 0, 0], [0, 1, 0], DOWN, DOWN])  # a root, two joints, and a tip
SOFT = SpringParameters(stiffness=0.5, drag=0.2, gravity=(0, -0.3, 0))
ONE = SpringChain("tail", (SpringJoint(1, 2, SOFT), SpringJoint(2, 3, SOFT)))
BONES = SpringBones((ONE,))


def swaying(*extra: object) -> Clip:
    """One second of a root that turns there and back."""
    times = np.arange(61) / 60
    turn = track("rotation", times, about("z", 40 * np.sin(2 * np.pi * times)))
    return Clip("sway", (turn, *extra))  # type: ignore[arg-type]

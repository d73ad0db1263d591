"""Closed loops of rigid bodies: the end of the motion leads over to its start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.simulation.rigid_bodies.impacts import Impact
from anim.simulation.rigid_bodies.motion import RigidMotion

BLEND_S = 0.2  # of the end, or half of a shorter loop


def close_loop(motion: RigidMotion, duration: float) -> tuple[RigidMotion, float]:
    """Return the motion with its last state equal to its first, and the seam: m, their largest distance before.

    duration: s, of the loop. A correction that grows smoothly over the last 0.2 s is added to positions and rotations.
    """
    last = int(np.searchsorted(motion.times, duration - 1e-9 * duration))
    shift = motion.positions[0] - motion.positions[last]
    turn = quaternion.multiply(motion.rotations[0], quaternion.conjugate(motion.rotations[last]))
    turned = quaternion.rotation_vector(turn)
    length = min(BLEND_S, duration / 2)

    def weight(times: Floats) -> Floats:
        u = np.clip((times - (duration - length)) / length, 0.0, 1.0)
        return np.asarray(u * u * (3 - 2 * u))

    w = weight(motion.times)[:, None, None]
    positions = motion.positions + w * shift
    rotations = quaternion.multiply(quaternion.from_rotation_vector(w * turned), motion.rotations)

    def closed(impact: Impact, body: int) -> Impact:
        u = weight(np.array(impact.time))
        correction = quaternion.from_rotation_vector(u * turned[body])
        position = impact.position + u * shift[body]
        return impact._replace(position=position, rotation=quaternion.multiply(correction, impact.rotation))

    impacts = [[closed(each, body) for each in found] for body, found in enumerate(motion.impacts)]
    seam = float(np.linalg.norm(shift, axis=-1).max(initial=0.0))
    return replace(motion, positions=positions, rotations=rotations, impacts=impacts), seam

"""Impacts inside steps: the times at which shapes touch, from their distance and velocities before.

Rapier lets a body go on until the end of the step in which it hits, and bounces it there. The distance of the shapes
at the start of that step, and their closing speed, give the time at which they touch, to the order of rotation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.simulation.rigid_bodies.rapier.world import RapierWorld
from anim.simulation.rigid_bodies.rigid_scene import BodyKind, RigidScene

MIN_IMPACT_SPEED_M_S = 0.3  # change of velocity that is an impact; bodies at rest in contact jitter less
MIN_OFFSET_M = 1e-5  # of a center of mass; less is float32's rounding
MAX_EARLY_STEPS = 1.5  # fast bodies are found inside others only after the step in which they hit
MAX_LATE_STEPS = 1.05  # of the start of the step
STEP_TOLERANCE = 1e-6  # of a step: rounding of n · step
SAME_IMPACT_STEPS = 2  # contact again within so many steps is the same impact: Rapier bounces in the step after it


class Impact(NamedTuple):
    """A body's frame at the moment of contact. time: s. until: s, the states before it and after `time` are wrong."""

    time: float
    position: Floats
    rotation: Floats
    until: float


@dataclass(frozen=True, slots=True, eq=False)
class _Frames:
    """All bodies at a step. positions: (B, 3) of their origins, centers: (B, 3) of mass, rotations: (B, 4)."""

    positions: Floats
    centers: Floats
    rotations: Floats


class ImpactFinder:
    """Impacts of a scene's moving bodies, found while it is stepped."""

    def __init__(self, scene: RigidScene, world: RapierWorld, step: float) -> None:
        self._world = world
        self._step = step
        self._moving = np.array(scene.moving, np.int64)
        dynamic = [body.kind is BodyKind.DYNAMIC for body in scene.bodies]
        factors = [body.motion.gravity_factor * is_ for body, is_ in zip(scene.bodies, dynamic, strict=True)]
        self._is_dynamic = np.array(dynamic)[self._moving]
        self._gravity = np.array(factors)[:, None] * np.array(scene.gravity)
        self._offsets = np.zeros((len(scene.bodies), 3))
        start = np.array([body.frame.position for body in scene.bodies]) - world.center
        rotations = np.array([body.frame.rotation for body in scene.bodies])
        self._before = self._previous = _Frames(start, start, rotations)
        self._has_offsets = False
        self._recent: dict[tuple[int, int], int] = {}
        self._num_steps = 0
        self._found: list[list[Impact]] = [[] for _ in scene.moving]

    def begin_round(self) -> list[list[Impact]]:
        """Count steps from 0 again, and return the lists of impacts by index into `scene.moving`, empty at first."""
        self._found = [[] for _ in self._moving]
        self._recent = {}
        return self._found

    def update(self, index: int, states: Floats, animated: tuple[list[int], Floats, Floats]) -> None:
        """Take the states (M, 7) at a step, relative to the world's center, and find its impacts.

        animated: bodies that the clip moves, their positions and rotations relative to the center.
        """
        if not self._num_steps:  # masses are known after the first step
            self._offsets[self._moving] = self._world.centers_of_mass()
            self._has_offsets = bool(np.abs(self._offsets).max(initial=0.0) > MIN_OFFSET_M)
            self._before = self._previous = self._frames(self._previous.positions, self._previous.rotations)
        self._num_steps += 1
        positions, rotations = self._previous.positions.copy(), self._previous.rotations.copy()
        positions[self._moving], rotations[self._moving] = states[:, :3], states[:, 3:]
        positions[animated[0]], rotations[animated[0]] = animated[1:]
        now = self._frames(positions, rotations)
        if self._num_steps > 1:
            h, m = self._step, self._moving
            jumps = now.centers[m] - 2 * self._previous.centers[m] + self._before.centers[m] - h * h * self._gravity[m]
            speeds = np.sqrt(np.einsum("mc,mc->m", jumps, jumps)) / h
            for k in np.flatnonzero((speeds > MIN_IMPACT_SPEED_M_S) & self._is_dynamic).tolist():
                self._find(index, k)
        self._before, self._previous = self._previous, now

    def _frames(self, positions: Floats, rotations: Floats) -> _Frames:
        if not self._has_offsets:
            return _Frames(positions, positions, rotations)
        return _Frames(positions, positions + quaternion.rotate(rotations, self._offsets), rotations)

    def _find(self, index: int, k: int) -> None:
        """Record the first contact of a moving body in the step before `index`, unless it touched before."""
        body = int(self._moving[k])
        first: float | None = None
        for other, distance, normal, point in self._world.pushing_contacts(body):
            again = index - self._recent.get((body, other), -1_000_000) <= SAME_IMPACT_STEPS
            self._recent[body, other] = index
            delay = None if again else self._delay(body, other, distance, normal, point)
            if delay is not None and (first is None or delay < first):
                first = delay
        if first is not None:
            self._found[k].append(self._at((index - 1) * self._step, first, body))

    def _delay(self, body: int, other: int, distance: float, normal: Floats, point: Floats) -> float | None:
        """Time from the start of the step until the shapes touch; None if they don't approach.

        normal: from `other` to `body`. Solves distance = closing · t + acceleration · t² / 2.
        """
        relative = self._velocity(body, point) - self._velocity(other, point)
        acceleration = float((self._gravity[other] - self._gravity[body]) @ normal)
        closing = -float(relative @ normal)
        under = closing * closing + 2 * acceleration * distance
        if closing <= 0 or under < 0:
            return None
        delay = 2 * distance / (closing + math.sqrt(under))
        return delay if -MAX_EARLY_STEPS <= delay / self._step <= MAX_LATE_STEPS else None

    def _velocity(self, body: int, point: Floats) -> Floats:
        """Velocity of a body's point at the start of the step."""
        before, now = self._before, self._previous
        linear = (now.centers[body] - before.centers[body]) / self._step + self._step / 2 * self._gravity[body]
        (x, y, z), (a, b, c) = self._spin(body), point - now.centers[body]
        return np.asarray(linear + np.array([y * c - z * b, z * a - x * c, x * b - y * a]))

    def _spin(self, body: int) -> tuple[float, float, float]:
        """Angular velocity in the step before, to second order of its angle; plain numbers, for speed."""
        (x, y, z, w), (a, b, c, d) = self._previous.rotations[body].tolist(), self._before.rotations[body].tolist()
        factor = math.copysign(2 / self._step, w * d + x * a + y * b + z * c)
        return (
            factor * (-w * a + x * d - y * c + z * b),
            factor * (-w * b + x * c + y * d - z * a),
            factor * (-w * c - x * b + y * a + z * d),
        )

    def _at(self, start: float, delay: float, body: int) -> Impact:
        """Frame of a body after `delay` s of free flight from the start of the step."""
        now = self._previous
        velocity = self._velocity(body, now.centers[body])
        center = now.centers[body] + delay * velocity + delay * delay / 2 * self._gravity[body]
        turned = quaternion.from_rotation_vector(delay * np.array(self._spin(body)))
        rotation = quaternion.normalize(quaternion.multiply(turned, now.rotations[body]))
        position = center - quaternion.rotate(rotation, self._offsets[body]) + self._world.center
        return Impact(start + delay, position, rotation, start + STEP_TOLERANCE * self._step)

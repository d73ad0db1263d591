"""Motion of free tails over one step: the specification's Verlet rule, and the exact damped oscillator.

Each model holds the state of one batch, in world space or in the space of the chains' centers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from anim.arrays import Floats
from anim.maths import matrix
from anim.simulation.integrators import DampedOscillator, find_integrator
from anim.simulation.spring_bones.chains import SpringParameters
from anim.simulation.spring_bones.collisions import TINY, norms

MAX_DEVIATION_PER_LENGTH = 1e3  # deviation of a mass in lengths of its bone, beyond which it has diverged


class SpringModel(Protocol):
    """State of m tails, and its advance by one step of fixed length.

    Arrays: head, goal, tail (m, 3) in world space; goal is the tail's position if the joint is at rest.
    center: world matrices (m, 3, 4) of the centers, None for world space.
    """

    def start(self, head: Floats, goal: Floats, center: Floats | None) -> None:
        """Set all tails to their goals, without velocity."""

    def predict(self, head: Floats, goal: Floats, center: Floats | None) -> Floats:
        """Return the tails (m, 3) at the end of the step, before their length and collisions are considered."""

    def accept(self, head: Floats, free: Floats, tail: Floats, center: Floats | None) -> None:
        """Take the tails at the end of the step. free: before collisions."""

    def transform(self, world: Floats, before: Floats | None, after: Floats | None) -> None:
        """Move the state by matrices (m, 3, 4) in world space, as the driver jumps. before, after: centers."""


class VerletModel:
    """Inertia, stiffness and gravity of VRMC_springBone: drag and forces are per step, whatever its length.

    Source: VRMC_springBone 1.0, inertia calculation. Players step at their frame rate; 1/60 s is what is seen.
    """

    def __init__(self, parameters: Sequence[SpringParameters], step: float) -> None:
        self._retained = np.array([[1 - each.drag] for each in parameters])
        self._pull = np.array([[each.stiffness * step] for each in parameters])
        self._force = np.array([each.gravity for each in parameters]) * step
        self._tail = self._previous = np.zeros((len(parameters), 3))

    def start(self, head: Floats, goal: Floats, center: Floats | None) -> None:
        """Set all tails to their goals, without velocity."""
        self._tail = self._previous = to_center(center, goal)

    def predict(self, head: Floats, goal: Floats, center: Floats | None) -> Floats:
        """Return the tails (m, 3) at the end of the step, before their length and collisions are considered."""
        bone = goal - head
        moved = from_center(center, self._tail + (self._tail - self._previous) * self._retained)
        return moved + bone * (self._pull / np.maximum(norms(bone), TINY)) + self._force

    def accept(self, head: Floats, free: Floats, tail: Floats, center: Floats | None) -> None:
        """Take the tails at the end of the step. free: before collisions."""
        self._previous, self._tail = self._tail, to_center(center, tail)

    def transform(self, world: Floats, before: Floats | None, after: Floats | None) -> None:
        """Move the state by matrices (m, 3, 4) in world space, as the driver jumps. before, after: centers."""
        for name in ("_tail", "_previous"):
            moved = apply_each(world, from_center(before, getattr(self, name)))
            setattr(self, name, to_center(after, moved))


class OscillatorModel:
    """Damped oscillator about the goal, solved exactly over a step in which the goal moves at constant velocity.

    The deviation e of the tail follows e″ + 2 ζ ω e′ + ω² e = g; its matrix exponential is bounded for every step
    length, so no step is unstable. Damping is relative to the goal: steady motion causes no lag.
    """

    def __init__(self, parameters: Sequence[SpringParameters], step: float) -> None:
        frequency = np.array([[2 * np.pi * (each.frequency or 0.0)] for each in parameters])
        ratio = np.array([[each.damping_ratio] for each in parameters])
        self._step = step
        self._transition = _transition(frequency, ratio, step)
        self._sag = np.array([each.gravity for each in parameters]) / (frequency * frequency)
        nothing = np.zeros((len(parameters), 3))
        self._tail = self._velocity = self._goal = self._head = self._free_velocity = nothing

    def start(self, head: Floats, goal: Floats, center: Floats | None) -> None:
        """Set all tails to their goals, without velocity."""
        self._tail = self._goal = to_center(center, goal)
        self._head = to_center(center, head)
        self._velocity = np.zeros_like(goal)

    def predict(self, head: Floats, goal: Floats, center: Floats | None) -> Floats:
        """Return the tails (m, 3) at the end of the step, before their length and collisions are considered."""
        before = from_center(center, self._goal)
        rate = (goal - before) / self._step
        error = from_center(center, self._tail) - before - self._sag
        velocity = _rotate(center, self._velocity) - rate
        aa, ab, ba, bb = self._transition
        self._free_velocity = ba * error + bb * velocity + rate
        self._goal = to_center(center, goal)
        return np.asarray(goal + self._sag + aa * error + ab * velocity)

    def accept(self, head: Floats, free: Floats, tail: Floats, center: Floats | None) -> None:
        """Take the tails at the end of the step. free: before collisions."""
        carried = (head - from_center(center, self._head)) / self._step
        velocity = self._free_velocity - carried
        velocity = velocity - _along(velocity, tail - head)
        pushed = tail - free
        against = (velocity * pushed).sum(axis=-1, keepdims=True) < 0
        velocity = velocity - np.where(against, _along(velocity, pushed), 0.0) + carried
        self._velocity = _rotate_back(center, velocity)
        self._tail, self._head = to_center(center, tail), to_center(center, head)

    def transform(self, world: Floats, before: Floats | None, after: Floats | None) -> None:
        """Move the state by matrices (m, 3, 4) in world space, as the driver jumps. before, after: centers."""
        for name in ("_tail", "_goal", "_head"):
            moved = apply_each(world, from_center(before, getattr(self, name)))
            setattr(self, name, to_center(after, moved))
        self._velocity = _rotate_back(after, _rotate(world, _rotate(before, self._velocity)))


class MassSpringModel(OscillatorModel):
    """The same oscillator as a mass on a spring to its goal, advanced by an integrator; bones may stretch.

    The joint points at the mass. elongation: (m,) of the bones, relative; energy: (m,) J of 1 kg, relative to its goal.
    A step beyond the integrator's limit diverges: positions become NaN.
    """

    def __init__(self, parameters: Sequence[SpringParameters], step: float, integrator: str) -> None:
        super().__init__(parameters, step)
        self._method = find_integrator(integrator)
        frequency = np.array([[2 * np.pi * (each.frequency or 0.0)] for each in parameters])
        ratio = np.array([[each.damping_ratio] for each in parameters])
        self._system = DampedOscillator(frequency, ratio)
        self._free = np.zeros((len(parameters), 3))
        self._relative = (self._free, self._free)
        self.elongation = np.zeros(len(parameters))
        self.energy = np.zeros(len(parameters))

    def start(self, head: Floats, goal: Floats, center: Floats | None) -> None:
        """Set all tails to their goals, without velocity: that of Verlet is half a step early."""
        super().start(head, goal, center)
        _, self._velocity = self._method.start(self._system, 0.0, -self._sag, self._velocity, self._step)

    def predict(self, head: Floats, goal: Floats, center: Floats | None) -> Floats:
        """Return the tails (m, 3) at the end of the step, before their length and collisions are considered."""
        before = from_center(center, self._goal)
        rate = (goal - before) / self._step
        error = from_center(center, self._tail) - before - self._sag
        velocity = _rotate(center, self._velocity) - rate
        error, velocity = self._method.step(self._system, 0.0, error, velocity, self._step)
        self._free_velocity = velocity + rate
        self._goal = to_center(center, goal)
        self._relative = error, velocity
        gone = norms(error) > MAX_DEVIATION_PER_LENGTH * norms(goal - head)
        self._free = np.where(gone, np.nan, goal + self._sag + error)
        return self._free

    def accept(self, head: Floats, free: Floats, tail: Floats, center: Floats | None) -> None:
        """Take the tails at the end of the step. free: before collisions; without one, the stretched tail counts."""
        self.elongation = (norms(self._free - head) / np.maximum(norms(tail - head), TINY))[:, 0] - 1
        error, velocity = self._relative
        elastic = np.square(self._system.omega * error).sum(axis=-1)
        self.energy = (elastic + (velocity * velocity).sum(axis=-1)) / 2
        pushed = tail - free
        hit = pushed.any(axis=-1, keepdims=True)
        velocity = self._free_velocity
        against = hit & ((velocity * pushed).sum(axis=-1, keepdims=True) < 0)
        velocity = velocity - np.where(against, _along(velocity, pushed), 0.0)
        self._velocity = _rotate_back(center, velocity)
        self._tail, self._head = to_center(center, np.where(hit, tail, self._free)), to_center(center, head)


def apply_each(matrices: Floats, points: Floats) -> Floats:
    """Return points (m, 3), each transformed by its own matrix (m, 3, 4)."""
    return np.asarray(np.matmul(matrices[..., :3], points[..., None])[..., 0] + matrices[..., 3])


def from_center(center: Floats | None, points: Floats) -> Floats:
    """Return points (m, 3) of center space in world space."""
    return points if center is None else apply_each(center, points)


def to_center(center: Floats | None, points: Floats) -> Floats:
    """Return points (m, 3) of world space in center space."""
    return points if center is None else apply_each(matrix.inverse(center), points)


def _rotate(center: Floats | None, vectors: Floats) -> Floats:
    return vectors if center is None else np.asarray(np.matmul(center[..., :3], vectors[..., None])[..., 0])


def _rotate_back(center: Floats | None, vectors: Floats) -> Floats:
    return vectors if center is None else _rotate(matrix.inverse(center), vectors)


def _along(vectors: Floats, directions: Floats) -> Floats:
    """Components of vectors (m, 3) along directions (m, 3) of any length; 0 for none."""
    square = (directions * directions).sum(axis=-1, keepdims=True)
    return np.asarray(directions * ((vectors * directions).sum(axis=-1, keepdims=True) / np.maximum(square, TINY)))


def _transition(frequency: Floats, ratio: Floats, step: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Matrix exponential of e″ + 2 ζ ω e′ + ω² e = 0 over a step, as its four elements (m, 1).

    Below critical damping cosine and sine, above it hyperbolic functions, written so that nothing overflows.
    """
    decay = ratio * frequency
    square = frequency * frequency - decay * decay
    root = np.sqrt(np.abs(square))
    slow = np.where(square > 0, decay, frequency * frequency / np.maximum(decay + root, TINY))
    even = np.where(square > 0, np.cos(root * step), (1 + np.exp(-2 * root * step)) / 2)
    small = root * step < 1e-8  # critical damping: sin(x)/x and sinh(x)/x are 1
    divisor = np.where(small, 1.0, root)
    odd = np.where(square > 0, np.sin(root * step), -np.expm1(-2 * root * step) / 2) / divisor
    odd = np.where(small, step, odd)
    fade = np.exp(-slow * step)
    cosine, sine = fade * even, fade * odd
    return cosine + decay * sine, sine, -frequency * frequency * sine, cosine - decay * sine


SPRING_MODELS: dict[str, Callable[[Sequence[SpringParameters], float], SpringModel]] = {
    "verlet": VerletModel,
    "oscillator": OscillatorModel,
}


def make_model(parameters: Sequence[SpringParameters], step: float, integrator: str = "") -> SpringModel:
    """Return the model of joints that all state a frequency, or none of which does.

    integrator: of masses on springs, in place of the exact solution; "" for that.
    """
    if integrator and parameters[0].frequency is not None:
        return MassSpringModel(parameters, step, integrator)
    return SPRING_MODELS["verlet" if parameters[0].frequency is None else "oscillator"](parameters, step)

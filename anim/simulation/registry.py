"""The kinds of simulation, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class SimulationKind:
    """One kind of simulation.

    about: for `--help`. step: default step in seconds, as a fraction.
    load: returns the function from scene, driving clip, description and options to a run with a `report`.
    """

    about: str
    step: str
    load: Callable[[], Callable[..., Any]]


def _springs() -> Callable[..., Any]:
    from anim.simulation.spring_bones.simulate import simulate_springs

    return simulate_springs


def _particles() -> Callable[..., Any]:
    from anim.simulation.particles.simulate import simulate_particles

    return simulate_particles


def _cloth() -> Callable[..., Any]:
    from anim.simulation.cloth.simulate import simulate_cloth

    return simulate_cloth


def _rigid() -> Callable[..., Any]:
    from anim.simulation.rigid_bodies.simulate import simulate_rigid_bodies

    return simulate_rigid_bodies


SIMULATIONS = {
    "springs": SimulationKind("Simulate hair, tails and other joint chains.", "1/60", _springs),
    "particles": SimulationKind("Emit particles from nodes or surfaces.", "1/240", _particles),
    "cloth": SimulationKind("Let a mesh, or a part of one, hang and blow as cloth.", "1/600", _cloth),
    "rigid": SimulationKind("Let rigid bodies fall, collide and come to rest.", "1/240", _rigid),
}

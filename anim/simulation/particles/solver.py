"""Run of all particles in fixed steps, with the time of each impact found inside its step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import UnstableError
from anim.memory import MemoryBudget
from anim.simulation.integrators import find_integrator
from anim.simulation.limits import MAX_COEFFICIENT, check_range
from anim.simulation.particles.attractors import Attractor
from anim.simulation.particles.emission import Births
from anim.simulation.particles.forces import Forces, pack_forces
from anim.simulation.particles.node_motion import NodeMotion
from anim.simulation.particles.obstacles import Obstacle, pack_obstacles
from anim.simulation.steps import Steps
from anim.units import plural

FEWER = "choose fewer particles, a shorter `lifetime` or `duration`, or a lower `fps`, or raise `memory_limit`"
KEY_BYTES = 900  # of a key, until it is written: a cubic in float64, copied several times
EXACT = ("verlet", "velocity-verlet", "rk4")  # for a constant acceleration


@dataclass(frozen=True, slots=True)
class Contact:
    """Coefficients of contacts: restitution 0 … 1, of the speed along the normal; friction, Coulomb's."""

    restitution: float = 0.5
    friction: float = 0.3

    def __post_init__(self) -> None:
        check_range("restitution", self.restitution, 0.0, 1.0)
        check_range("friction", self.friction, 0.0, MAX_COEFFICIENT)


@dataclass(frozen=True, slots=True, eq=False)
class ParticleKeys:
    """Keys of all particles, ordered by particle and time; between keys the path is the cubic through both.

    particles: (K,) indices. times: (K,) s. positions: (K, 3) m. in_velocities, out_velocities: (K, 3) m/s, which
    differ at impacts. num_impacts: of all. max_speed: m/s. penetration: m, the deepest at the end of a step.
    energies: (F, 3) at the frames: number of particles, kinetic and potential energy in J per kg of a particle.
    drift: 1/s, change of energy of the particles while they live, over their kinetic energy. num_inside: particles that
    are born inside an obstacle; it doesn't stop them until they have left it.
    """

    particles: Ints
    times: Floats
    positions: Floats
    in_velocities: Floats
    out_velocities: Floats
    num_impacts: int
    max_speed: float
    penetration: float
    energies: Floats
    drift: float
    num_inside: int

    def at(self, rows: Ints) -> ParticleKeys:
        """Return some of the keys; figures of the run stay."""
        names = ("particles", "times", "positions", "in_velocities", "out_velocities")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


class ParticleSolver:
    """Solver of one run: births, forces, obstacles, contact."""

    def __init__(
        self,
        births: Births,
        forces: Forces,
        obstacles: Sequence[Obstacle],
        contact: Contact,
        integrator: str,
        attractors: Sequence[Attractor] = (),
        motion: NodeMotion | None = None,
        period: float | None = None,
    ) -> None:
        """motion: of the nodes that carry obstacles and attractors. period: s of a loop."""
        find_integrator(integrator)
        self._births, self._forces, self._obstacles, self._contact = births, forces, obstacles, contact
        self._attractors, self._motion, self._period = attractors, motion, period
        self._integrator = integrator
        self._is_exact = forces.is_constant and not attractors and integrator in EXACT

    def run(self, steps: Steps, substeps: int) -> ParticleKeys:
        """Return the keys of the run: births, impacts, deaths, and where paths aren't parabolas, every frame.

        substeps: steps per frame. Raises UnstableError, whose `step` is the first bad step, and UnsupportedError for
        more keys than the limit of memory allows.
        """
        from anim.simulation.particles.kernels.contact import Grid
        from anim.simulation.particles.kernels.force_field import METHODS
        from anim.simulation.particles.kernels.particle_run import STATISTICS, run_particles
        from anim.simulation.particles.kernels.solids import MOVING

        self._check_memory(steps, substeps)
        first = -steps.num_warm_up_steps
        times: Floats = np.arange(first, steps.num_steps + 1, dtype=np.float64) * steps.step_s
        motion = self._motion
        drive = None if motion is None else lambda nodes: motion.at(times, nodes)
        field = pack_forces(self._forces, self._attractors, steps.step_s, first, drive, self._period)
        solids = pack_obstacles(self._obstacles, drive)
        grid = Grid(
            steps.step_s,
            first,
            steps.num_steps,
            float(steps.duration_s),
            substeps,
            # Position and velocity Verlet are one path; the latter can change its step at an impact.
            METHODS.index("velocity-verlet" if self._integrator == "verlet" else self._integrator),
            not self._is_exact,
            not self._forces.turbulence and not self._attractors,
            not self._is_exact and not solids.shapes[:, MOVING].any(),
            float(self._contact.restitution),
            float(self._contact.friction),
        )
        births = self._births
        positions, velocities = np.ascontiguousarray(births.positions), np.ascontiguousarray(births.velocities)
        keys, offsets, energies, found = run_particles(
            births.times, births.deaths, positions, velocities, field, solids, grid
        )
        figures = dict(zip(STATISTICS, found.tolist(), strict=True))
        if figures["bad_step"] < steps.num_steps:
            raise DivergedError(int(figures["bad_step"]), figures["bad_speed"])
        return ParticleKeys(
            np.repeat(np.arange(len(births)), np.diff(offsets)),
            keys[:, 0],
            keys[:, 1:4],
            keys[:, 4:7],
            keys[:, 7:10],
            int(figures["impacts"]),
            figures["max_speed"],
            figures["penetration"],
            energies,
            figures["energy_change"] / figures["kinetic_s"] if figures["kinetic_s"] else 0.0,
            int(figures["inside"]),
        )

    def _check_memory(self, steps: Steps, substeps: int) -> None:
        """Count keys before they are computed: two of each particle, and where paths aren't parabolas every frame."""
        births, frame_s = self._births, substeps * steps.step_s
        lives = np.minimum(births.deaths, steps.duration_s) - np.maximum(births.times, 0.0)
        num_keys = 2 * len(births) + (0 if self._is_exact else int(np.maximum(lives, 0.0).sum() / frame_s))
        what = f"{steps.duration_s:g} s of {plural(len(births), 'particle')}"
        MemoryBudget(0).check(KEY_BYTES * num_keys, what, help=FEWER)


class DivergedError(UnstableError):
    """A particle is faster than any real one in a step, the first such."""

    def __init__(self, step: int, speed: float) -> None:
        super().__init__(f"the simulation diverges in step {step}: a particle moves at {speed:g} m/s")
        self.step = step

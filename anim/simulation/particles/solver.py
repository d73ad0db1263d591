"""Fixed steps of all particles, with the time of each impact found inside its step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import RangeError, UnstableError
from anim.maths import hermite
from anim.simulation.integrators import find_integrator
from anim.simulation.particles.emission import Births
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.obstacles import Obstacle
from anim.simulation.steps import Steps

EXACT = ("verlet", "velocity-verlet", "rk4")  # for a constant acceleration
NUM_BISECTIONS = 60  # of a step: to the last bit
MAX_IMPACTS_PER_STEP = 12  # then the particle stays where it is until the next step
MAX_SPEED_M_S = 1e5  # beyond, the run is called unstable


@dataclass(frozen=True, slots=True)
class Contact:
    """Coefficients of contacts: restitution 0 … 1, of the speed along the normal; friction, Coulomb's."""

    restitution: float = 0.5
    friction: float = 0.3

    def __post_init__(self) -> None:
        if not 0 <= self.restitution <= 1:
            raise RangeError(f"`restitution` is {self.restitution:g} (expected 0 to 1)")
        if not (np.isfinite(self.friction) and self.friction >= 0):
            raise RangeError(f"`friction` is {self.friction:g} (expected a number of at least 0)")


@dataclass(frozen=True, slots=True, eq=False)
class ParticleKeys:
    """Keys of all particles, ordered by particle and time; between keys the path is the cubic through both.

    particles: (K,) indices. times: (K,) s. positions: (K, 3) m. in_velocities, out_velocities: (K, 3) m/s, which
    differ at impacts. num_impacts: of all. max_speed: m/s.
    """

    particles: Ints
    times: Floats
    positions: Floats
    in_velocities: Floats
    out_velocities: Floats
    num_impacts: int
    max_speed: float


@dataclass(slots=True, eq=False)
class _Recorder:
    rows: list[tuple[Ints, Floats, Floats, Floats, Floats]] = field(default_factory=list)

    def add(self, particles: Ints, times: Floats, x: Floats, v_in: Floats, v_out: Floats) -> None:
        if len(particles):
            self.rows.append(
                (particles, np.broadcast_to(times, particles.shape).copy(), x.copy(), v_in.copy(), v_out.copy())
            )


@dataclass(slots=True, eq=False)
class _Flight:
    """Particles over a part of a step: indices, start times (n,), lengths (n,), positions and velocities (n, 3)."""

    particles: Ints
    start: Floats
    length: Floats
    x: Floats
    v: Floats

    def at(self, chosen: Bools | Ints) -> _Flight:
        return _Flight(*(getattr(self, name)[chosen] for name in ("particles", "start", "length", "x", "v")))


class ParticleSolver:
    """Solver of one run: births, forces, obstacles, contact."""

    def __init__(
        self, births: Births, forces: Forces, obstacles: Sequence[Obstacle], contact: Contact, integrator: str
    ) -> None:
        self._births, self._forces, self._obstacles, self._contact = births, forces, obstacles, contact
        # Position and velocity Verlet are one path; the latter can change its step at an impact.
        self._method = find_integrator("velocity-verlet" if integrator == "verlet" else integrator)
        self._is_exact = forces.is_constant and integrator in EXACT
        self._x, self._v = births.positions.copy(), births.velocities.copy()
        self._resting = np.full(len(births), -1)  # index of the flat obstacle that a particle slides or rests on
        self._normals = np.zeros_like(self._x)
        self._asleep = np.zeros(len(births), bool)  # at rest for good
        self._keys = _Recorder()
        self._num_impacts = 0

    def run(self, steps: Steps, substeps: int) -> ParticleKeys:
        """Return the keys of the run: births, impacts, deaths, and where paths aren't parabolas, every frame.

        substeps: steps per frame. Raises UnstableError.
        """
        births, alive, born = self._births, np.zeros(0, np.int64), 0
        max_speed = 0.0
        for n in range(-steps.num_warm_up_steps, steps.num_steps):
            start = n * steps.step_s
            end = steps.duration_s if n == steps.num_steps - 1 else (n + 1) * steps.step_s
            if n == 0:
                self._record_frame(alive, 0.0)
            num = int(np.searchsorted(births.times, end, side="left"))
            new = np.arange(born, num)
            self._keys.add(new, births.times[new], self._x[new], self._v[new], self._v[new])
            alive, born = np.concatenate([alive, new]), num
            if len(alive):
                awake = alive[~self._asleep[alive]]
                begin = np.maximum(births.times[awake], start)
                stop = np.minimum(births.deaths[awake], end)
                self._advance(_Flight(awake, begin, stop - begin, self._x[awake], self._v[awake]))
                max_speed = max(max_speed, self._check_speed(awake, n))
                dead = births.deaths[alive] <= end
                gone = alive[dead]
                self._keys.add(gone, births.deaths[gone], self._x[gone], self._v[gone], self._v[gone])
                alive = alive[~dead]
                if not self._is_exact and (n + 1) % substeps == 0:
                    self._record_frame(alive[~self._asleep[alive]], end)
        last = alive if self._is_exact or steps.num_steps % substeps else alive[self._asleep[alive]]
        self._record_frame(last, steps.duration_s)
        return self._collect(max_speed)

    def _record_frame(self, alive: Ints, time: float) -> None:
        self._keys.add(alive, np.array(time), self._x[alive], self._v[alive], self._v[alive])

    def _check_speed(self, alive: Ints, n: int) -> float:
        with np.errstate(all="ignore"):
            v = self._v[alive]
            speed = float(np.sqrt(np.einsum("pc,pc->p", v, v).max(initial=0.0)))
        if not (speed < MAX_SPEED_M_S and np.isfinite(self._x[alive]).all()):
            raise UnstableError(f"the simulation diverges in step {n}: a particle moves at {speed:g} m/s")
        return speed

    def _advance(self, flight: _Flight) -> None:
        for _ in range(MAX_IMPACTS_PER_STEP):
            rest = self._resting[flight.particles] >= 0
            if rest.any():
                self._slide(flight.at(rest))
                flight = flight.at(~rest)
            if not len(flight.particles):
                return
            flight = self._fly(flight)
            if not len(flight.particles):
                return
        self._v[flight.particles] = 0.0  # wedged between obstacles

    def _fly(self, flight: _Flight) -> _Flight:
        """Advance free particles; return the remaining flights of those with an impact."""
        h = flight.length[:, None]
        x1, v1 = self._method.step(self._forces, flight.start[:, None], flight.x, flight.v, h)
        self._x[flight.particles], self._v[flight.particles] = x1, v1
        first = np.full(len(h), np.inf)
        which = np.full(len(h), -1)
        for k, obstacle in enumerate(self._obstacles):
            time = self._impact_times(obstacle, flight, x1, v1)
            nearer = time < first
            first[nearer], which[nearer] = time[nearer], k
        hit = which >= 0
        if not hit.any():
            return flight.at(hit)
        return self._bounce(flight.at(hit), x1[hit], v1[hit], first[hit], which[hit])

    def _impact_times(self, obstacle: Obstacle, flight: _Flight, x1: Floats, v1: Floats) -> Floats:
        """Time from the start of each flight to its impact (n,), infinite without one."""
        h = flight.length
        inside = np.full(len(h), np.inf)  # fraction of the step by which the particle is inside
        for fraction in reversed(obstacle.checked_fractions):
            x = x1 if fraction == 1.0 else _along(fraction, flight.x, flight.v, x1, v1, h)
            inside[obstacle.distance(x) < 0] = fraction
        found = np.flatnonzero(np.isfinite(inside))
        times = np.full(len(h), np.inf)
        if not len(found):
            return times
        x0, v0, h = flight.x[found], flight.v[found], h[found]
        touching = obstacle.distance(x0) <= 1e-12
        leaving = touching & ((v0 * obstacle.normal(x0)).sum(axis=1) > 0)
        low, high = np.zeros(len(found)), inside[found]
        low = np.where(leaving, 1e-3 * high, low)  # begins on the surface and comes back
        for _ in range(NUM_BISECTIONS):
            middle = 0.5 * (low + high)
            is_in = obstacle.distance(_along(middle[:, None], x0, v0, x1[found], v1[found], h)) < 0
            low, high = np.where(is_in, low, middle), np.where(is_in, middle, high)
        times[found] = low * h
        return times

    def _bounce(self, flight: _Flight, x1: Floats, v1: Floats, time: Floats, which: Ints) -> _Flight:
        h = flight.length
        u = np.divide(time, h, out=np.zeros_like(h), where=h > 0)[:, None]
        x = _along(u, flight.x, flight.v, x1, v1, h)
        m0, m1 = flight.v * h[:, None], v1 * h[:, None]
        v = hermite.first_derivative(u, flight.x, m0, x1, m1) / np.maximum(h, 1e-300)[:, None]
        at = flight.start + time
        after = v.copy()
        for k in np.unique(which):
            chosen = which == k
            normal = self._obstacles[k].normal(x[chosen])
            depth = np.maximum(-self._obstacles[k].distance(x[chosen]), 0)
            x[chosen] += depth[:, None] * normal
            after[chosen] = self._respond(
                flight.particles[chosen], int(k), at[chosen], x[chosen], v[chosen], normal, h[chosen]
            )
        self._keys.add(flight.particles, at, x, v, after)
        self._num_impacts += len(at)
        self._x[flight.particles], self._v[flight.particles] = x, after
        return _Flight(flight.particles, at, h - time, x, after)

    def _respond(
        self, particles: Ints, obstacle: int, at: Floats, x: Floats, v: Floats, normal: Floats, h: Floats
    ) -> Floats:
        """Velocities (n, 3) after an impact, by Newton's restitution and Coulomb's friction.

        A particle that would come back within the step stays on a flat obstacle.
        """
        e, mu = self._contact.restitution, self._contact.friction
        normal_speed = (v * normal).sum(axis=1)
        tangential = v - normal_speed[:, None] * normal
        speed = np.linalg.norm(tangential, axis=1)
        pull = -(self._forces.acceleration(at[:, None], x, v) * normal).sum(axis=1)
        bounce = -e * normal_speed
        stays = (pull > 0) & (2 * bounce < pull * np.maximum(h, 1e-6))
        bounce = np.where(stays, 0.0, bounce)
        lost = mu * (bounce - normal_speed)
        factor = np.maximum(1 - lost / np.maximum(speed, 1e-300), 0)
        if self._obstacles[obstacle].is_flat:
            on = particles[stays]
            self._resting[on], self._normals[on] = obstacle, normal[stays]
        return np.asarray(tangential * factor[:, None] + bounce[:, None] * normal)

    def _slide(self, flight: _Flight) -> None:
        """Advance particles on flat obstacles: Coulomb's friction against the other forces along the surface."""
        p, h = flight.particles, flight.length
        normal = self._normals[p]
        a = self._forces.acceleration(flight.start[:, None], flight.x, flight.v)
        push = (a * normal).sum(axis=1)
        along = a - push[:, None] * normal
        speed, pull = np.linalg.norm(flight.v, axis=1), np.linalg.norm(along, axis=1)
        grip = self._contact.friction * np.maximum(-push, 0)
        moving = speed > 0
        still = ~moving & (pull <= grip)
        direction = (
            np.where(moving[:, None], flight.v, along) / np.maximum(np.where(moving, speed, pull), 1e-300)[:, None]
        )
        total = np.where(still[:, None], 0.0, along - grip[:, None] * direction)
        slowing = -(total * direction).sum(axis=1)
        stop = np.where(moving & (slowing > 0), speed / np.maximum(slowing, 1e-300), np.inf)
        stops = stop < h
        t = np.minimum(stop, h)[:, None]
        x = flight.x + t * flight.v + 0.5 * t * t * total
        v = np.where(stops[:, None], 0.0, flight.v + t * total)
        if not self._forces.turbulence:  # the forces stay as they are
            self._asleep[p[still | (stops & (pull <= grip))]] = True
        self._keys.add(p[stops], (flight.start + stop)[stops], x[stops], v[stops], v[stops])
        self._x[p], self._v[p] = x, v
        for k in np.unique(self._resting[p]):
            chosen = self._resting[p] == k
            off = ~self._obstacles[k].contains_face(x[chosen], normal[chosen]) | (push[chosen] > 0)
            gone = p[chosen][off]
            self._resting[gone] = -1
            at = (flight.start + h)[chosen][off]
            self._keys.add(gone, at, self._x[gone], self._v[gone], self._v[gone])

    def _collect(self, max_speed: float) -> ParticleKeys:
        none = (np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)))
        rows = self._keys.rows or [none]
        particles, times, x, v_in, v_out = (np.concatenate(each) for each in zip(*rows, strict=True))
        order = np.argsort(particles, kind="stable")  # those of each are in the order of time
        order = order[times[order] >= 0]
        return ParticleKeys(
            particles[order], times[order], x[order], v_in[order], v_out[order], self._num_impacts, max_speed
        )


def _along(u: Floats | float, x0: Floats, v0: Floats, x1: Floats, v1: Floats, h: Floats) -> Floats:
    """Positions (n, 3) on the cubic with these ends, at fractions u of h: of a parabola the parabola itself."""
    return hermite.evaluate(np.asarray(u), x0, v0 * h[:, None], x1, v1 * h[:, None])

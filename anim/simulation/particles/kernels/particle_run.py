"""Steps of all particles, one particle after another, with the time of each impact found inside its step; compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.simulation.particles.kernels.contact import ORIGIN, Grid, respond, rest, slide_face, slide_surface
from anim.simulation.particles.kernels.force_field import (
    ForceField,
    acceleration,
    air_velocity,
    integrate,
    integrate_uniform,
    potential,
)
from anim.simulation.particles.kernels.recording import KEY_WIDTH, MAX_IMPACTS_PER_STEP, add_energy, grow, write_key
from anim.simulation.particles.kernels.solids import (
    BALL,
    FLOOR,
    MOVING,
    TOUCH_M,
    Solids,
    containing,
    distance,
    impact_fraction,
    is_flat,
    is_on_face,
    normal,
    surface_velocity,
)
from anim.simulation.particles.kernels.vectors import Vector, add, dot, hermite, hermite_velocity, length
from anim.skinning.kernels.jit import callee, inline, jit

MAX_SPEED_M_S = 1e5  # beyond, the run is called unstable
STATISTICS = ("impacts", "max_speed", "penetration", "bad_step", "bad_speed", "energy_change", "kinetic_s", "inside")


class State(NamedTuple):
    """Particle at a time.

    resting: the obstacle that it slides or rests on, or −1, and the normal of its face. ignored: bits of the obstacles
    that it was born in. is_asleep: at rest for good.
    """

    x: Vector
    v: Vector
    resting: int
    face: Vector
    ignored: int
    is_asleep: bool


@jit
def run_particles(
    births: Floats, deaths: Floats, positions: Floats, velocities: Floats, field: ForceField, solids: Solids, grid: Grid
) -> tuple[Floats, Ints, Floats, Floats]:
    """Return keys (K, KEY_WIDTH), the first key of each particle (P + 1,), energies, and STATISTICS.

    births, deaths: (P,) s. positions: (P, 3) m. velocities: (P, 3) m/s. energies: (F, 3), the number of particles at
    each frame, their kinetic and their potential energy in J/kg. bad_step is num_steps if none is.
    """
    keys = np.empty((4096, KEY_WIDTH))
    count = np.zeros(1, np.int64)
    offsets = np.zeros(len(births) + 1, np.int64)
    frames = (grid.num_steps + grid.substeps - 1) // grid.substeps + 1
    energies = np.zeros((frames, 3))
    statistics = np.zeros(8)
    statistics[3] = grid.num_steps
    for p in range(len(births)):
        if deaths[p] > 0.0:
            x, v = (
                (positions[p, 0], positions[p, 1], positions[p, 2]),
                (velocities[p, 0], velocities[p, 1], velocities[p, 2]),
            )
            keys = _run_particle(keys, count, births[p], deaths[p], x, v, field, solids, grid, energies, statistics)
        offsets[p + 1] = count[0]
    return keys[: count[0]], offsets, energies, statistics


@inline
def _run_particle(
    keys: Floats, count: Ints, birth: float, death: float, x: Vector, v: Vector,
    field: ForceField, solids: Solids, grid: Grid, energies: Floats, statistics: Floats,
) -> Floats:  # fmt: skip
    """Simulate one particle from birth to death; return the keys, with space for more if they ran out.

    Inlined, as a function of its own would take a second more to compile.
    """
    h = grid.step
    n = max(int(np.floor(birth / h)), grid.first)
    n += 1 if (n + 1) * h <= birth else 0
    n -= 1 if n * h > birth and n > grid.first else 0
    resting, face, ignored = -1, ORIGIN, containing(solids, n - grid.first, birth / h - n, x)
    is_asleep, has_begun = False, birth >= 0.0
    statistics[7] += 1.0 if ignored else 0.0
    keys = grow(keys, count)
    if has_begun:
        write_key(keys, count, birth, x, v, v)
    first_energy = 0.5 * dot(v, v) + potential(field, birth, x)
    while n < grid.num_steps:
        keys = grow(keys, count)
        if n >= statistics[3]:
            return keys
        start, end = max(birth, n * h), grid.duration if n == grid.num_steps - 1 else (n + 1) * h
        stop = min(end, death)
        if n == 0 and not has_begun:
            write_key(keys, count, 0.0, x, v, v)
            first_energy = 0.5 * dot(v, v) + potential(field, 0.0, x)
        if n == 0 and birth <= 0.0:
            add_energy(energies, 0, field, 0.0, x, v)
        if resting < 0 and start == n * h:
            last = min(grid.num_steps - 1, int(np.ceil(death / h)) - 1, int(statistics[3]))
            if grid.has_frames or n < 0:  # stop for a key
                last = min(last, (n // grid.substeps + 1) * grid.substeps if n >= 0 else 0)
            begun, (n, x, v) = n, _fly(solids.shapes, solids.poses, field, grid, n, last, x, v, energies, statistics)
            if n > begun:
                ignored = 0
                if grid.has_frames and n > 0 and n % grid.substeps == 0:
                    write_key(keys, count, n * h, x, v, v)
                if n == last:
                    continue
                start, end = n * h, grid.duration if n == grid.num_steps - 1 else (n + 1) * h
                stop = min(end, death)
        if resting >= 0 and grid.can_rest and length(v) == 0.0 and start == n * h and is_flat(solids, resting):
            last = min(grid.num_steps - 1, int(np.ceil(death / h)) - 1) if n >= 0 else 0
            begun, n = n, rest(field, grid, face, n, last, x, energies)
            if n > begun:
                if n > 0:
                    write_key(keys, count, n * h, x, v, v)
                continue
        if not is_asleep:
            before = count[0]
            x, v, resting, face, ignored, is_asleep = _advance(
                State(x, v, resting, face, ignored, False), keys, count, n, start, stop - start,
                field, solids, grid, statistics,
            )  # fmt: skip
            _note_penetration(solids, n - grid.first, stop / h - n, x, ignored, statistics)
            if ignored:  # until it has left
                ignored &= containing(solids, n - grid.first, stop / h - n, x)
            if n < 0:
                count[0] = before
        speed = length(v)
        if not (speed < MAX_SPEED_M_S and np.isfinite(x[0] + x[1] + x[2])):
            statistics[3], statistics[4] = n, speed
            return keys
        statistics[1] = max(statistics[1], speed)
        if death <= end:
            break
        n += 1
        if n > 0 and (n % grid.substeps == 0 or n == grid.num_steps):
            frame = (n + grid.substeps - 1) // grid.substeps
            add_energy(energies, frame, field, end, x, v)
            statistics[6] += 0.5 * dot(v, v) * h * grid.substeps
            has_key = grid.has_frames or (resting >= 0 and not is_flat(solids, resting))
            if n < grid.num_steps and has_key and not is_asleep:
                write_key(keys, count, end, x, v, v)
    finish = min(death, grid.duration)
    write_key(keys, count, finish, x, v, v)
    statistics[5] += 0.5 * dot(v, v) + potential(field, finish, x) - first_energy
    return keys


@callee
def _advance(
    state: State, keys: Floats, count: Ints, n: int, t: float, h: float,
    field: ForceField, solids: Solids, grid: Grid, statistics: Floats,
) -> State:  # fmt: skip
    """The state h s later; impacts, stops and departures are logged."""
    x, v, resting, face, ignored = state.x, state.v, state.resting, state.face, state.ignored
    i = n - grid.first
    for _ in range(MAX_IMPACTS_PER_STEP):
        span, asleep, stops = h, False, False
        if resting < 0:
            x1, v1, _ = integrate(field, grid.method, t, x, v, h, air_velocity(field, t, x))
        elif not is_flat(solids, resting):
            on_surface, x1, v1 = slide_surface(resting, i, t / grid.step - n, t, h, x, v, field, solids, grid)
            if not on_surface:
                write_key(keys, count, t, x, v, v)
                resting = -1
                continue
        else:
            a = acceleration(field, t, x, v, air_velocity(field, t, x))
            if dot(a, face) > 0.0:
                resting = -1
                continue
            span, x1, v1, stops, asleep = slide_face(a, face, h, x, v, grid.friction)
        f0 = t / grid.step - n
        f1 = f0 + span / grid.step
        hit, u = _first_impact(solids, resting, ignored, i, f0, f1, grid.step, span, x, v, x1, v1)
        if hit < 0:
            if resting >= 0 and is_flat(solids, resting):
                if stops:
                    write_key(keys, count, t + span, x1, v1, v1)
                if not is_on_face(solids, resting, x1, face):
                    write_key(keys, count, t + span, x1, v1, v1)
                    resting, asleep = -1, False
                elif stops and not asleep:  # slides back
                    x, v, t, h = x1, v1, t + span, h - span
                    continue
            return State(x1, v1, resting, face, ignored, asleep and grid.can_sleep)
        statistics[0] += 1.0 if t >= 0.0 else 0.0
        f = f0 + u * (f1 - f0)
        before = hermite_velocity(u, span, x, v, x1, v1) if span > 0.0 else v
        x = hermite(u, span, x, v, x1, v1)
        face = normal(solids, hit, i, f, x)
        x = add(x, max(-distance(solids, hit, i, f, x), 0.0), face)
        t += u * span
        a = acceleration(field, t, x, before, air_velocity(field, t, x))
        moving = surface_velocity(solids, hit, i, f, grid.step, x)
        v, stays = respond(before, moving, face, a, grid)
        resting = hit if stays else -1
        write_key(keys, count, t, x, before, v)
        h -= u * span
        if h <= 0.0:
            return State(x, v, resting, face, ignored, False)
    return State(x, ORIGIN, resting, face, ignored, False)  # wedged between obstacles


@callee
def _first_impact(
    solids: Solids, resting: int, ignored: int, i: int, f0: float, f1: float, step: float, h: float,
    x0: Vector, v0: Vector, x1: Vector, v1: Vector,
) -> tuple[int, float]:  # fmt: skip
    """The first obstacle that a flight meets, or −1, and the fraction of the flight."""
    hit, first = -1, np.inf
    for k in range(len(solids.shapes)):
        if k != resting and not (ignored >> k) & 1:
            u = impact_fraction(solids, k, i, f0, f1, step, h, x0, v0, x1, v1)
            if u < first:
                hit, first = k, u
    return hit, first


@callee
def _fly(
    shapes: Floats, poses: Floats, field: ForceField, grid: Grid, n: int, last: int, x: Vector, v: Vector,
    energies: Floats, statistics: Floats,
) -> tuple[int, Vector, Vector]:  # fmt: skip
    """Whole steps from n on until `last`, or until an obstacle is near; most steps of most particles.

    It calls nothing with arrays, which costs more than the step itself.
    """
    h, method, substeps, first = grid.step, grid.method, grid.substeps, grid.first
    num_shapes, end = len(shapes), len(poses) - 1
    uniform, fastest, kinetic = field.uniform, statistics[1], 0.0
    air = uniform.wind if field.is_uniform else air_velocity(field, n * h, x)
    while n < last:
        if field.is_uniform:
            x1, v1, after = integrate_uniform(uniform, method, n * h, x, v, h, air)
        else:
            x1, v1, after = integrate(field, method, n * h, x, v, h, air)
        speed = max(length(v), length(v1))
        if not (speed < MAX_SPEED_M_S and np.isfinite(x1[0] + x1[1] + x1[2])):
            break
        is_near = False
        for k in range(num_shapes):
            if shapes[k, 0] == FLOOR and shapes[k, MOVING] == 0.0:
                is_near |= x1[1] < poses[0, k, 1] or x[1] < poses[0, k, 1]
            else:
                i, j = min(n - first, end), min(n + 1 - first, end)
                c = (poses[i, k, 0], poses[i, k, 1], poses[i, k, 2])
                moved = length((poses[j, k, 0] - c[0], poses[j, k, 1] - c[1], poses[j, k, 2] - c[2]))
                way = 1.5 * max(h * speed, length(add(x1, -1.0, x))) + moved + shapes[k, BALL] + TOUCH_M
                is_near |= length(add(x, -1.0, c)) < way
        if is_near:
            break
        x, v, air, n = x1, v1, after, n + 1
        fastest = max(fastest, speed)
        if n > 0 and n % substeps == 0:
            frame = n // substeps
            energies[frame, 0] += 1.0
            energies[frame, 1] += 0.5 * dot(v, v)
            energies[frame, 2] += potential(field, n * h, x)
            kinetic += 0.5 * dot(v, v)
    statistics[1] = fastest
    statistics[6] += kinetic * h * substeps
    return n, x, v


@callee
def _note_penetration(solids: Solids, i: int, f: float, x: Vector, ignored: int, statistics: Floats) -> None:
    for k in range(len(solids.shapes)):
        if not (ignored >> k) & 1:
            statistics[2] = max(statistics[2], -distance(solids, k, i, f, x))

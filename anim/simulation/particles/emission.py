"""Births of particles: when, where, and how fast they leave a node or the surface of a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import RangeError, UnsupportedError
from anim.model import Clip, Scene
from anim.simulation.limits import MAX_LENGTH_M, MAX_SPEED_M_S, check_range
from anim.simulation.particles.emitter_motion import sample_nodes, sample_surfaces, unit_vectors

MAX_PARTICLES = 1_000_000
MAX_INHERITED = 1e3
MAX_COUNT = 1e15  # of a rate or burst, far beyond the limit of particles
MIN_LIFETIME_S, MAX_LIFETIME_S = 1e-3, 1e9


@dataclass(frozen=True, slots=True)
class Emitter:
    """Source of particles on nodes.

    nodes: indices. rate: particles per second and node. burst: per node, at the start. surface: emit from the skinned
    mesh of each node, along its normals, instead of from the node's origin. direction: (3,) in the node's space.
    speed: m/s. spread: rad, half the angle of the cone. lifetime: s. speed_variation, lifetime_variation: fractions,
    uniform. inherit: fraction of the emitter's own velocity. start, end: s of the emission; None for the whole run.
    Raises RangeError.
    """

    nodes: tuple[int, ...]
    rate: float = 50.0
    burst: int = 0
    surface: bool = False
    direction: tuple[float, float, float] = (0.0, 1.0, 0.0)
    speed: float = 2.0
    spread: float = 0.35
    lifetime: float = 1.5
    speed_variation: float = 0.25
    lifetime_variation: float = 0.25
    inherit: float = 1.0
    start: float | None = None
    end: float | None = None

    def __post_init__(self) -> None:
        check_range("rate", self.rate, 0.0, MAX_COUNT, "per second")
        check_range("burst", self.burst, 0, MAX_COUNT)
        check_range("speed", self.speed, 0.0, MAX_SPEED_M_S, "m/s")
        check_range("spread", self.spread, 0.0, np.pi, "rad")
        check_range("inherit", self.inherit, -MAX_INHERITED, MAX_INHERITED)
        check_range("lifetime", self.lifetime, MIN_LIFETIME_S, MAX_LIFETIME_S, "s")
        for name in ("speed_variation", "lifetime_variation"):
            check_range(name, getattr(self, name), 0.0, 1.0)
        if not 1 / MAX_LENGTH_M <= math.hypot(*self.direction) <= MAX_LENGTH_M:
            raise RangeError(f"`direction` is {self.direction} (expected a vector that isn't 0)")


@dataclass(frozen=True, slots=True, eq=False)
class Births:
    """P particles, ordered by birth. times, deaths: (P,) s; positions (P, 3) m; velocities (P, 3) m/s."""

    times: Floats
    deaths: Floats
    positions: Floats
    velocities: Floats

    def __len__(self) -> int:
        return len(self.times)

    def at(self, rows: Ints) -> Births:
        """Return some of the particles."""
        return Births(self.times[rows], self.deaths[rows], self.positions[rows], self.velocities[rows])


@dataclass(frozen=True, slots=True, eq=False)
class BirthPlan:
    """Births of E emitters with n particles each, before their places are known.

    times: (n,) s, the same for all. lifetimes: (E, n) s. speeds: (E, n) m/s. cones: (E, n, 3), unit vectors around +Z.
    surface: (E, 3, n), uniform numbers that choose points of a surface; (E, 0, n) where particles leave nodes.
    """

    times: Floats
    lifetimes: Floats
    speeds: Floats
    cones: Floats
    surface: Floats

    def count_simultaneous(self, duration: float, *, is_loop: bool = False) -> int:
        """Return the number of particles that are alive at once within 0 … `duration` s; the briefest don't count.

        is_loop: all of them repeat with that period, as by `repeat_births`.
        """
        births = np.tile(self.times, len(self.lifetimes)) + MIN_LIFETIME_S / 2
        lives = self.lifetimes.ravel() - MIN_LIFETIME_S
        always = 0
        if is_loop:
            periods = np.floor(lives / duration)
            always = int(periods.sum())
            lives = np.tile(lives - periods * duration, 2)
            births = np.concatenate([births % duration, births % duration - duration])
        starts, ends = np.clip(births, 0.0, duration), np.clip(births + lives, 0.0, duration)
        lasts = ends > starts
        starts, ends = np.sort(starts[lasts]), np.sort(ends[lasts])
        alive = np.arange(1, len(starts) + 1) - np.searchsorted(ends, starts, side="right")
        return always + int(alive.max(initial=0))


def emit(
    scene: Scene, clip: Clip, emitter: Emitter, start: float, end: float, seed: int, clip_start: float = 0.0
) -> Births:
    """Return the particles born from `start` until before `end` s, as `plan_births` and `place_births` do."""
    return place_births(scene, clip, emitter, plan_births(emitter, start, end, seed), clip_start)


def plan_births(emitter: Emitter, start: float, end: float, seed: int) -> BirthPlan:
    """Return the births from `start` until before `end` s. Raises UnsupportedError for over a million."""
    first = start if emitter.start is None else max(start, emitter.start)
    last = end if emitter.end is None else min(end, emitter.end)
    count = emitter.burst + math.ceil(min(max(last - first, 0) * emitter.rate, MAX_COUNT) - 1e-9)
    _check_count(count * len(emitter.nodes))
    times = np.concatenate(
        [np.full(emitter.burst, first), first + np.arange(count - emitter.burst) / (emitter.rate or 1)]
    )
    num_emitters = len(emitter.nodes)
    drawn = np.empty((7 if emitter.surface else 4, num_emitters, count))
    for e, node in enumerate(emitter.nodes):
        random = np.random.default_rng([seed, node])
        for row, (low, high) in enumerate(
            ((-1, 1), (-1, 1), (0, 1), (0, 2 * np.pi), (0, 1), (0, 1), (0, 1))[: len(drawn)]
        ):
            drawn[row, e] = random.uniform(low, high, count)
    lives = emitter.lifetime * (1 + emitter.lifetime_variation * drawn[1])
    return BirthPlan(
        times,
        np.maximum(lives, MIN_LIFETIME_S),
        emitter.speed * (1 + emitter.speed_variation * drawn[0]),
        _cone(emitter.spread, drawn[2], drawn[3]),
        np.swapaxes(drawn[4:], 0, 1),
    )


def place_births(scene: Scene, clip: Clip, emitter: Emitter, plan: BirthPlan, clip_start: float = 0.0) -> Births:
    """Return the particles of a plan, ordered by birth.

    The clip is evaluated at each birth; clip_start: its time at 0 s, before which it has the pose of 0 s.
    Raises NotFoundError for a node without a mesh where particles leave a surface.
    """
    at = clip_start + np.maximum(plan.times, 0.0)
    if emitter.surface:
        positions, axes, own = sample_surfaces(scene, clip, emitter.nodes, at, plan.surface)
    else:
        positions, axes, own = sample_nodes(scene, clip, emitter.nodes, at, emitter.direction)
    velocities = plan.speeds.reshape(-1, 1) * _rotate_z_to(axes, plan.cones.reshape(-1, 3)) + emitter.inherit * own
    times = np.tile(plan.times, len(emitter.nodes))
    order = np.argsort(times, kind="stable")
    deaths = (plan.times + plan.lifetimes).ravel()
    return Births(*(each[order] for each in (times, deaths, positions, velocities)))


def repeat_births(births: Births, period: float) -> Births:
    """Return the particles with those of as many earlier periods as live into this one: a loop without a seam.

    Raises UnsupportedError for over a million.
    """
    rounds = int(np.ceil(((births.deaths - births.times).max() if len(births) else 0) / period))
    _check_count((rounds + 1) * len(births))
    shifts = np.repeat(np.arange(-rounds, 1) * period, len(births))
    times = np.tile(births.times, rounds + 1) + shifts
    deaths = np.tile(births.deaths, rounds + 1) + shifts
    return Births(
        times, deaths, np.tile(births.positions, (rounds + 1, 1)), np.tile(births.velocities, (rounds + 1, 1))
    )


def _check_count(count: int) -> None:
    if count > MAX_PARTICLES:
        problem = f"{count:.6g} particles (limit {MAX_PARTICLES})"
        raise UnsupportedError(problem, help="choose a lower `rate`, or a shorter `duration` or `lifetime`")


def _cone(spread: float, height: Floats, angle: Floats) -> Floats:
    """Unit vectors (..., 3) on the cap of half angle `spread` around +Z.

    They are uniform on it for uniform heights 0 … 1 and angles 0 … 2π.
    """
    z = 1 - height * (1 - np.cos(spread))
    across = np.sqrt(np.maximum(1 - z * z, 0))
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=-1)


def _rotate_z_to(axes: Floats, vectors: Floats) -> Floats:
    """Vectors (n, 3) rotated as +Z is to the unit axes (n, 3)."""
    helper = np.where(np.abs(axes[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    x = unit_vectors(np.cross(helper, axes))
    return vectors[:, :1] * x + vectors[:, 1:2] * np.cross(axes, x) + vectors[:, 2:] * axes

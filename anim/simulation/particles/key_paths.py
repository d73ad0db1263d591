"""Positions of particles between their keys: at any times, and at frames."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hermite
from anim.model.point_cache import PointCache
from anim.simulation.particles.solver import ParticleKeys


def evaluate_keys(keys: ParticleKeys, particles: Ints, times: Floats) -> tuple[Floats, Floats, Bools]:
    """Return positions and velocities (n, 3) of particles (n,) at times (n,), and which are alive (n,)."""
    span = 2.0 * (float(np.abs(keys.times).max(initial=0.0)) + 1.0)
    # Particles and times in one ascending number. It rounds times to some 1e-11 s, which a segment's end allows for.
    order = keys.particles * span + keys.times
    right = np.searchsorted(order, particles * span + times, side="right").astype(np.int64)
    left = np.clip(right - 1, 0, max(len(order) - 2, 0))
    ends = np.minimum(left + 1, len(order) - 1)
    same = keys.particles[ends] == particles
    left = np.where(~same & (keys.particles[left] == particles), left - 1, left)  # at the last key
    ends = np.minimum(left + 1, len(order) - 1)
    alive = (keys.particles[left] == particles) & (keys.particles[ends] == particles)
    h = np.maximum(keys.times[ends] - keys.times[left], 1e-300)[:, None]
    u = np.clip((times - keys.times[left])[:, None] / h, 0.0, 1.0)
    alive &= (times >= keys.times[left] - 1e-9) & (times <= keys.times[ends] + 1e-9)
    ends_of = (keys.positions[left], h * keys.out_velocities[left], keys.positions[ends], h * keys.in_velocities[ends])
    return hermite.evaluate(u, *ends_of), hermite.first_derivative(u, *ends_of) / h, alive


def sample_points(
    keys: ParticleKeys, births: Floats, deaths: Floats, frames: Floats, *, size: float, start: float = 0.0
) -> PointCache:
    """Return the particles alive at the frames (F,) s of the simulation.

    births, deaths: (P,) s, of the particles; each is there from its birth until before its death. start: s, of the
    driving clip, added to the times.
    """
    first = np.searchsorted(frames, births, side="left")
    count = np.maximum(np.searchsorted(frames, deaths, side="left") - first, 0)
    particles = np.repeat(np.arange(len(births)), count)
    frame = np.arange(len(particles)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(first, count)
    order = np.lexsort((particles, frame))
    particles, frame = particles[order], frame[order]
    positions, velocities, alive = evaluate_keys(keys, particles, frames[frame])
    particles, frame = particles[alive], frame[alive]
    return PointCache(
        frames + start,
        np.searchsorted(frame, np.arange(len(frames) + 1)),
        particles,
        positions[alive],
        velocities[alive],
        frames[frame] - births[particles],
        (deaths - births)[particles],
        size,
    )


def largest_distance(keys: ParticleKeys, other: ParticleKeys) -> float:
    """Return the largest distance in m of two runs of the same particles, at the keys of both and between them."""
    if not len(keys.times) or not len(other.times):
        return 0.0
    largest = 0.0
    for each in (keys, other):
        between = np.diff(each.particles) == 0
        middles = (0.5 * (each.times[1:] + each.times[:-1]))[between]
        particles = np.concatenate([each.particles, each.particles[1:][between]])
        times = np.concatenate([each.times, middles])
        a, _, alive = evaluate_keys(keys, particles, times)
        b, _, both = evaluate_keys(other, particles, times)
        found = np.linalg.norm(a - b, axis=1)[alive & both]
        largest = max(largest, float(found.max(initial=0.0)))
    return largest

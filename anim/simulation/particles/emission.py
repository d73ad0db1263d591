"""Births of particles: when, where, and how fast they leave a node or the surface of a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import NotFoundError, RangeError, UnsupportedError
from anim.model import Clip, Interpolation, Scene
from anim.model.skeleton import ancestors
from anim.simulation.particles.node_motion import NodeMotion
from anim.skinning.bake import bake

VELOCITY_STEP_S = 1e-3  # half the interval of the difference quotient of an emitter's motion
MAX_PARTICLES = 1_000_000
MAX_SPEED_M_S, MAX_INHERITED = 1e4, 1e3


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
        for name, most in (("rate", np.inf), ("burst", np.inf), ("speed", MAX_SPEED_M_S), ("spread", np.pi)):
            _check(name, getattr(self, name), 0.0, most)
        _check("inherit", self.inherit, -MAX_INHERITED, MAX_INHERITED)
        _check("lifetime", self.lifetime, 1e-3, np.inf)
        for name in ("speed_variation", "lifetime_variation"):
            _check(name, getattr(self, name), 0.0, 1.0)
        if not np.isfinite(self.direction).all() or not np.any(self.direction):
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


def emit(
    scene: Scene, clip: Clip, emitter: Emitter, start: float, end: float, seed: int, clip_start: float = 0.0
) -> Births:
    """Return the particles born from `start` until before `end` s.

    The clip is evaluated at each birth; clip_start: its time at 0 s, before which it has the pose of 0 s.
    Raises NotFoundError for a node without a mesh where particles leave a surface, UnsupportedError for over a million.
    """
    first = start if emitter.start is None else max(start, emitter.start)
    last = end if emitter.end is None else min(end, emitter.end)
    count = emitter.burst + int(np.ceil(max(last - first, 0) * emitter.rate - 1e-9))
    if count * len(emitter.nodes) > MAX_PARTICLES:
        problem = f"{count * len(emitter.nodes):.6g} particles (limit {MAX_PARTICLES})"
        raise UnsupportedError(problem, help="choose a lower `rate`, or a shorter `duration`")
    times = np.concatenate(
        [np.full(emitter.burst, first), first + np.arange(count - emitter.burst) / (emitter.rate or 1)]
    )
    parts = [
        _emit_node(scene, clip, emitter, node, times, np.random.default_rng([seed, node]), clip_start)
        for node in emitter.nodes
    ]
    together = [np.concatenate(each) for each in zip(*parts, strict=True)]
    order = np.argsort(together[0], kind="stable")
    return Births(*(each[order] for each in together))


def repeat_births(births: Births, period: float) -> Births:
    """Return the particles with those of as many earlier periods as live into this one: a loop without a seam."""
    rounds = int(np.ceil(((births.deaths - births.times).max() if len(births) else 0) / period))
    shifts = np.repeat(np.arange(-rounds, 1) * period, len(births))
    times = np.tile(births.times, rounds + 1) + shifts
    deaths = np.tile(births.deaths, rounds + 1) + shifts
    return Births(
        times, deaths, np.tile(births.positions, (rounds + 1, 1)), np.tile(births.velocities, (rounds + 1, 1))
    )


def _emit_node(
    scene: Scene,
    clip: Clip,
    emitter: Emitter,
    node: int,
    times: Floats,
    random: np.random.Generator,
    clip_start: float,
) -> tuple[Floats, Floats, Floats, Floats]:
    count = len(times)
    speed = emitter.speed * (1 + emitter.speed_variation * random.uniform(-1, 1, count))
    life = emitter.lifetime * (1 + emitter.lifetime_variation * random.uniform(-1, 1, count))
    cone = _cone(emitter.spread, random, count)
    at = clip_start + np.maximum(times, 0.0)
    if emitter.surface:
        positions, axes, own = _on_surface(scene, clip, node, at, random)
    else:
        positions, axes, own = _at_node(scene, clip, node, at, emitter.direction)
    velocities = speed[:, None] * _rotate_z_to(axes, cone) + emitter.inherit * own
    return times, times + np.maximum(life, 1e-3), positions, velocities


def _at_node(
    scene: Scene, clip: Clip, node: int, times: Floats, direction: Sequence[float]
) -> tuple[Floats, Floats, Floats]:
    """World positions, unit directions and velocities (n, 3) of a node at times (n,)."""
    at = np.maximum(times[:, None] + np.array([-VELOCITY_STEP_S, 0.0, VELOCITY_STEP_S]), clip.start)
    unique, inverse = np.unique(at, return_inverse=True)
    matrices = NodeMotion(scene.skeleton, clip).at(unique, [node])[:, 0][inverse.reshape(at.shape)]
    axes = matrices[:, 1, :, :3] @ (np.asarray(direction) / np.linalg.norm(direction))
    positions = matrices[:, :, :, 3]
    moving = frozenset(ancestors(scene.skeleton.parents, node)) | {node}
    return positions[:, 1], _unit(axes), _velocity(at, positions, _step_times(clip, moving))


def _on_surface(
    scene: Scene, clip: Clip, node: int, times: Floats, random: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    """Uniform random points of a node's skinned mesh at times (n,), their normals, and their velocities."""
    found = [each for each in scene.instances if each.node == node]
    if not found or not len(found[0].mesh.faces):
        raise NotFoundError(f"node '{scene.skeleton.names[node]}' has no surface to emit from")
    faces = found[0].mesh.faces
    corners = found[0].mesh.positions[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = faces[np.searchsorted(np.cumsum(areas) / areas.sum(), random.uniform(0, 1, len(times)))]
    u, v = np.sqrt(random.uniform(0, 1, len(times))), random.uniform(0, 1, len(times))
    barycentric = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    at = np.maximum(times[:, None] + np.array([-VELOCITY_STEP_S, 0.0, VELOCITY_STEP_S]), clip.start)
    points = [_vertices(scene, clip, node, column, chosen) for column in at.T]
    positions = np.stack([(barycentric[:, :, None] * each).sum(axis=1) for each in points], axis=1)
    normals = np.cross(points[1][:, 1] - points[1][:, 0], points[1][:, 2] - points[1][:, 0])
    return positions[:, 1], _unit(normals), _velocity(at, positions, _step_times(clip, None))


def _step_times(clip: Clip, nodes: frozenset[int] | None) -> Floats:
    """Sorted key times of the STEP tracks of these nodes, None for all: there a position can jump."""
    steps = [
        track.times
        for track in clip.tracks
        if track.interpolation is Interpolation.STEP and (nodes is None or track.node in nodes)
    ]
    return np.unique(np.concatenate(steps)) if steps else np.empty(0)


def _velocity(at: Floats, positions: Floats, jumps: Floats) -> Floats:
    """Velocities (n, 3) at the second of three times (n, 3), from positions (n, 3, 3); a jump is no velocity.

    With a jump before or after, the difference is one of the other half; with jumps in both it is 0.
    """
    counts = np.searchsorted(jumps, at, side="right")
    is_smooth = counts[:, 1:] == counts[:, :-1]  # (n, 2)
    steps = np.where(is_smooth[:, :, None], np.diff(positions, axis=1), 0.0)
    span = np.where(is_smooth, np.diff(at, axis=1), 0.0).sum(axis=1)
    return np.asarray(steps.sum(axis=1) / np.maximum(span, 1e-9)[:, None])


def _vertices(scene: Scene, clip: Clip, node: int, times: Floats, chosen: Ints) -> Floats:
    """Positions (n, 3, 3) of the vertices (n, 3) at times (n,)."""
    unique, inverse = np.unique(times, return_inverse=True)
    result = np.empty((len(times), 3, 3))
    cache = bake(scene, clip, times=unique, rigid=True, nodes=[node])
    for chunk in cache.chunks():
        here = np.flatnonzero((inverse >= chunk.first) & (inverse < chunk.first + len(chunk.positions)))
        result[here] = chunk.positions[inverse[here] - chunk.first][np.arange(len(here))[:, None], chosen[here]]
    return result


def _cone(spread: float, random: np.random.Generator, count: int) -> Floats:
    """Unit vectors (n, 3) uniform on the cap of half angle `spread` around +Z."""
    z = 1 - random.uniform(0, 1, count) * (1 - np.cos(spread))
    angle = random.uniform(0, 2 * np.pi, count)
    across = np.sqrt(np.maximum(1 - z * z, 0))
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


def _rotate_z_to(axes: Floats, vectors: Floats) -> Floats:
    """Vectors (n, 3) rotated as +Z is to the unit axes (n, 3)."""
    helper = np.where(np.abs(axes[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    x = _unit(np.cross(helper, axes))
    return vectors[:, :1] * x + vectors[:, 1:2] * np.cross(axes, x) + vectors[:, 2:] * axes


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))


def _check(name: str, value: float, least: float, most: float) -> None:
    if not (np.isfinite(value) and least <= value <= most):
        limit = f"{least:g} to {most:g}" if np.isfinite(most) else f"at least {least:g}"
        raise RangeError(f"`{name}` is {value:g} (expected {limit})")

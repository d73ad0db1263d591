"""Obstacles that particles bounce off: signed distances and normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import RangeError

QUARTERS = (0.25, 0.5, 0.75, 1.0)  # a particle may pass through a small one within a step


class Obstacle(Protocol):
    """Solid with a signed distance (m, below 0 inside) and an outward normal at points (P, 3).

    is_flat: whether a particle can rest on it; contains_face: whether points on its surface are still on the face with
    this normal (3,). checked_fractions: of a step, where to look for a particle inside.
    """

    @property
    def is_flat(self) -> bool: ...
    @property
    def checked_fractions(self) -> tuple[float, ...]: ...
    def distance(self, x: Floats) -> Floats: ...
    def normal(self, x: Floats) -> Floats: ...
    def contains_face(self, x: Floats, normal: Floats) -> Bools: ...


@dataclass(frozen=True, slots=True)
class Floor:
    """Half-space below y = height m."""

    height: float = 0.0
    is_flat = True
    checked_fractions = (1.0,)  # gravity points down: who ends above was above

    def distance(self, x: Floats) -> Floats:
        """Return the signed distance (P,)."""
        return x[:, 1] - self.height

    def normal(self, x: Floats) -> Floats:
        """Return the normals (P, 3)."""
        return np.broadcast_to(np.array([0.0, 1.0, 0.0]), x.shape)

    def contains_face(self, x: Floats, normal: Floats) -> Bools:
        """Return True: the floor has no edge."""
        return np.ones(len(x), bool)


@dataclass(frozen=True, slots=True)
class Sphere:
    """Ball around `center` (3,) m. Raises RangeError for a radius that isn't above 0."""

    center: tuple[float, float, float]
    radius: float
    is_flat = False
    checked_fractions = QUARTERS

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0):
            raise RangeError(f"the radius of a sphere is {self.radius:g} m (expected above 0)")

    def distance(self, x: Floats) -> Floats:
        """Return the signed distance (P,)."""
        return np.asarray(np.linalg.norm(x - np.asarray(self.center), axis=1) - self.radius)

    def normal(self, x: Floats) -> Floats:
        """Return the normals (P, 3); up at the center."""
        away = x - np.asarray(self.center)
        length = np.linalg.norm(away, axis=1, keepdims=True)
        return np.where(length > 0, away / np.maximum(length, 1e-300), (0.0, 1.0, 0.0))

    def contains_face(self, x: Floats, normal: Floats) -> Bools:
        """Return False: nothing rests on a ball."""
        return np.zeros(len(x), bool)


@dataclass(frozen=True, slots=True)
class Box:
    """Box along the axes around `center` (3,) m, of `size` (3,) m. Raises RangeError for sizes not above 0."""

    center: tuple[float, float, float]
    size: tuple[float, float, float]
    is_flat = True
    checked_fractions = QUARTERS

    def __post_init__(self) -> None:
        if not (np.isfinite(self.size).all() and min(self.size) > 0):
            raise RangeError(f"the size of a box is {self.size} m (expected three numbers above 0)")

    def distance(self, x: Floats) -> Floats:
        """Return the signed distance (P,)."""
        q = np.abs(x - np.asarray(self.center)) - 0.5 * np.asarray(self.size)
        outside = np.linalg.norm(np.maximum(q, 0), axis=1)
        return np.asarray(outside + np.minimum(q.max(axis=1), 0))

    def normal(self, x: Floats) -> Floats:
        """Return the normals (P, 3) of the nearest faces; towards the point from an edge or a corner outside."""
        away = x - np.asarray(self.center)
        q = np.abs(away) - 0.5 * np.asarray(self.size)
        outward = np.where(away < 0, -1.0, 1.0) * np.maximum(q, 0)
        length = np.linalg.norm(outward, axis=1, keepdims=True)
        face = np.zeros_like(x)
        nearest = q.argmax(axis=1)
        rows = np.arange(len(x))
        face[rows, nearest] = np.where(away[rows, nearest] < 0, -1.0, 1.0)
        return np.where(length > 1e-9, outward / np.maximum(length, 1e-300), face)

    def contains_face(self, x: Floats, normal: Floats) -> Bools:
        """Return whether points (P, 3) are within the face with these normals (P, 3)."""
        q = np.abs(x - np.asarray(self.center)) - 0.5 * np.asarray(self.size)
        inside: Bools = ((q <= 0) | (np.abs(normal) > 0.5)).all(axis=1)
        return inside

"""Point masses on damped springs, for cloth and hair by any integrator."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import RangeError, ShapeError
from anim.simulation.integrators import Scalar

MIN_LENGTH_M = 1e-12  # of a spring, below which its direction is undefined
SOLVER_TOLERANCE = 1e-10  # relative, of conjugate gradients


@dataclass(frozen=True, slots=True, eq=False)
class MassSpring:
    """P masses and S springs.

    masses: (P,) kg; infinite for pinned points. springs: (S, 2) indices of points. rest_lengths: (S,) m.
    stiffness: (S,) N/m. damping: (S,) N·s/m, along the springs. gravity: (3,) m/s². drag: 1/s, of all points.
    Raises ShapeError, or RangeError for masses that aren't above 0 or negative coefficients.
    """

    masses: Floats
    springs: Ints
    rest_lengths: Floats
    stiffness: Floats
    damping: Floats
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    drag: float = 0.0
    _inverse_masses: Floats = field(init=False)

    def __post_init__(self) -> None:
        if self.springs.shape != (len(self.rest_lengths), 2):
            raise ShapeError(f"springs have shape {self.springs.shape} (expected ({len(self.rest_lengths)}, 2))")
        if not (self.masses > 0).all():
            raise RangeError(f"a mass is {self.masses.min():g} kg (expected above 0)")
        for name in ("rest_lengths", "stiffness", "damping"):
            values = getattr(self, name)
            if len(values) and not (np.isfinite(values).all() and values.min() >= 0):
                raise RangeError(f"{name} has {values.min():g} (expected numbers of at least 0)")
        object.__setattr__(self, "_inverse_masses", 1.0 / self.masses)

    @property
    def is_free(self) -> Bools:
        """True for points that aren't pinned: (P,)."""
        free: Bools = np.isfinite(self.masses)
        return free

    def acceleration(self, time: Scalar, x: Floats, v: Floats) -> Floats:
        """Return the accelerations (P, 3) m/s²; 0 for pinned points."""
        force = self._spring_forces(x, v)
        free = np.asarray(self.gravity) - self.drag * v
        return np.asarray(force * self._inverse_masses[:, None] + np.where(self.is_free[:, None], free, 0.0))

    def solve_implicit(self, time: Scalar, x: Floats, v: Floats, step: Scalar) -> Floats:
        """Return the velocity change of one Newton step of implicit Euler, by conjugate gradients.

        Compressed springs count without their transversal stiffness, which keeps the matrix positive definite.
        Source: Baraff and Witkin, Large Steps in Cloth Simulation, 1998; Choi and Ko, 2002, for the compressed ones.
        """
        from scipy.sparse import bsr_array
        from scipy.sparse.linalg import cg

        h = float(np.max(step))
        free = np.flatnonzero(self.is_free)
        a, b = self.springs.T
        along, length = self._directions(x)
        outer = along[:, :, None] * along[:, None, :]
        tension = np.maximum(1 - self.rest_lengths / np.maximum(length, MIN_LENGTH_M), 0)
        k = self.stiffness[:, None, None] * (outer + tension[:, None, None] * (np.eye(3) - outer))
        d = self.damping[:, None, None] * outer
        blocks = h * d + h * h * k
        points = len(x)
        mass = np.where(self.is_free, self.masses, 1.0) * (1 + h * self.drag)
        rows = np.concatenate([a, b, a, b, np.arange(points)])
        columns = np.concatenate([a, b, b, a, np.arange(points)])
        values = np.concatenate([blocks, blocks, -blocks, -blocks, mass[:, None, None] * np.eye(3)])
        matrix = _sum_blocks(rows, columns, values, points)
        force = self._spring_forces(x, v) - h * self._stiffness_product(k, v)
        force += np.where(self.is_free, self.masses, 0.0)[:, None] * (np.asarray(self.gravity) - self.drag * v)
        index = (3 * free[:, None] + np.arange(3)).ravel()
        reduced = bsr_array(matrix).tocsr()[index][:, index]
        solution, _ = cg(reduced, h * force.ravel()[index], rtol=SOLVER_TOLERANCE)
        change = np.zeros(3 * points)
        change[index] = solution
        return change.reshape(-1, 3)

    def energy(self, x: Floats, v: Floats) -> float:
        """Return kinetic, elastic and potential energy in J; the potential is 0 where the coordinates are."""
        free = self.is_free
        kinetic = 0.5 * float((self.masses[free, None] * v[free] ** 2).sum())
        _, length = self._directions(x)
        elastic = 0.5 * float((self.stiffness * (length - self.rest_lengths) ** 2).sum())
        return kinetic + elastic - float((self.masses[free] * (x[free] @ np.asarray(self.gravity))).sum())

    def max_frequency(self) -> float:
        """Return an upper bound of the angular frequencies in rad/s, from the stiffness at each point (Gershgorin)."""
        total = np.bincount(self.springs.ravel(), np.repeat(self.stiffness, 2), minlength=len(self.masses))
        return float(np.sqrt((2 * total * self._inverse_masses).max(initial=0.0)))

    def elongation(self, x: Floats) -> Floats:
        """Return the relative elongation (S,) of all springs."""
        return np.asarray(self._directions(x)[1] / np.maximum(self.rest_lengths, MIN_LENGTH_M) - 1)

    def _directions(self, x: Floats) -> tuple[Floats, Floats]:
        """Unit vectors (S, 3) from the first to the second point, and lengths (S,)."""
        span = x[self.springs[:, 1]] - x[self.springs[:, 0]]
        length = np.sqrt(np.einsum("sc,sc->s", span, span))
        return span / np.maximum(length, MIN_LENGTH_M)[:, None], length

    def _spring_forces(self, x: Floats, v: Floats) -> Floats:
        along, length = self._directions(x)
        a, b = self.springs.T
        speed = ((v[b] - v[a]) * along).sum(axis=1)
        pull = (self.stiffness * (length - self.rest_lengths) + self.damping * speed)[:, None] * along
        return self._scatter(pull, len(x))

    def _stiffness_product(self, k: Floats, v: Floats) -> Floats:
        """K v for the blocks k (S, 3, 3), with the sign of a restoring force."""
        a, b = self.springs.T
        return -self._scatter(np.einsum("sij,sj->si", k, v[b] - v[a]), len(v))

    def _scatter(self, pull: Floats, points: int) -> Floats:
        """Forces (P, 3) of pulls (S, 3), which act on the first point, and reversed on the second."""
        a, b = self.springs.T
        columns = [
            np.bincount(a, pull[:, c], minlength=points) - np.bincount(b, pull[:, c], minlength=points)
            for c in range(3)
        ]
        return np.stack(columns, axis=1)


def _sum_blocks(rows: Ints, columns: Ints, values: Floats, points: int) -> object:
    """Sparse matrix of 3 × 3 blocks; blocks of one place are added."""
    from scipy.sparse import coo_array

    i = (3 * rows[:, None, None] + np.arange(3)[:, None] + 0 * np.arange(3)).ravel()
    j = (3 * columns[:, None, None] + 0 * np.arange(3)[:, None] + np.arange(3)).ravel()
    return coo_array((values.ravel(), (i, j)), shape=(3 * points, 3 * points)).tocsr()

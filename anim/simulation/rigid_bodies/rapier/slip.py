"""Speeds of bodies, and of contacts along their surfaces, read from Rapier between two steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from anim.arrays import Bools, Floats, Ints

ColliderPair = tuple[int, int]  # Rapier's indices
Velocity = tuple[float, float, float]  # m/s


class SlipReader:
    """Reader of a world's speeds at its present step."""

    def __init__(self, world: Any, bodies: Sequence[Any], radii: Sequence[float], owners: Mapping[int, int]) -> None:
        """bodies: B of Rapier. radii: of them, m. owners: rows of bodies by Rapier's index of a collider."""
        self._world, self._bodies, self._owners = world, bodies, owners
        self._radii = np.array(radii)
        self._linear = self._angular = self._centers = np.zeros((len(bodies), 3))

    def find_slow(self, speed: float) -> Bools:
        """Return whether no point of a body is faster than `speed` m/s, (B,), in the present step."""
        bodies = self._bodies
        self._linear = np.array([each.linvel.to_tuple() for each in bodies]).reshape(-1, 3)
        self._angular = np.array([each.angvel.to_tuple() for each in bodies]).reshape(-1, 3)
        self._centers = np.array([each.center_of_mass.to_tuple() for each in bodies]).reshape(-1, 3)
        spin = 2 * self._radii * np.linalg.norm(self._angular, axis=1)  # around its center of mass, anywhere inside
        return np.asarray(np.linalg.norm(self._linear, axis=1) + spin < speed)

    def find_slips(self, slow: Bools) -> dict[ColliderPair, Velocity]:
        """Return the pairs of colliders that touch, and the velocity along the surface of their fastest contact.

        slow: (B,), as `find_slow` returned them in this step; contacts of two such bodies are left out.
        """
        sets, skipped = self._world.rigid_bodies, slow.tolist()
        pairs: list[ColliderPair] = []
        points, normals, rows, ends = [], [], [], []
        for pair in [] if slow.all() else self._world.narrow_phase.contact_pairs():
            if not pair.has_any_active_contact:
                continue
            indices = pair.collider1.index, pair.collider2.index
            bodies = self._owners[indices[0]], self._owners[indices[1]]
            if skipped[bodies[0]] and skipped[bodies[1]]:
                continue
            for manifold in pair.manifolds:
                data = manifold.data
                normal = data.normal.to_tuple()
                for contact in data.solver_contacts[:2]:  # no axis of rotation along the normal is at both
                    points.append(data.solver_contact_world_points(contact, sets)[0].to_tuple())
                    normals.append(normal)
                    rows.append(len(pairs))
                    ends.append(bodies)
            pairs += [indices] * (rows[-1:] == [len(pairs)])  # without any that Rapier solves, it doesn't touch
        if not pairs:
            return {}
        slips = self._slips(np.array(points), np.array(normals), np.array(ends))
        order = np.lexsort((np.linalg.norm(slips, axis=1), rows))
        fastest = order[np.searchsorted(np.array(rows)[order], np.arange(len(pairs)), side="right") - 1]
        return dict(zip(pairs, map(tuple, slips[fastest].tolist()), strict=True))

    def _slips(self, points: Floats, normals: Floats, ends: Ints) -> Floats:
        """Velocities (C, 3) of the bodies `ends` (C, 2) along each other at points (C, 3) with normals (C, 3)."""
        first, second = (self._linear[i] + np.cross(self._angular[i], points - self._centers[i]) for i in ends.T)
        relative = first - second
        return np.asarray(relative - np.einsum("cx,cx->c", relative, normals)[:, None] * normals)

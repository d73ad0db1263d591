"""Contacts of Rapier by the rules of glTF: materials of pairs, and filters."""

from __future__ import annotations

from typing import Any

from anim.errors import UnsupportedError
from anim.simulation.rigid_bodies.description import Material, combine
from anim.simulation.rigid_bodies.rigid_scene import BodyCollider, RigidScene

MAX_FILTERS = 32
MAX_STICKING_SPEED_M_S = 0.02  # of contacts, below which static friction counts; those at rest creep less


class MaterialHooks:
    """Friction and restitution of pairs by glTF's rules: its order of combine modes, static and dynamic friction."""

    def __init__(self, colliders: dict[int, tuple[int, BodyCollider]]) -> None:
        self._colliders = colliders
        self._pairs: dict[tuple[Material, Material], tuple[float, float, float]] = {}

    def modify_solver_contacts(self, context: Any) -> None:
        """Set friction and restitution of one pair, before each step."""
        static, dynamic, restitution = self._combined(context.collider1.index, context.collider2.index)
        slides = static == dynamic or _slides(context)
        context.friction = dynamic if slides else static
        context.restitution = restitution

    def _combined(self, first: int, second: int) -> tuple[float, float, float]:
        """Static and dynamic friction, and restitution, of two colliders."""
        pair = (self._colliders[first][1].material, self._colliders[second][1].material)
        if pair not in self._pairs:
            a, b = pair
            modes = (a.friction_combine, b.friction_combine)
            static = combine(modes, a.static_friction, b.static_friction)
            dynamic = combine(modes, a.dynamic_friction, b.dynamic_friction)
            modes = (a.restitution_combine, b.restitution_combine)
            self._pairs[pair] = static, dynamic, combine(modes, a.restitution, b.restitution)
        return self._pairs[pair]


def _slides(context: Any) -> bool:
    """True if a contact point of a pair moves along the surface; plain numbers, for speed."""
    handles = [each for each in (context.rigid_body1, context.rigid_body2) if each is not None]
    bodies = [body for body in (context.bodies[each] for each in handles) if not body.is_fixed]
    nx, ny, nz = context.normal.to_tuple()
    for contact in context.solver_contacts:
        x = y = z = 0.0
        point = contact.point
        for body, sign in zip(bodies, (1.0, -1.0), strict=False):
            vx, vy, vz = body.velocity_at_point(point).to_tuple()
            x, y, z = x + sign * vx, y + sign * vy, z + sign * vz
        along = x * nx + y * ny + z * nz
        if x * x + y * y + z * z - along * along > MAX_STICKING_SPEED_M_S**2:
            return True
    return False


def needs_hooks(scene: RigidScene) -> bool:
    """Return whether colliders have different combine modes, or static friction of their own."""
    materials = [each.material for body in scene.bodies for each in body.colliders]
    mixed = len({(m.friction_combine, m.restitution_combine) for m in materials}) > 1
    return mixed or any(m.static_friction != m.dynamic_friction for m in materials)


def interaction_groups(rapier: Any, scene: RigidScene) -> dict[Any, Any]:
    """Return a bit for each distinct filter, and the bits of those that it collides with."""
    filters = list(dict.fromkeys(each.filter for body in scene.bodies for each in body.colliders))
    if len(filters) > MAX_FILTERS:
        raise UnsupportedError(f"{len(filters)} different collision filters (limit {MAX_FILTERS})")
    groups = {}
    for i, own in enumerate(filters):
        bits = sum(1 << j for j, other in enumerate(filters) if own.accepts(other) and other.accepts(own))
        groups[own] = rapier.InteractionGroups(rapier.Group(1 << i), rapier.Group(bits))
    return groups

"""Contacts of Rapier by the rules of glTF: materials of pairs, and filters."""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.errors import UnsupportedError
from anim.simulation.rigid_bodies.description import combine
from anim.simulation.rigid_bodies.rigid_scene import BodyCollider, RigidScene

MAX_FILTERS = 32
MAX_STICKING_SPEED_M_S = 0.02  # of contacts, below which static friction counts; those at rest creep less


class MaterialHooks:
    """Friction and restitution of pairs by glTF's rules: its order of combine modes, static and dynamic friction."""

    def __init__(self, colliders: dict[int, tuple[int, BodyCollider]]) -> None:
        self._colliders = colliders

    def modify_solver_contacts(self, context: Any) -> None:
        """Set friction and restitution of one pair, before each step."""
        first, second = (self._colliders[h.index][1].material for h in (context.collider1, context.collider2))
        modes = (first.friction_combine, second.friction_combine)
        static = combine(modes, first.static_friction, second.static_friction)
        dynamic = combine(modes, first.dynamic_friction, second.dynamic_friction)
        slides = static == dynamic or _sliding_speed(context) > MAX_STICKING_SPEED_M_S
        context.friction = dynamic if slides else static
        modes = (first.restitution_combine, second.restitution_combine)
        context.restitution = combine(modes, first.restitution, second.restitution)


def _sliding_speed(context: Any) -> float:
    """Largest tangential speed of a pair's contact points in m/s."""
    bodies = [context.bodies[each] for each in (context.rigid_body1, context.rigid_body2) if each is not None]
    normal = np.array(context.normal.to_tuple())
    fastest = 0.0
    for contact in context.solver_contacts:
        velocities = [np.array(body.velocity_at_point(contact.point).to_tuple()) for body in bodies]
        relative = velocities[0] - (velocities[1] if len(velocities) > 1 else 0.0)
        fastest = max(fastest, float(np.linalg.norm(relative - (relative @ normal) * normal)))
    return fastest


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

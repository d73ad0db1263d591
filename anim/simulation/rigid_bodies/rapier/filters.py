"""Collision filters of a scene as Rapier's groups of bits."""

from __future__ import annotations

from typing import Any

from anim.errors import UnsupportedError
from anim.simulation.rigid_bodies.rapier.package import load_package
from anim.simulation.rigid_bodies.rigid_scene import RigidScene

MAX_FILTERS = 32


def interaction_groups(scene: RigidScene) -> dict[Any, Any]:
    """Return a bit for each distinct filter, and the bits of those that it collides with."""
    rapier = load_package()
    filters = list(dict.fromkeys(each.filter for body in scene.bodies for each in body.colliders))
    if len(filters) > MAX_FILTERS:
        raise UnsupportedError(f"{len(filters)} different collision filters (limit {MAX_FILTERS})")
    groups = {}
    for i, own in enumerate(filters):
        bits = sum(1 << j for j, other in enumerate(filters) if own.accepts(other) and other.accepts(own))
        groups[own] = rapier.InteractionGroups(rapier.Group(1 << i), rapier.Group(bits))
    return groups

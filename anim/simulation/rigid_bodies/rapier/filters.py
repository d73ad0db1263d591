"""Collision filters of a scene as Rapier's groups of bits."""

from __future__ import annotations

from typing import Any

from anim.simulation.rigid_bodies.description import CollisionFilter
from anim.simulation.rigid_bodies.filters import match_filters
from anim.simulation.rigid_bodies.rapier.package import load_package
from anim.simulation.rigid_bodies.rigid_scene import RigidScene


def interaction_groups(scene: RigidScene) -> dict[CollisionFilter, Any]:
    """Return a bit for each distinct filter, and the bits of those that it collides with."""
    rapier, groups = load_package(), {}
    for i, (own, collides) in enumerate(match_filters(scene).items()):
        bits = sum(1 << j for j, is_met in enumerate(collides) if is_met)
        groups[own] = rapier.InteractionGroups(rapier.Group(1 << i), rapier.Group(bits))
    return groups

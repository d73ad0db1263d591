"""Different collision filters of a scene: the engine has a bit for each."""

from __future__ import annotations

from anim.errors import UnsupportedError
from anim.simulation.rigid_bodies.description import CollisionFilter
from anim.simulation.rigid_bodies.rigid_scene import RigidScene

MAX_FILTERS = 32  # bits of the engine's groups


def match_filters(scene: RigidScene) -> dict[CollisionFilter, list[bool]]:
    """Return the filters of a scene, in order, each with whether it collides with each of them.

    Raises UnsupportedError for more than MAX_FILTERS.
    """
    filters = list(dict.fromkeys(each.filter for body in scene.bodies for each in body.colliders))
    if len(filters) > MAX_FILTERS:
        raise UnsupportedError(
            f"has {len(filters)} different collision filters (limit {MAX_FILTERS})",
            help="give colliders that meet the same others one filter",
        )
    return {own: [own.accepts(other) and other.accepts(own) for other in filters] for own in filters}

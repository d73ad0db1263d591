"""Size of a whole scene, for an error metric of a part of it."""

from __future__ import annotations

from typing import NamedTuple

from anim.measure.error.surface import has_vertices
from anim.model import Scene


class WholeScene(NamedTuple):
    """Diagonal in m, and numbers of nodes and of stored vertices of a scene, of which another one is a part."""

    diagonal: float
    num_nodes: int
    num_vertices: int

    @classmethod
    def of(cls, scene: Scene, diagonal: float) -> WholeScene:
        """Return that of a scene with a diagonal in m."""
        return cls(diagonal, len(scene.skeleton), _count_stored(scene))

    def count_other_points(self, part: Scene, points_per_node: int) -> int:
        """Return the number of points outside a part: vertices, or without any so many around each node."""
        if has_vertices(part):
            return self.num_vertices - _count_stored(part)
        return (self.num_nodes - len(part.skeleton)) * points_per_node


def _count_stored(scene: Scene) -> int:
    """The vertices of all instances; those of repeated primitives are not stored again."""
    return sum(len(each.mesh.positions) for each in scene.instances)

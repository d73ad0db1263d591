"""Motion that drives a cloth: its pinned points and its colliders, at every substep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import RangeError
from anim.model import Clip, Scene
from anim.sampling.sample import sample
from anim.skinning.bake import Baker

MOVED_M = 1e-9  # a mesh that moves less is at rest


@dataclass(frozen=True, slots=True)
class Capsule:
    """Collider between two points, each (3,) m in the space of a node, or of the scene for None; a ball if equal.

    Raises RangeError for a radius that isn't above 0.
    """

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float
    start_node: int | None = None
    end_node: int | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0):
            raise RangeError(f"the radius of a collider is {self.radius:g} m (expected above 0)")


@dataclass(frozen=True, slots=True, eq=False)
class ClothDriver:
    """Driver of one cloth.

    baker, clip: of its mesh. vertices: (N,) of the pinned points. scene: for the colliders' nodes.
    Times count from the clip's start, before which the pose is that of the start.
    """

    baker: Baker
    clip: Clip
    vertices: Ints
    scene: Scene
    capsules: Sequence[Capsule] = ()

    def targets(self, times: Floats) -> Floats:
        """Return the positions of the pinned points (S, N, 3) m at times (S,) s."""
        if not len(self.vertices):
            return np.zeros((len(times), 0, 3))
        return self._unique(times, lambda at: self._bake(at)[:, self.vertices])

    def all_vertices(self, time: float) -> Floats:
        """Return all vertices (V, 3) m at a time."""
        return np.asarray(self._bake(np.array([self.clip.start + max(time, 0.0)]))[0])

    def colliders(self, times: Floats) -> Floats:
        """Return both centers and the radius (S, C, 7) m of all colliders at times (S,) s."""
        if not self.capsules:
            return np.zeros((len(times), 0, 7))
        return self._unique(times, self._place_capsules)

    def _place_capsules(self, times: Floats) -> Floats:
        world = sample(self.scene.skeleton, self.clip, times, space="world").world
        assert world is not None
        result = np.empty((len(times), len(self.capsules), 7))
        for k, each in enumerate(self.capsules):
            for point, node, first in ((each.start, each.start_node, 0), (each.end, each.end_node, 3)):
                matrix = None if node is None else world[:, node]
                at = np.asarray(point) if matrix is None else matrix[:, :, :3] @ np.asarray(point) + matrix[:, :, 3]
                result[:, k, first : first + 3] = at
            result[:, k, 6] = each.radius
        return result

    def _bake(self, times: Floats) -> Floats:
        cache = self.baker.bake(self.clip, times=times)
        return np.concatenate([chunk.positions for chunk in cache.chunks()]).astype(np.float64)

    def _unique(self, times: Floats, evaluate: Callable[[Floats], Floats]) -> Floats:
        """Evaluate at times that may repeat and come before 0, where the pose is that of 0."""
        at, inverse = np.unique(self.clip.start + np.maximum(times, 0.0), return_inverse=True)
        return evaluate(at)[inverse.reshape(-1)]

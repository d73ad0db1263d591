"""Motion that drives a cloth: its pinned points and its colliders, at every substep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Clip, Scene
from anim.sampling.sample import sample
from anim.simulation.cloth.colliders import Obstacle, place_obstacles
from anim.skinning.bake import Baker


@dataclass(frozen=True, slots=True, eq=False)
class ClothDriver:
    """Driver of one cloth.

    baker, clip: of its mesh. vertices: (N,) of the pinned points. scene: for the colliders' nodes.
    Times count from the clip's start, before which the pose is that of the start. period: s, after which the clip is
    repeated; None to keep its last pose.
    """

    baker: Baker
    clip: Clip
    vertices: Ints
    scene: Scene
    obstacles: Sequence[Obstacle] = ()
    period: float | None = None

    def targets(self, times: Floats) -> Floats:
        """Return the positions of the pinned points (S, N, 3) m at times (S,) s."""
        if not len(self.vertices):
            return np.zeros((len(times), 0, 3))
        return self._unique(times, lambda at: self._bake(at)[:, self.vertices])

    def all_vertices(self, time: float) -> Floats:
        """Return all vertices (V, 3) m at a time."""
        return np.asarray(self._unique(np.array([time]), self._bake)[0])

    def colliders(self, times: Floats) -> Floats:
        """Return the colliders (S, C, 8) at times (S,) s, in the scene, as of `place_obstacles`."""
        if not self.obstacles:
            return np.zeros((len(times), 0, 8))
        return self._unique(times, self._place)

    def _place(self, times: Floats) -> Floats:
        world = sample(self.scene.skeleton, self.clip, times, space="world").world
        assert world is not None
        return place_obstacles(self.obstacles, world)

    def _bake(self, times: Floats) -> Floats:
        cache = self.baker.bake(self.clip, times=times)
        return np.concatenate([chunk.positions for chunk in cache.chunks()]).astype(np.float64)

    def _unique(self, times: Floats, evaluate: Callable[[Floats], Floats]) -> Floats:
        """Evaluate at times that may repeat and come before 0, where the pose is that of 0."""
        past = np.maximum(times, 0.0)
        past = past if self.period is None else past % self.period
        if not self.clip.tracks:
            past = np.zeros_like(past)
        at, inverse = np.unique(self.clip.start + past, return_inverse=True)
        return evaluate(at)[inverse.reshape(-1)]

"""Motion that drives a cloth: its pinned points and its colliders, at every substep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Clip, Scene
from anim.sampling.sample import sample
from anim.simulation.cloth.colliders import Obstacle, place_obstacles
from anim.skinning.bake import Baker, prepare_bake


@dataclass(frozen=True, slots=True, eq=False)
class ClothDriver:
    """Driver of one cloth.

    baker, clip: of its mesh. pinned: baker of the pinned points alone, None for a cloth without any. scene: for the
    colliders' nodes. Times count from the clip's start, before which the pose is that of the start. period: s, after
    which the clip is repeated; None to keep its last pose.
    """

    baker: Baker
    pinned: Baker | None
    clip: Clip
    scene: Scene
    obstacles: Sequence[Obstacle] = ()
    period: float | None = None
    _still: list[Floats] = field(default_factory=list, init=False)  # pinned points of a clip without tracks

    def targets(self, times: Floats) -> Floats:
        """Return the positions of the pinned points (S, N, 3) m at times (S,) s."""
        pinned = self.pinned
        if pinned is None:
            return np.zeros((len(times), 0, 3))
        if self.clip.tracks:
            return self._unique(times, lambda at: self._bake(pinned, at))
        if not self._still:
            self._still.append(self._bake(pinned, np.array([self.clip.start])))
        return np.repeat(self._still[0], len(times), axis=0)

    def all_vertices(self, time: float) -> Floats:
        """Return all vertices (V, 3) m at a time."""
        return np.asarray(self._unique(np.array([time]), lambda at: self._bake(self.baker, at))[0])

    def colliders(self, times: Floats) -> Floats:
        """Return the colliders (S, C, 8) at times (S,) s, in the scene, as of `place_obstacles`."""
        if not self.obstacles:
            return np.zeros((len(times), 0, 8))
        return self._unique(times, self._place)

    def _place(self, times: Floats) -> Floats:
        world = sample(self.scene.skeleton, self.clip, times, space="world").world
        assert world is not None
        return place_obstacles(self.obstacles, world)

    def _bake(self, baker: Baker, times: Floats) -> Floats:
        cache = baker.bake(self.clip, times=times)
        return np.concatenate([chunk.positions for chunk in cache.chunks()]).astype(np.float64)

    def _unique(self, times: Floats, evaluate: Callable[[Floats], Floats]) -> Floats:
        """Evaluate at times that may repeat and come before 0, where the pose is that of 0."""
        past = np.maximum(times, 0.0)
        past = past if self.period is None else past % self.period
        if not self.clip.tracks:
            past = np.zeros_like(past)
        at, inverse = np.unique(self.clip.start + past, return_inverse=True)
        return evaluate(at)[inverse.reshape(-1)]


def bake_vertices(scene: Scene, node: int, vertices: Ints) -> Baker | None:
    """Return the baker of some vertices (N,) of the mesh of a node, None for no vertices: cheap at every substep."""
    if not len(vertices):
        return None
    meshes = [replace(each, mesh=each.mesh.keep_vertices(vertices)) for each in scene.instances if each.node == node]
    return prepare_bake(replace(scene, instances=tuple(meshes)), rigid=True, nodes=[node], threads=1)

"""What all clips of a file are optimized under: the scene's measured points, the bounds, and what may be removed."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats
from anim.measure.error import point_matrix as points_
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.error.shell_points import nodes_without_vertices
from anim.measure.error.surface import Surface, has_vertices, surfaces
from anim.model import Clip, Scene, Skeleton
from anim.optimization.options import Bounds, Effort, Policy
from anim.optimization.tracks import morph_weights
from anim.optimization.tracks.quantization import Encoding
from anim.sampling.pose import rest_pose, world_by_node


@dataclass(frozen=True, slots=True)
class Context:
    """All that a clip's optimization needs beside the clip.

    size: m, the diagonal of the box around the points at rest. rest_world: (N, 3, 4) world matrices of the rest pose.
    surfaces: those with morph targets. answering: by node that any clip moves, which points (P,) hang on it.
    unseen: (N,) nodes that carry no vertex, nor does a node on them; the node of a skinned mesh is none.
    """

    skeleton: Skeleton
    size: float
    rest_world: Floats
    points: PointMatrix
    surfaces: tuple[Surface, ...]
    answering: Mapping[int, Bools]
    unseen: Bools
    bounds: Bounds
    policy: Policy
    coding: Encoding
    effort: Effort

    def morph_reach(self, node: int) -> Floats:
        """Return how far (M, V), in metres, each morph target of a node's mesh moves each vertex at weight 1."""
        return morph_weights.influence_radius(self.surfaces, node, self.widening(node))

    def weights_at_rest(self, node: int) -> Floats:
        """Return the morph weights (M,) of a node in the rest pose."""
        return next(part.rest_weights for part in self.surfaces if part.owner == node)

    def widening(self, node: int) -> float:
        """Return how many metres of the world one unit of a node's own space is at most, in the rest pose.

        Of a skinned mesh the joints' spaces count, not its node's.
        """
        carriers = [node, *(n for part in self.surfaces if part.owner == node for n in part.nodes.tolist())]
        return float(np.sqrt((self.rest_world[carriers, :, :3] ** 2).sum(axis=1)).max())


def build_context(
    scene: Scene,
    clips: tuple[Clip, ...],
    *,
    bounds: Bounds,
    policy: Policy,
    coding: Encoding,
    effort: Effort,
    extra: Set[tuple[int, int]] = frozenset(),
) -> Context:
    """Return the setting for the clips of a scene.

    extra: vertices to measure beside those that stick out, (number of the surface, number of the vertex).
    """
    skeleton = scene.skeleton
    unseen = nodes_without_vertices(skeleton, surfaces(scene) if has_vertices(scene) else [])
    shells = set(np.flatnonzero(unseen & _moved(skeleton, clips)).tolist())
    if policy.drop_invisible:
        shells = {node for node in shells if node in policy.keep}
    world = world_by_node(skeleton, rest_pose(skeleton))[:, 0]
    points = points_.sample_points(scene, shells, bounds.shell, extra)
    driven = sorted({track.node for clip in clips for track in clip.tracks if track.node is not None})
    places = points.places(world[:, None])[:, 0]
    return Context(
        skeleton,
        float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0,
        world,
        points,
        tuple(surface for surface in surfaces(scene) if len(surface.targets)),
        {node: points.on(skeleton.descendants(node)) for node in driven},
        unseen,
        bounds,
        policy,
        coding,
        effort,
    )


def _moved(skeleton: Skeleton, clips: tuple[Clip, ...]) -> Bools:
    """Which nodes (N,) any clip moves, by a track of their own or of a node above."""
    moved = np.zeros(len(skeleton), np.bool_)
    for clip in clips:
        for track in clip.tracks:
            if track.node is not None and track.path != "weights":
                moved[track.node] = True
    for level in skeleton.levels()[1:]:
        moved[level] |= moved[skeleton.parents[level]]
    return moved

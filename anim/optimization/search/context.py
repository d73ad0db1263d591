"""Search context of all clips of a file: the scene's sample points, bounds, policy and encoding."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass

import numpy as np

from anim.arrays import MAX_SINGLE_M, Bools, Floats
from anim.maths import hierarchy
from anim.measure.error import point_matrix as points_
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.error.shell_points import nodes_without_vertices
from anim.measure.error.surface import Surface, has_vertices, surfaces
from anim.model import Clip, Scene, Skeleton, Track, parse_weight_pointer
from anim.model.skeleton import nearest_at_or_above, node_mask
from anim.optimization.options import Bounds, Effort, Policy
from anim.optimization.search.answering_points import AnsweringPoints
from anim.optimization.tracks import morph_weights
from anim.optimization.tracks.quantization import Encoding
from anim.sampling.pose import rest_world
from anim.sampling.weight_pointers import moved_nodes


@dataclass(frozen=True, slots=True)
class Context:
    """The inputs of a clip's optimization, apart from the clip.

    size: m, the diagonal of the points' bounding box in the rest pose. rest_world: (N, 3, 4) world matrices of the rest
    pose. surfaces: those with morph targets. answering: the points bound to each node or its descendants. invisible:
    (N,) nodes that, with their descendants, carry no vertex; the node of a skinned mesh is none.
    """

    skeleton: Skeleton
    size: float
    rest_world: Floats
    points: PointMatrix
    surfaces: tuple[Surface, ...]
    answering: AnsweringPoints
    invisible: Bools
    bounds: Bounds
    policy: Policy
    coding: Encoding
    effort: Effort

    @property
    def is_measurable(self) -> bool:
        """True where bounds are finite, and all coordinates small enough for their squares in float32."""
        largest = [np.abs(part).max(initial=0.0) for part in (self.rest_world, self.points.factors)]
        is_finite = bool(np.isfinite((self.size, self.bounds.max_error)).all())
        return is_finite and all(each < MAX_SINGLE_M for each in largest)

    def morph_reach(self, node: int) -> Floats:
        """Return the displacement (M, V), m, of each vertex by each morph target of a node at weight 1."""
        return morph_weights.influence_radius(self.surfaces, node, self.widening(node))

    def track_reach(self, track: Track) -> Floats:
        """Return the displacement (C, V), m, of each vertex that weights of a track move, by each at weight 1.

        Empty for a pointer whose keys have another number of values than there are weights: it moves nothing.
        """
        moved = [each for each in map(self.morph_reach, moved_nodes(self.skeleton, track)) if each.size]
        if not moved:
            return np.zeros((0, 0))
        every = np.concatenate(moved, axis=1)
        pointer = parse_weight_pointer(track.pointer)
        if pointer is not None and pointer.target is not None:
            every = every[pointer.target : pointer.target + 1]
        return every if len(every) == track.values.shape[1] else np.zeros((0, 0))

    def weights_at_rest(self, node: int) -> Floats:
        """Return the morph weights (M,) of a node in the rest pose."""
        return next(part.rest_weights for part in self.surfaces if part.owner == node)

    def widening(self, node: int) -> float:
        """Return the largest world length, in metres, of one unit of a node's own space in the rest pose.

        For a skinned mesh the joints' spaces count, not its node's.
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
    """Return the search context for the clips of a scene.

    extra: additional vertices to measure beside the extreme ones, (index of the surface, index of the vertex).
    """
    skeleton = scene.skeleton
    found = surfaces(scene) if has_vertices(scene) else []
    unseen = nodes_without_vertices(skeleton, found)
    animated = _animated_nodes(skeleton, clips)
    shells = np.flatnonzero(unseen & hierarchy.with_descendants(skeleton.parents, animated))
    if policy.drop_invisible:
        shells = np.array([node for node in shells.tolist() if node in policy.keep], np.int64)
    world = rest_world(skeleton)
    shells = points_.outermost_nodes(nearest_at_or_above(skeleton.parents, animated)[shells], shells, world[:, :, 3])
    points = points_.sample_points(scene, set(shells.tolist()), bounds.shell, extra).by_joint()
    places = points.places(world[:, None])[:, 0]
    return Context(
        skeleton,
        float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0,
        world,
        points,
        tuple(surface for surface in found if len(surface.targets)),
        AnsweringPoints(points, skeleton.parents, skeleton.subtrees()),
        unseen,
        bounds,
        policy,
        coding,
        effort,
    )


def _animated_nodes(skeleton: Skeleton, clips: tuple[Clip, ...]) -> Bools:
    """Mask (N,) of the nodes whose transforms any clip animates."""
    return node_mask(skeleton, (t.node for clip in clips for t in clip.tracks if t.path != "weights"))

"""Motion of a scene's vertices: their positions, steps and changes of velocity."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error import orientation_probes, point_matrix
from anim.measure.error.point_matrix import PointMatrix
from anim.measure.error.surface import Surface, has_vertices, morph_points, skin_points, surfaces
from anim.measure.loops import clip_ends
from anim.measure.loops.clip_ends import EndPoses, LoopRange
from anim.model import Clip, Scene
from anim.sampling.clips import sample_world_matrices
from anim.sampling.pose import rest_world, sample_pose
from anim.sampling.scene_parts import SceneDivider, ScenePart
from anim.sampling.world import world_by_node

MOTION = np.array([-1.0, 1])  # weights of two frames: the motion between them
VELOCITY_CHANGE = np.array([1.0, -1, -1, 1])  # weights of two times before and two after a key: the change of velocity
MAX_BATCH_VALUES = 1_000_000  # maximum number of values in the arrays of one step
MAX_MATRICES = 100_000  # maximum number of world matrices at once, 96 bytes each


class SkinMotion:
    """Points of a scene on which motion is measured: its vertices.

    Gaps and steps are measured on all of them, long time ranges (`places`) on the outermost ones of each joint. In a
    scene without vertices all nodes count, with six points around each; otherwise nodes that move no vertex (IK
    controls, cameras) do not count.

    nodes: (N,) indices of the skeleton's nodes in the whole scene. whole: the motion of that, if `scene` is a part.
    """

    def __init__(self, scene: Scene, *, nodes: Ints | None = None, whole: SkinMotion | None = None) -> None:
        self.skeleton = scene.skeleton
        self.nodes = np.arange(len(scene.skeleton)) if nodes is None else nodes
        self._scene, self._whole = scene, whole
        self.is_skin = has_vertices(scene)
        self.surfaces = surfaces(scene) if self.is_skin else []
        self.rest_world = rest_world(scene.skeleton)[:, None]
        self._lever: float = self._find_lever() if whole is None else whole._lever

    def part(self, found: ScenePart) -> SkinMotion:
        """Return the motion of a part of the scene, in which sizes are those of the whole."""
        return SkinMotion(found.scene, nodes=self.nodes[found.nodes], whole=self)

    @cached_property
    def divider(self) -> SceneDivider:
        """That of the scene."""
        return SceneDivider(self._scene)

    def _find_lever(self) -> float:
        if not len(self.skeleton):
            return 0.0
        return orientation_probes.PROBE_DISTANCE * orientation_probes.probe_size(self.rest_world[..., 3])

    @cached_property
    def points(self) -> PointMatrix:
        """The outermost points of each joint."""
        if not self.is_skin:
            return self.vertices
        return point_matrix.sample_points(self._scene, frozenset(), self._lever)

    @cached_property
    def size(self) -> float:
        """Diagonal of the whole scene's bounding box in the rest pose, in metres; 1 without one."""
        if self._whole is not None:
            return self._whole.size
        return orientation_probes.probe_size(self.points.places(self.rest_world)) if len(self.points) else 1.0

    @cached_property
    def _all(self) -> tuple[PointMatrix, Ints]:
        """The distinct points of all meshes, and the node of each one's mesh (P,).

        Vertices that differ only in texture coordinates or normals always move alike.
        """
        points = point_matrix.all_points(self._scene, self._lever)
        if not self.is_skin:
            return points, np.arange(len(points))
        owners = np.repeat([part.owner for part in self.surfaces], [len(part.points) for part in self.surfaces])
        chosen = points.distinct(owners)
        return points.take(chosen), owners[chosen]

    @property
    def vertices(self) -> PointMatrix:
        """All distinct points."""
        return self._all[0]

    @property
    def owners(self) -> Ints:
        """The node of each point's mesh (P,)."""
        return self._all[1]

    def places(self, clip: Clip, times: Floats, root: int = -1) -> Floats:
        """Return the positions of the outermost points (P, F, 3) at times (F,).

        The displacement of node `root` is removed.
        """
        world = world_by_node(self.skeleton, sample_pose(self.skeleton, clip, times))
        clip_ends.remove_root_motion(self.skeleton, world, root)
        return self.points.places(world)

    def steps(self, parts: Sequence[LoopRange], times: Floats) -> Floats:
        """Return the largest distance (R, F) that a vertex moves from the first of times (R, 2, F) to the second.

        parts: R ranges, of whose clips and roots these are. The displacement of the roots is removed.
        """
        return self._combined(parts, times, MOTION)

    def velocity_changes(self, parts: Sequence[LoopRange], times: Floats) -> Floats:
        """Return the largest change of velocity (R, K) of a vertex at times (R, K), in m/s, without jumps.

        Measured like `Seam.speed` of the R clips, without the displacement of their roots.
        """
        whole = [each._replace(start=each.clip.start, end=each.clip.end) for each in parts]
        probe, shortest = np.array([(each.probe, each.shortest) for each in whole]).T
        around = np.stack((-probe, -shortest, shortest, probe), axis=1)[..., None]
        held = np.stack((-shortest, -shortest, shortest, shortest), axis=1)[..., None]
        at = times[:, None]
        moves = self._combined(parts, at + around, VELOCITY_CHANGE, held=at + held)
        return np.asarray(moves / (probe - shortest)[:, None])

    def squares(self, differences: Callable[[Ints], Floats]) -> Floats:
        """Return the squared lengths (P, F) of differences of all points.

        differences: gives those of world matrices (J, F, 3, 4) of nodes (J,).
        """
        return self.vertices.squares(differences)

    def posed_at_once(self, times: int) -> int:
        """Return the number of clips, or frames, at so many times each, of which all matrices are computed at once."""
        return max(MAX_MATRICES // max(times * len(self.skeleton), 1), 1)

    def batch_size(self, matrices: int) -> int:
        """Return the number of frames that fit into one batch, with so many matrices per node and frame."""
        return max(MAX_BATCH_VALUES // max(3 * matrices * len(self.vertices), 1), 1)

    def exclude_morphing(self, squares: Floats, weights: Mapping[int, Floats]) -> list[Surface]:
        """Set the squares (P, ...) of morphing meshes to 0, and return these meshes. weights: by node."""
        morphing = [mesh for mesh in self.surfaces if len(mesh.targets) and mesh.owner in weights]
        if morphing:
            squares[np.isin(self.owners, [mesh.owner for mesh in morphing])] = 0
        return morphing

    def _combined(
        self, parts: Sequence[LoopRange], times: Floats, weights: Floats, *, held: Floats | None = None
    ) -> Floats:
        """Return the longest (R, F) weighted sums of positions at times (R, S, F).

        weights: (S,). held: times of STEP tracks.
        """
        found = np.empty((len(parts), times.shape[2]))
        origins: list[Floats] = []
        for rows, cut in _blocks(found.shape, self.posed_at_once(len(weights))):
            some, stops = parts[rows], None if held is None else held[rows, :, cut]
            world, morphs = self._posed(some, times[rows, :, cut], stops)
            if cut.start == 0:
                origins = [world[each.root, i, 0, 0, :, 3].copy() for i, each in enumerate(some)]
            for i, each in enumerate(some):
                clip_ends.remove_root_motion(self.skeleton, world[:, i], each.root, origins[i])
            longest = found[rows, cut]
            for few, frames in _blocks(longest.shape, self.batch_size(len(weights))):
                of_morphs = [{node: each[:, frames] for node, each in one.items()} for one in morphs[few]]
                longest[few, frames] = self._longest(world[:, few, :, frames], of_morphs, weights)
        return found

    def _posed(
        self, parts: Sequence[LoopRange], times: Floats, held: Floats | None
    ) -> tuple[Floats, list[dict[int, Floats]]]:
        """World matrices (N, R, S, F, 3, 4) at times (R, S, F), and morph weights (S, F, M) by node of each range."""
        stops = None if held is None else held.reshape(len(parts), -1)
        clips = [each.clip for each in parts]
        world, morphs = sample_world_matrices(self.skeleton, clips, times.reshape(len(parts), -1), step_times=stops)
        shaped = [{node: each.reshape(*times.shape[1:], -1) for node, each in one.items()} for one in morphs]
        return world.reshape(len(world), *times.shape, 3, 4), shaped

    def _longest(self, world: Floats, morphs: Sequence[Mapping[int, Floats]], weights: Floats) -> Floats:
        """world: (N, R, S, F, 3, 4). morphs: (S, F, M) by node, of each range. weights: (S,)."""
        size, count, stops, frames = world.shape[:4]

        def differences(nodes: Ints) -> Floats:
            return np.tensordot(weights, world[nodes], (0, 2)).reshape(len(nodes), -1, 3, 4)

        squares = self.squares(differences).reshape(-1, count, frames)
        morphing = [self.exclude_morphing(squares[:, i], each) for i, each in enumerate(morphs)]
        most = np.sqrt(squares.max(axis=0)).astype(np.float64)
        for i, mesh in ((i, mesh) for i, meshes in enumerate(morphing) for mesh in meshes):
            of_mesh = {mesh.owner: morphs[i][mesh.owner].reshape(stops * frames, -1)}
            seen = EndPoses(world[:, i].reshape(size, -1, 3, 4), of_mesh)
            moved = np.tensordot(weights, morphed_vertices(mesh, seen).reshape(stops, frames, -1, 3), (0, 0))
            most[i] = np.maximum(most[i], longest_each(moved))
        return np.asarray(most)


def _blocks(shape: Sequence[int], most: int) -> Iterator[tuple[slice, slice]]:
    """Yield slices of (R, F) values, of at most `most` values each: of whole rows, or of parts of one."""
    rows, columns = shape
    count = max(most // max(columns, 1), 1)
    for first in range(0, rows, count):
        for start in range(0, columns, most):
            yield slice(first, first + count), slice(start, start + most)


def morphed_vertices(mesh: Surface, seen: EndPoses) -> Floats:
    """Return the vertices (T, V, 3) of a morphing mesh, at the times of the ends."""
    placed = [
        skin_points(mesh, *each)
        for each in zip(
            morph_points(mesh, seen.weights[mesh.owner]),
            matrix.multiply(np.swapaxes(seen.world[mesh.nodes], 0, 1), mesh.bind),
            strict=True,
        )
    ]
    return np.stack(placed)


def longest_each(vectors: Floats) -> Floats:
    """Return the maximum length (D,) over each row of vectors (D, V, 3)."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1).max(axis=-1)))

"""Loop gaps as they are visible: on the skin, with the joints that cause them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import matrix
from anim.measure.error import orientation_probes, point_matrix
from anim.measure.error.point_matrix import PointMatrix, PointRows
from anim.measure.error.surface import Surface, has_vertices, morph_points, skin_points, surfaces
from anim.measure.loops import clip_ends
from anim.measure.loops.clip_ends import EndPoses, LoopRange
from anim.model import Clip, Pose, Scene
from anim.sampling.batch import ConcatenatedTracks
from anim.sampling.pose import PosedSkeleton, sample_clips, sample_pose
from anim.sampling.world import world_by_node

PARTS = ("translation", "rotation", "scale")
MOTION = np.array([-1.0, 1])  # weights of two frames: the motion between them
VELOCITY_CHANGE = np.array([1.0, -1, -1, 1])  # weights of two times before and two after a key: the change of velocity
MAX_BATCH_VALUES = 1_000_000  # maximum number of values in the arrays of one step


@dataclass(frozen=True, slots=True)
class JointGap:
    """A joint with its own loop gap. joint: its name. node: its index.

    gap: m, the largest distance that any vertex would move if this joint alone ended as it starts.
    is_morph: whether it is a mesh with open morph weights.
    """

    joint: str
    node: int
    gap: float
    is_morph: bool = False


@dataclass(frozen=True, slots=True)
class Seam:
    """Maximum over all vertices of the difference between end and start.

    gap: m. speed: m/s, the change of velocity without STEP tracks, and the joint at it (fastest, "" without a change).
    frame: m, the motion per frame next to the gap. going_on: m, the distance of the start from the extrapolated end.
    """

    gap: float = 0.0
    speed: float = 0.0
    fastest: str = ""
    frame: float = 0.0
    going_on: float = 0.0


class SkinMotion:
    """Points of a scene on which motion is measured: its vertices.

    Gaps and steps are measured on all of them, long time ranges (`places`) on the outermost ones of each joint. In a
    scene without vertices all nodes count, with six points around each; otherwise nodes that move no vertex (IK
    controls, cameras) do not count.
    """

    def __init__(self, scene: Scene) -> None:
        self.skeleton = scene.skeleton
        self._scene = scene
        self.is_skin = has_vertices(scene)
        self._surfaces = surfaces(scene) if self.is_skin else []
        self._rest_world = PosedSkeleton.at_rest(scene.skeleton).world
        self._lever = (
            orientation_probes.PROBE_DISTANCE * orientation_probes.probe_size(self._rest_world[..., 3])
            if len(scene.skeleton)
            else 0.0
        )

    @cached_property
    def points(self) -> PointMatrix:
        """The outermost points of each joint."""
        nodes = range(0 if self.is_skin else len(self.skeleton))
        return point_matrix.sample_points(self._scene, frozenset(nodes), self._lever)

    @cached_property
    def size(self) -> float:
        """Diagonal of the scene's bounding box in the rest pose, in metres; 1 without one."""
        return orientation_probes.probe_size(self.points.places(self._rest_world)) if len(self.points) else 1.0

    @cached_property
    def _all(self) -> tuple[PointMatrix, Ints]:
        """The distinct points of all meshes, and the node of each one's mesh (P,).

        Vertices that differ only in texture coordinates or normals always move alike.
        """
        points = point_matrix.all_points(self._scene, self._lever)
        owners = np.repeat([part.owner for part in self._surfaces], [len(part.points) for part in self._surfaces])
        chosen = points.distinct(owners) if self.is_skin else np.arange(len(points))
        return points.take(chosen), owners[chosen] if self.is_skin else chosen

    @property
    def _every(self) -> PointMatrix:
        return self._all[0]

    @cached_property
    def _rows(self) -> PointRows:
        return self._every.rows()

    @property
    def _owners(self) -> Ints:
        """The node of each point's mesh (P,)."""
        return self._all[1]

    def places(self, clip: Clip, times: Floats, root: int = -1) -> Floats:
        """Return the positions of the outermost points (P, F, 3) at times (F,).

        The displacement of node `root` is removed.
        """
        world = world_by_node(self.skeleton, sample_pose(self.skeleton, clip, times))
        clip_ends.remove_root_motion(self.skeleton, world, root)
        return self.points.places(world)

    def steps(self, clip: Clip, times: Floats, root: int = -1) -> Floats:
        """Return the largest distance (F,) that a vertex moves from the first of times (2, F) to the second.

        The displacement of node `root` is removed.
        """
        return self._combined(clip, times, MOTION, root)

    def velocity_changes(self, clip: Clip, times: Floats, root: int = -1) -> Floats:
        """Return the largest change of velocity (K,) of a vertex at times (K,), in m/s, without jumps.

        Measured like `Seam.speed`, without the displacement of node `root`.
        """
        whole = LoopRange(clip, clip.start, clip.end, root=root)
        around = np.array([-whole.probe, -whole.shortest, whole.shortest, whole.probe])[:, None]
        held = np.array([-whole.shortest] * 2 + [whole.shortest] * 2)[:, None]
        moves = self._combined(clip, times + around, VELOCITY_CHANGE, root, held=times + held)
        return np.asarray(moves / (whole.probe - whole.shortest))

    def _combined(self, clip: Clip, times: Floats, weights: Floats, root: int, *, held: Floats | None = None) -> Floats:
        """Return the longest (F,) weighted sums of positions at times (S, F).

        weights: (S,). held: times of STEP tracks.
        """
        stops, frames = times.shape
        poses, (morphs,) = sample_clips(
            self.skeleton, [clip], times.reshape(1, -1), step_times=None if held is None else held.reshape(1, -1)
        )
        world = world_by_node(self.skeleton, poses)
        clip_ends.remove_root_motion(self.skeleton, world, root)
        world = world.reshape(len(world), stops, frames, 3, 4)
        morphs = {node: each.reshape(stops, frames, -1) for node, each in morphs.items()}
        count = max(MAX_BATCH_VALUES // (3 * stops * len(self._every)), 1)
        parts = []
        for first in range(0, frames, count):
            cut = slice(first, first + count)
            parts.append(
                self._longest(world[:, :, cut], {node: each[:, cut] for node, each in morphs.items()}, weights)
            )
        return np.concatenate(parts)

    def _longest(self, world: Floats, morphs: Mapping[int, Floats], weights: Floats) -> Floats:
        """world: (N, S, F, 3, 4). morphs: (S, F, M) by node. weights: (S,)."""
        size, stops, frames = world.shape[:3]
        squares = self._squares(np.tensordot(weights, world, (0, 1)))
        morphing = [mesh for mesh in self._surfaces if len(mesh.targets) and mesh.owner in morphs]
        if morphing:
            squares[np.isin(self._owners, [mesh.owner for mesh in morphing])] = 0
        most = np.sqrt(squares.max(axis=0)).astype(np.float64)
        for mesh in morphing:
            seen = EndPoses(world.reshape(size, -1, 3, 4), {mesh.owner: morphs[mesh.owner].reshape(stops * frames, -1)})
            moved = np.tensordot(weights, _morphing(mesh, seen).reshape(stops, frames, -1, 3), (0, 0))
            most = np.maximum(most, _longest_each(moved))
        return np.asarray(most)

    def seams(self, parts: Sequence[LoopRange], groups: Sequence[ConcatenatedTracks] | None = None) -> list[Seam]:
        """Return the difference between the end of each range and its start, in pose and velocity.

        groups: the tracks of all clips from `concatenate`, if the caller has them.
        """
        if not parts or not len(self._every):
            return [Seam() for _ in parts]
        has_frame = any(part.frame for part in parts)
        seen = clip_ends.poses_around_ends(self.skeleton, parts, groups, has_frame=has_frame)
        wanted = clip_ends.DIFFERENCES if has_frame else clip_ends.WITHOUT_FRAME
        count = max(MAX_BATCH_VALUES // (3 * len(wanted) * len(self._every)), 1)
        return [
            seam
            for first in range(0, len(parts), count)
            for seam in self._seams(seen[first : first + count], parts[first : first + count], wanted)
        ]

    def _seams(self, seen: Sequence[EndPoses], parts: Sequence[LoopRange], wanted: Floats) -> list[Seam]:
        """wanted: (D, T), DIFFERENCES or WITHOUT_FRAME."""
        worlds = np.stack([each.world for each in seen], axis=1)  # (N, parts, T, 3, 4)
        differences = clip_ends.differences(worlds, 2, wanted)
        squares = self._squares(differences.reshape(len(self.skeleton), -1, 3, 4)).reshape(
            len(self._every), len(seen), -1
        )
        return [
            self._seam(squares[:, i], each, part, wanted)
            for i, (each, part) in enumerate(zip(seen, parts, strict=True))
        ]

    def _seam(self, squares: Floats, seen: EndPoses, part: LoopRange, wanted: Floats) -> Seam:
        """squares: (P, D), the squared lengths of all differences, with morphing meshes at rest."""
        morphing = [mesh for mesh in self._surfaces if len(mesh.targets) and mesh.owner in seen.weights]
        if morphing:
            squares[np.isin(self._owners, [mesh.owner for mesh in morphing])] = 0
        most = np.sqrt(squares.max(axis=0)).astype(np.float64)
        fastest = self._carrier(int(squares[:, clip_ends.VELOCITY].argmax()))
        for mesh in morphing:
            moved = _longest_each(clip_ends.differences(_morphing(mesh, seen), 0, wanted))
            fastest = self._name(mesh.owner) if moved[clip_ends.VELOCITY] > most[clip_ends.VELOCITY] else fastest
            most = np.maximum(most, moved)
        gap, speed, *of_frames = most.tolist()
        second, last, going_on = of_frames or (0.0, 0.0, gap)
        speed = speed / (part.probe - part.shortest) if part.end > part.start else 0.0
        return Seam(gap, speed, fastest if speed else "", max(second, last), going_on)

    def _squares(self, differences: Floats) -> Floats:
        """Squared lengths (P, F) of the motion of all points, from differences of world matrices (N, F, 3, 4)."""
        moves = self._rows.moves(point_matrix.stack_points(differences, self._every.nodes))
        moves *= moves
        return np.asarray(moves.sum(axis=1))

    def _carrier(self, point: int) -> str:
        """Name of the node with the largest weight at a point."""
        most = self._every.factors[point, :, 3].argmax()
        return self._name(int(self._every.nodes[self._every.joints[point, most]]))

    def gaps(self, clip: Clip, start: float, end: float, root: int = -1) -> list[JointGap]:
        """Return the joints whose pose at `end` differs from that at `start`, the largest gap first.

        The translation of `root` does not count. Morph weights count for the node of their mesh.
        """
        both = sample_pose(self.skeleton, clip, np.array([start, end]))
        nodes = self._moved_between(both, root)
        found = dict(zip(nodes.tolist(), self._carried(both, nodes, root), strict=True))
        rows = [JointGap(self._name(node), node, float(gap)) for node, gap in found.items()]
        for node, weights in both.weights.items():
            change = self._morphed(node, weights[1] - weights[0])
            rows.append(JointGap(self._name(node), node, change, is_morph=True))
        return sorted((each for each in rows if each.gap > 0), key=lambda each: (-each.gap, each.node))

    def moving(self, clip: Clip, start: float, end: float, frame: float, root: int = -1) -> set[int]:
        """Return the nodes with points that move in the first or in the last frame."""
        frames = (np.array([start, start + frame]), np.array([end - frame, end]))
        found = [self._moved_between(sample_pose(self.skeleton, clip, times), root) for times in frames]
        return {node for node in np.concatenate(found).tolist() if self._carries(node)}

    def _name(self, node: int) -> str:
        return self.skeleton.names[node] or f"node {node}"

    def _carries(self, node: int) -> bool:
        below: Bools = self.skeleton.descendants(node)[self.points.nodes]
        return bool((below[self.points.joints] & (self.points.factors[..., 3] > 0)).any())

    def _moved_between(self, both: Pose, root: int) -> Ints:
        """Indices of nodes with different local transforms in the two frames of a pose; q and −q are equal."""
        differs = (both.scale[0] != both.scale[1]).any(axis=1)
        differs |= np.minimum(*(np.abs(both.rotation[0] - s * both.rotation[1]).max(axis=1) for s in (1, -1))) > 0
        shifted = (both.translation[0] != both.translation[1]).any(axis=1)
        if root >= 0:
            shifted[root] = False
        return np.flatnonzero(differs | shifted)

    def _carried(self, both: Pose, nodes: Ints, root: int) -> Floats:
        """Largest distance (K,) that a point moves if one of the nodes (K,), alone, ends as it starts."""
        frame = np.arange(len(nodes))
        parts = {name: np.repeat(getattr(both, name)[1:], len(nodes), axis=0) for name in PARTS}
        for name, values in parts.items():
            values[frame, nodes] = getattr(both, name)[0, nodes]
        if root >= 0:
            parts["translation"][:, root] = both.translation[1, root]
        last = Pose(both.times[1:], both.translation[1:], both.rotation[1:], both.scale[1:])
        times = np.repeat(both.times[1:], len(nodes))
        changed = Pose(times, parts["translation"], parts["rotation"], parts["scale"])
        differences = np.subtract(*(world_by_node(self.skeleton, each) for each in (changed, last)))
        count = max(MAX_BATCH_VALUES // (3 * max(len(self._every), 1)), 1)
        stretches = (differences[:, first : first + count] for first in range(0, len(nodes), count))
        squares = [self._squares(each).max(axis=0, initial=0.0) for each in stretches if len(self._every)]
        return np.sqrt(np.concatenate(squares)) if squares else np.zeros(len(nodes))

    def _morphed(self, node: int, change: Floats) -> float:
        """Largest distance, in metres, that a change of morph weights (M,) moves a vertex of a node's mesh."""
        mine = [part for part in self._surfaces if part.owner == node and len(part.targets) == len(change)]
        return max((self._widening(part) * _longest(np.tensordot(change, part.targets, 1)) for part in mine), default=0)

    def _widening(self, part: Surface) -> float:
        """Largest length in metres of one unit of a mesh's space, in the rest pose."""
        world = matrix.multiply(self._rest_world[part.nodes, 0], part.bind)
        return float(np.sqrt((world[..., :3] ** 2).sum(axis=-2)).max())


def _morphing(mesh: Surface, seen: EndPoses) -> Floats:
    """Vertices (T, V, 3) of a morphing mesh, at the times of the ends."""
    placed = [
        skin_points(mesh, *each)
        for each in zip(
            morph_points(mesh, seen.weights[mesh.owner]),
            matrix.multiply(np.swapaxes(seen.world[mesh.nodes], 0, 1), mesh.bind),
            strict=True,
        )
    ]
    return np.stack(placed)


def _longest_each(vectors: Floats) -> Floats:
    """Maximum length (D,) over each row of vectors (D, V, 3)."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1).max(axis=-1)))


def _longest(vectors: Floats) -> float:
    return float(np.sqrt((vectors * vectors).sum(axis=-1)).max(initial=0.0))

"""Scores of methods in a clip: enclosed volume, and distance from the bones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Bools, Floats, Ints
from anim.maths.hierarchy import subtree_sums
from anim.model import Clip, FrameChunk, Skeleton
from anim.sampling.pose import PosedSkeleton, PoseSampler
from anim.skinning.analysis.enclosed_volume import volumes, watertight_faces_of_all
from anim.skinning.analysis.method_deviation import max_distance, model_size
from anim.skinning.bake import Baker
from anim.skinning.binding import SkinBinding
from anim.skinning.bound_mesh import BoundMesh
from anim.skinning.methods.bulge_clamp import BoneSegments, bone_segments, clamp_positions

BULGE_RATIO = 1.05  # distance from the bones relative to bind pose, above which a vertex bulges
MIN_DISTANCE_FRACTION = 0.25  # of the median distance: nearer vertices have no meaningful ratio


@dataclass(frozen=True, slots=True)
class MethodScore:
    """Score of one method on one mesh.

    volume: (F,) enclosed, relative to bind pose; None without a closed part.
    bulge: largest distance of a vertex between two joints from their bones, relative to bind pose.
    bulging: fraction of all vertices that are ever above 1.05. vertex, joint, time: location of the bulge.
    max_distance, max_distance_time: largest distance (m) of a vertex from linear blending, and its time (s). unusable:
    whether that is more than the size of the model.
    """

    method: str
    volume: Floats | None
    bulge: float
    bulging: float
    vertex: int
    joint: str
    time: float
    max_distance: float = 0.0
    max_distance_time: float = 0.0
    unusable: bool = False


@dataclass(frozen=True, slots=True)
class BindMeasures:
    """Measures of a mesh in bind pose, the reference for later poses.

    faces: (C, 3) of closed parts. volume: m³ enclosed, below 0 if the skeleton mirrors the mesh at rest.
    watched: (W,) vertices whose bulge counts.
    """

    layer: BoundMesh
    faces: Ints
    volume: float
    links: BoneSegments
    watched: Ints


def bind_measures(layers: Sequence[BoundMesh], rest: PosedSkeleton) -> list[BindMeasures]:
    """Return the measures of meshes in bind pose. rest: their skeleton in the rest pose."""
    closed = watertight_faces_of_all([(each.rig.points, each.rig.faces) for each in layers])
    return [_bind_measures(layer, own, rest) for layer, own in zip(layers, closed, strict=True)]


def _bind_measures(layer: BoundMesh, closed: Bools, rest: PosedSkeleton) -> BindMeasures:
    rig = layer.rig
    faces = rig.faces[closed]
    volume = float(volumes(rig.points[None], faces)[0]) if len(faces) else 0.0
    volume *= np.sign(_common_volume(rig, layer.matrices(rest, slice(None)))[0])
    of = bone_segments(rig)
    shared = of.fraction > 0
    middle = float(np.median(of.distance[shared])) if shared.any() else 0.0
    watched = np.flatnonzero(shared & (of.distance > MIN_DISTANCE_FRACTION * middle))
    return BindMeasures(layer, faces if volume else faces[:0], volume, of, watched)


def score_methods(
    bakers: Mapping[str, Baker], linear: Baker, subjects: list[BindMeasures], clip: Clip, times: Floats
) -> Iterator[tuple[MethodScore, ...]]:
    """Yield the scores of each mesh by each method at `times` (F,) s of a clip. linear: the baker by lbs."""
    seen = [[_Extremes(each, len(times)) for _ in bakers] for each in subjects]
    skeleton = linear.scene.skeleton
    sampler = PoseSampler(skeleton, clip)
    others = [baker.bake(clip, times=times).chunks() for baker in bakers.values() if baker is not linear]
    for straight, *bent in zip(linear.bake(clip, times=times).chunks(), *others, strict=True):
        frames = sampler.posed(times[straight.first : straight.first + len(straight.positions)])
        rest = iter(bent)
        chunks = [straight if baker is linear else next(rest) for baker in bakers.values()]
        for subject, extremes in zip(subjects, seen, strict=True):
            matrices = subject.layer.matrices(frames, slice(None))
            for each, chunk in zip(extremes, chunks, strict=True):
                each.add(chunk, straight, matrices)
    sizes = {method: model_size(baker) for method, baker in bakers.items()}
    for extremes in seen:
        yield tuple(
            each.score(method, skeleton, times, size)
            for each, (method, size) in zip(extremes, sizes.items(), strict=True)
        )


class _Extremes:
    """Extreme values of one mesh over the frames so far."""

    def __init__(self, of: BindMeasures, frames: int) -> None:
        self._of = of
        self._volume = np.zeros(frames)
        self._bulge = np.zeros(len(of.watched), np.float32)
        self._when = np.zeros(len(of.watched), np.int64)
        self._off = np.zeros(frames)

    def add(self, chunk: FrameChunk, linear: FrameChunk, matrices: Floats) -> None:
        """Add some frames. linear: the same frames by linear blending. matrices: of the joints."""
        of, rig = self._of, self._of.layer.rig
        span = slice(of.layer.at, of.layer.at + len(rig.points))
        if chunk is not linear:
            distance = max_distance(chunk.positions[:, span], linear.positions[:, span])
            self._off[chunk.first : chunk.first + len(distance)] = distance
        if len(of.faces):
            enclosed = volumes(chunk.positions[:, span], of.faces)
            unit = of.volume * np.abs(_common_volume(rig, matrices))
            self._volume[chunk.first : chunk.first + len(enclosed)] = enclosed / unit
        if len(of.watched):
            self._add_bulge(chunk.positions, matrices, chunk.first)

    def _add_bulge(self, positions: AnyArray, matrices: Floats, first: int) -> None:
        from anim.skinning.kernels.bone_distance import squared_bone_distance

        of, rig, links = self._of, self._of.layer.rig, self._of.links
        joints, scales = clamp_positions(of.links, matrices)
        squared = np.empty((len(positions), len(rig.points)), np.float32)
        at = of.layer.at
        squared_bone_distance(positions, at, rig.start, rig.joint, links.start, links.tips, joints, squared)
        pivot = rig.joint[rig.start[of.watched]]
        rest = of.links.distance[of.watched] * np.where(scales > 0, scales, np.inf)[:, pivot]
        ratio = np.sqrt(squared[:, of.watched]) / rest
        at = ratio.argmax(axis=0)
        most = np.take_along_axis(ratio, at[None], 0)[0]
        self._when[most > self._bulge] = first + at[most > self._bulge]
        self._bulge = np.maximum(self._bulge, most)

    def score(self, method: str, skeleton: Skeleton, times: Floats, limit: float) -> MethodScore:
        """Return the score. limit: m from linear blending above which a method is unusable."""
        of, rig = self._of, self._of.layer.rig
        volume = self._volume if len(of.faces) else None
        most_off = float(self._off.max(initial=0.0))
        away = (most_off, float(times[self._off.argmax()]) if len(times) else 0.0, most_off > limit)
        if not len(of.watched):
            return MethodScore(method, volume, 1.0, 0.0, 0, "", 0.0, *away)
        most = int(self._bulge.argmax())
        vertex = int(of.watched[most])
        node = int(rig.nodes[rig.joint[rig.start[vertex]]])
        bulging = float((self._bulge > BULGE_RATIO).sum()) / len(rig.points)
        where = (vertex, skeleton.display_name(node), float(times[self._when[most]]))
        return MethodScore(method, volume, float(self._bulge[most]), bulging, *where, *away)


def _common_volume(rig: SkinBinding, matrices: Floats) -> Floats:
    """Volume factor (n,) of matrices (n, J, 3, 4): the rig's unit, or a scaled root; < 0 if it mirrors.

    The weighted median over joints with weight, each with the weight of all joints in its subtree, because its scale
    acts on them. A few joints that grow or shrink don't count.
    """
    own = np.bincount(rig.joint, rig.weight, minlength=len(rig.nodes))
    weight = np.where(own > 0, subtree_sums(rig.ancestors, np.asarray(own, np.float64)), 0)
    sizes = np.linalg.det(matrices[..., :3])
    order = np.argsort(sizes, axis=1)
    middle = (np.cumsum(weight[order], axis=1) >= weight.sum() / 2).argmax(axis=1)
    common = np.take_along_axis(sizes, np.take_along_axis(order, middle[:, None], 1), 1)[:, 0]
    return np.where(common != 0, common, 1.0)

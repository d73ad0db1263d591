"""Collapse index: volume loss of linear blending around a vertex."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.model import Clip, Skeleton
from anim.sampling.pose import PosedSkeleton, PoseSampler
from anim.skinning.binding import SkinBinding
from anim.skinning.bound_mesh import BoundMesh
from anim.skinning.kernels.layout import LANES, FloatArray, group_influences
from anim.skinning.methods.skinner import fill_lanes, lanes
from anim.skinning.polar_decomposition import decompose, joint_origins

MIN_TWIST_COSINE = 0.7  # between rotation axis and bone, above which the rotation is a twist


@dataclass(frozen=True, slots=True)
class CollapsePoint:
    """The vertex and time of the smallest collapse index.

    index: √ of the volume factor: 1 rigid, 0 flat or inside out; radius of a twisted ring relative to rest.
    vertex: of the mesh. joint, other: names of its two strongest joints. time: s. angle: rad between the two then.
    twist: whether they rotate about the bone between them, rather than bend.
    """

    index: float
    vertex: int
    joint: str
    other: str
    time: float
    angle: float
    twist: bool


@dataclass(frozen=True, slots=True)
class CollapseIndices:
    """Collapse indices of one mesh in one clip.

    least: (V,) of each vertex at its worst time. by_frame: (F,) of the worst vertex. inverted: (V,) whether it is ever
    inside out.
    """

    least: Floats
    by_frame: Floats
    inverted: Bools
    worst: CollapsePoint


def collapse_indices(
    skeleton: Skeleton, layers: Sequence[BoundMesh], clip: Clip, times: Floats
) -> list[CollapseIndices]:
    """Return the collapse indices of each skinned mesh at `times` (F,) s of a clip.

    √D with D = ±det(Σ w A) / Π |det A|^w, A the linear parts of the joints' matrices and w the skin weights: scales
    are divided out, and so is the mirroring of a vertex all of whose joints are mirrored at rest (the minus). Joints
    of scale 0 don't count as collapse.
    """
    sampler = PoseSampler(skeleton, clip)
    rest = PosedSkeleton.at_rest(skeleton)
    found = [_LowestFactors(layer, rest, len(times)) for layer in layers]
    for first in range(0, len(times), LANES):
        frames = sampler.posed(times[first : first + LANES])  # once for all meshes
        for each in found:
            each.add(frames, first)
    return _with_points(skeleton, found, sampler, times)


class _LowestFactors:
    """Smallest volume factors of one mesh over the frames so far.

    least, when: (V,) of each vertex, and its frame. by_frame: (F,) of the worst vertex.
    """

    def __init__(self, layer: BoundMesh, rest: PosedSkeleton, frames: int) -> None:
        rig = layer.rig
        self.layer = layer
        self._influences = group_influences(rig.influences)
        self._sides = _mirror_signs(rig, layer.matrices(rest, slice(None))[0])
        self._unbound = (np.diff(rig.start) == 0)[:, None]
        self.least = np.full(len(rig.points), np.inf, np.float32)
        self.when = np.zeros(len(rig.points), np.int64)
        self.by_frame = np.zeros(frames)

    def add(self, frames: PosedSkeleton, first: int) -> None:
        """Add at most LANES frames from index `first` on."""
        from anim.skinning.kernels.volume_ratio import volume_ratio

        matrices = self.layer.matrices(frames, slice(None))
        factors: FloatArray = np.empty((len(self.least), len(matrices)), np.float32)
        volume_ratio(self._influences, lanes(matrices), _log_volumes(matrices), factors)
        factors *= self._sides[:, None]
        factors[~np.isfinite(factors) | self._unbound] = 1
        self.by_frame[first : first + LANES] = factors.min(axis=0, initial=1)
        at = factors.argmin(axis=1)
        lowest = np.take_along_axis(factors, at[:, None], 1)[:, 0]
        self.when[lowest < self.least] = first + at[lowest < self.least]
        self.least = np.minimum(self.least, lowest)


def _with_points(
    skeleton: Skeleton, found: Sequence[_LowestFactors], sampler: PoseSampler, times: Floats
) -> list[CollapseIndices]:
    """The results, each with its worst vertex: the meshes that are worst at one time share its pose."""
    worst = [int(each.least.argmin()) for each in found]
    frame = [int(each.when[vertex]) for each, vertex in zip(found, worst, strict=True)]
    result: dict[int, CollapseIndices] = {}
    posed, posed_frame = None, -1
    for i in sorted(range(len(found)), key=frame.__getitem__):
        each, time = found[i], float(times[frame[i]])
        if posed is None or frame[i] != posed_frame:
            posed, posed_frame = sampler.posed(np.array([time])), frame[i]
        root = np.sqrt(np.clip(each.least.astype(np.float64), 0, None))
        point = _collapse_point(skeleton, each.layer, posed, worst[i], time, float(root[worst[i]]))
        by_frame = np.sqrt(np.clip(each.by_frame, 0, None))
        result[i] = CollapseIndices(root, by_frame, each.least < 0, point)
    return [result[i] for i in range(len(found))]


def _mirror_signs(rig: SkinBinding, still: Floats) -> FloatArray:
    """−1 for each vertex (V,) if all its joints are mirrored in matrices (J, 3, 4) at rest, else 1."""
    signs, size = np.sign(np.linalg.det(still[..., :3]))[rig.joint], len(rig.points)
    vertex = np.repeat(np.arange(size), np.diff(rig.start))
    mirrored, others = np.bincount(vertex, signs < 0, size), np.bincount(vertex, signs > 0, size)
    return np.where((mirrored > 0) & (others == 0), -1, 1).astype(np.float32)


def _log_volumes(matrices: Floats) -> FloatArray:
    """log |det A| (J, LANES); NaN for a flat joint."""
    sizes = np.abs(np.linalg.det(matrices[..., :3]))
    return fill_lanes(np.log(np.where(sizes > 0, sizes, np.nan)).T)


def _collapse_point(
    names: Skeleton, layer: BoundMesh, frames: PosedSkeleton, vertex: int, time: float, index: float
) -> CollapsePoint:
    rig = layer.rig
    influences = rig.joint[rig.start[vertex] : rig.start[vertex + 1]].tolist()
    if not influences:
        return CollapsePoint(index, vertex, "", "", time, 0.0, False)
    a, b = influences[0], influences[1] if len(influences) > 1 else influences[0]
    matrices = layer.matrices(frames, slice(None))
    places = joint_origins(rig)[[a, b]]
    first, second = decompose(matrices[:, [a, b]], places).rotation[0]
    turn = quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(first), second))
    angle, link = float(np.linalg.norm(turn)), places[1] - places[0]
    along = abs(float(turn @ link))
    is_twist = along > MIN_TWIST_COSINE * angle * float(np.linalg.norm(link)) and along > 0
    return CollapsePoint(
        index, vertex, names.display_name(rig.nodes[a]), names.display_name(rig.nodes[b]), time, angle, is_twist
    )

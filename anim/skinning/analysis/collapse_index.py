"""Collapse index: volume loss of linear blending around a vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.model import Clip, Scene, Skeleton
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


def collapse_indices(scene: Scene, layer: BoundMesh, clip: Clip, times: Floats) -> CollapseIndices:
    """Return the collapse indices of a skinned mesh at `times` (F,) s of a clip.

    √D with D = ±det(Σ w A) / Π |det A|^w, A the linear parts of the joints' matrices and w the skin weights: scales
    are divided out, and so is the mirroring of a vertex all of whose joints are mirrored at rest (the minus). Joints
    of scale 0 don't count as collapse.
    """
    from anim.skinning.kernels.volume_ratio import volume_ratio

    rig = layer.rig
    sampler = PoseSampler(scene.skeleton, clip)
    influences, sides = (
        group_influences(rig.influences),
        _mirror_signs(rig, layer.matrices(PosedSkeleton.at_rest(scene.skeleton), slice(None))[0]),
    )
    least = np.full(len(rig.points), np.inf, np.float32)
    when = np.zeros(len(rig.points), np.int64)
    by_frame = np.zeros(len(times))
    for first in range(0, len(times), LANES):
        matrices = layer.matrices(sampler.posed(times[first : first + LANES]), slice(None))
        factors: FloatArray = np.empty((len(rig.points), len(matrices)), np.float32)
        volume_ratio(influences, lanes(matrices), _log_volumes(matrices), factors)
        factors *= sides[:, None]
        factors[~np.isfinite(factors) | (np.diff(rig.start) == 0)[:, None]] = 1
        by_frame[first : first + LANES] = factors.min(axis=0, initial=1)
        at = factors.argmin(axis=1)
        lowest = np.take_along_axis(factors, at[:, None], 1)[:, 0]
        when[lowest < least] = first + at[lowest < least]
        least = np.minimum(least, lowest)
    root = np.sqrt(np.clip(least.astype(np.float64), 0, None))
    worst = int(least.argmin())
    time = float(times[when[worst]])
    narrow = _collapse_point(scene.skeleton, layer, sampler, worst, time, float(root[worst]))
    return CollapseIndices(root, np.sqrt(np.clip(by_frame, 0, None)), least < 0, narrow)


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
    names: Skeleton, layer: BoundMesh, sampler: PoseSampler, vertex: int, time: float, index: float
) -> CollapsePoint:
    rig = layer.rig
    influences = rig.joint[rig.start[vertex] : rig.start[vertex + 1]].tolist()
    if not influences:
        return CollapsePoint(index, vertex, "", "", time, 0.0, False)
    a, b = influences[0], influences[1] if len(influences) > 1 else influences[0]
    matrices = layer.matrices(sampler.posed(np.array([time])), slice(None))
    places = joint_origins(rig)[[a, b]]
    first, second = decompose(matrices[:, [a, b]], places).rotation[0]
    turn = quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(first), second))
    angle, link = float(np.linalg.norm(turn)), places[1] - places[0]
    along = abs(float(turn @ link))
    is_twist = along > MIN_TWIST_COSINE * angle * float(np.linalg.norm(link)) and along > 0
    return CollapsePoint(
        index, vertex, names.display_name(rig.nodes[a]), names.display_name(rig.nodes[b]), time, angle, is_twist
    )

"""Joint transforms of a UsdSkelAnimation: translation and rotation in float32, scale in float16.

float16 is too coarse for a scale such as 0.01: uniform scales that do not change go into the bind pose and the
translations of the children. Translations correct the rounding of the joints above.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Bools, Floats, Ints
from anim.errors import UnsupportedError
from anim.exchange.usd_skel.skeleton_group import SkeletonGroup
from anim.maths import matrix, quaternion
from anim.model import Pose
from anim.sampling.pose import PosedSkeleton

CONSTANT_SCALE_TOLERANCE = 1e-6  # relative
FLOAT16_ROUNDING = 5e-4  # relative
MIN_STORED_SCALE = 1e-3  # smaller ones have fewer digits in float16
MAX_FLOAT16 = float(np.finfo(np.float16).max)
MAX_BLOCK_JOINTS = 256  # at a time, for memory
MIN_DETERMINANT = 1e-12  # of a parent's matrix whose rounding can be corrected


@dataclass(frozen=True, slots=True)
class JointSamples:
    """Local transforms of J joints at F times.

    translation: (F, J, 3) float32. rotation: (F, J, 4) float32, xyzw. scale: (F, J, 3) float16.
    """

    translation: AnyArray
    rotation: AnyArray
    scale: AnyArray

    def local(self, frame: int) -> Floats:
        """Return parent_from_joint (J, 3, 4) of a frame."""
        parts = (self.translation[frame], self.rotation[frame], self.scale[frame])
        return matrix.from_trs(*(each.astype(np.float64) for each in parts))


def constant_scales(group: SkeletonGroup, pose: Pose) -> Floats:
    """Return the product (J,) of constant uniform scales of each joint and those above it that are not animated.

    Those are in the bind transforms, which then have one scale in common: Blender's bones have none. A joint with
    vertices that has another scale in its clip than at bind time, or an animated one, keeps the quotient in its
    animation.
    """
    own = np.full(len(group.joints), np.nan)
    for i, node in enumerate(group.joints):
        scale = pose.scale[:, node]
        if scale[0, 0] and _is_constant(scale, scale[0, 0]):
            own[i] = scale[0, 0]
    whole, bind = _products(group, np.nan_to_num(own, nan=1.0)), group.bind_scales()
    is_bound = np.isfinite(bind)
    wanted = bind / _common_scale((bind / np.abs(whole))[is_bound], np.isfinite(own)[is_bound])
    found = np.ones(len(group.joints))
    for i, parent in enumerate(group.parents.tolist()):
        found[i] = found[parent] if parent >= 0 else 1.0
        if np.isfinite(own[i]):
            found[i] *= own[i] / _stored_scale(abs(found[i] * own[i]) / wanted[i])
        elif is_bound[i] and _is_stored(np.abs(pose.scale[:, group.joints[i]]).max() * found[i] / wanted[i]):
            found[i] = wanted[i]
    return found


def _common_scale(ratios: Floats, is_constant: Bools) -> float:
    """The lower median of the ratios (B,) of bound joints, of constant ones if there are any; 1 for none."""
    used = np.sort(ratios[is_constant] if is_constant.any() else ratios)
    return float(used[(len(used) - 1) // 2]) if len(used) else 1.0


def _products(group: SkeletonGroup, own: Floats) -> Floats:
    """The product (J,) of each joint's own factor and those above it."""
    found = own.copy()
    for i, parent in enumerate(group.parents.tolist()):
        found[i] *= found[parent] if parent >= 0 else 1.0
    return found


def _stored_scale(ratio: float) -> float:
    """The scale for the animation near `ratio` that float16 stores: 1 if it is within its rounding, or unknown."""
    if not _is_stored(ratio) or abs(ratio - 1) < FLOAT16_ROUNDING:
        return 1.0
    return float(np.float16(ratio))


def _is_stored(ratio: float) -> bool:
    """Return True for a scale that float16 stores with all of its digits."""
    return MIN_STORED_SCALE < ratio < 1 / MIN_STORED_SCALE


def scale_remainders(group: SkeletonGroup, pose: Pose, constant: Floats) -> Floats:
    """Return the factors (J, 3) of constant scales that float16 loses; they belong into the bind transforms."""
    found = np.ones((len(group.joints), 3))
    for i, (node, parent) in enumerate(zip(group.joints, group.parents.tolist(), strict=True)):
        scale = pose.scale[:, node]
        wanted = scale[0] * ((1.0 if parent < 0 else constant[parent]) / constant[i])
        stored = _as_float16(wanted).astype(np.float64)
        if stored.all() and np.isfinite(stored).all() and _is_constant(scale, scale[0]):
            found[i] = wanted / stored
    return found


def _is_constant(rows: Floats, value: Floats | float) -> bool:
    return bool((np.abs(rows - value) <= CONSTANT_SCALE_TOLERANCE * np.abs(value)).all())


def joint_samples(group: SkeletonGroup, posed: PosedSkeleton, constant: Floats) -> JointSamples:
    """Return the joints' transforms without their `constant_scales`, rounded as they are stored.

    Raises UnsupportedError for a scale beyond float16.
    """
    frames, joints = len(posed.times), len(group.joints)
    local = _local_matrices(group, posed)
    found = JointSamples(
        np.empty((frames, joints, 3), np.float32),
        np.empty((frames, joints, 4), np.float32),
        np.empty((frames, joints, 3), np.float16),
    )
    exact, stored = np.empty((joints, frames, 3, 4)), np.empty((joints, frames, 3, 4))
    for some in _blocks_by_depth(group.parents):
        parents = group.parents[some]
        is_root = parents[0] < 0
        nodes = [group.joints[i] for i in some.tolist()]
        exact[some] = local[some] if is_root else matrix.multiply(exact[parents], local[some])
        above = np.ones(len(some)) if is_root else constant[parents]
        found.rotation[:, some], scale = _rotations_and_scales(nodes, posed)
        found.scale[:, some] = _as_float16(scale * (above / constant[some])[:, None])
        _check_stored(found.scale[:, some], scale, nodes, posed)
        wanted = local[some][..., 3] * above[:, None, None]
        shifts = wanted if is_root else _corrected(wanted, exact[some][..., 3], stored[parents])
        found.translation[:, some] = shifts.swapaxes(0, 1)
        parts = (found.translation[:, some], found.rotation[:, some], found.scale[:, some])
        own = matrix.from_trs(*(each.astype(np.float64).swapaxes(0, 1) for each in parts))
        stored[some] = own if is_root else matrix.multiply(stored[parents], own)
    return found


def _blocks_by_depth(parents: Ints) -> Iterator[Ints]:
    """Yield joints of one depth, MAX_BLOCK_JOINTS at most, those above others first. parents: (J,), before children."""
    depths = np.zeros(len(parents), np.int64)
    for i, parent in enumerate(parents.tolist()):
        depths[i] = depths[parent] + 1 if parent >= 0 else 0
    order = np.argsort(depths, kind="stable")
    for level in np.split(order, np.flatnonzero(np.diff(depths[order])) + 1):
        yield from (level[k : k + MAX_BLOCK_JOINTS] for k in range(0, len(level), MAX_BLOCK_JOINTS))


def _as_float16(scale: Floats) -> AnyArray:
    """The scales as float16, infinite beyond its largest number."""
    with np.errstate(over="ignore"):
        return scale.astype(np.float16)


def _check_stored(stored: AnyArray, scale: Floats, nodes: Sequence[int], posed: PosedSkeleton) -> None:
    """Raise UnsupportedError unless the stored scales (F, L, 3) are finite: programs show nothing of infinite ones."""
    beyond = ~np.isfinite(stored)
    if not beyond.any():
        return
    joint, frame, axis = np.argwhere(beyond.swapaxes(0, 1))[0].tolist()
    name = posed.skeleton.display_name(nodes[joint])
    raise UnsupportedError(
        f"joint '{name}' has a scale of {scale[frame, joint, axis]:g} at {posed.times[frame]:g} s, "
        f"and USD stores scales of joints as float16, up to {MAX_FLOAT16:g}"
    )


def _local_matrices(group: SkeletonGroup, posed: PosedSkeleton) -> Floats:
    """parent_from_joint (J, F, 3, 4); of roots anchor_from_joint."""
    pose, skeleton = posed.pose, posed.skeleton
    nodes = list(group.joints)
    found = matrix.from_trs(*(part[:, nodes].swapaxes(0, 1) for part in (pose.translation, pose.rotation, pose.scale)))
    for node, whole in zip(skeleton.sheared.tolist(), skeleton.sheared_local, strict=True):
        if node in group.joints:
            found[group.joints.index(node)] = whole
    return found


def _rotations_and_scales(nodes: Sequence[int], posed: PosedSkeleton) -> tuple[Floats, Floats]:
    """Rotations (F, L, 4), each on the side of the one before, and scales (F, L, 3), of sheared ones the nearest."""
    rotations = quaternion.align_signs(posed.pose.rotation[:, nodes])
    scales = np.array(posed.pose.scale[:, nodes])
    numbers = {node: i for i, node in enumerate(nodes)}
    for node, whole in zip(posed.skeleton.sheared.tolist(), posed.skeleton.sheared_local, strict=True):
        if node in numbers:
            _, rotations[:, numbers[node]], scales[:, numbers[node]], _ = matrix.decompose(whole)
    return rotations, scales


def _corrected(wanted: Floats, position: Floats, parent: Floats) -> Floats:
    """Translations (..., 3) that place a joint at `position` under the parent's stored matrices (..., 3, 4).

    Where these are flat, the translations `wanted`.
    """
    solvable = np.abs(np.linalg.det(parent[..., :3])) > MIN_DETERMINANT
    if not solvable.any():
        return wanted
    found = wanted.copy()
    offset = (position - parent[..., 3])[solvable]
    found[solvable] = np.linalg.solve(parent[solvable][..., :3], offset[..., None])[..., 0]
    return found

"""Skeleton and SkelAnimation prims."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches.formats.usd_stage import vectors
from anim.exchange.usd_skel.joint_samples import (
    CONSTANT_SCALE_TOLERANCE,
    JointSamples,
    constant_scales,
    joint_samples,
    scale_remainders,
)
from anim.exchange.usd_skel.node_prims import plain_text, set_samples
from anim.exchange.usd_skel.prim_names import joint_paths
from anim.exchange.usd_skel.skeleton_group import SkeletonGroup
from anim.maths import matrix
from anim.sampling.pose import PosedSkeleton

ROOT_JOINT = "root"  # of a mesh with blend shapes only: readers expect a joint


class SkeletonPrim:
    """A skeleton in a stage, with its animation.

    path: of the prim. rest, posed: the nodes in their rest pose and at the time codes.
    bind_scale: factor of the bind pose, for the meshes' matrices into it; with it bind transforms have no scale, which
    Blender ignores.
    """

    def __init__(
        self, stage: Any, path: str, group: SkeletonGroup, rest: PosedSkeleton, posed: PosedSkeleton, codes: list[float]
    ) -> None:
        from pxr import UsdSkel

        self.path, self._group, self._codes, self._posed = path, group, codes, posed
        prim = UsdSkel.Skeleton.Define(stage, path)
        names = [rest.skeleton.names[node] or f"node{node}" for node in group.joints]
        paths = joint_paths(names, group.parents) or [ROOT_JOINT]
        constant = constant_scales(group, posed.pose)
        factors = constant[:, None] * scale_remainders(group, posed.pose, constant)
        at_rest = _square(joint_samples(group, rest, constant).local(0))
        prim.CreateJointsAttr(paths)
        if group.joints and len(set(names)) == len(names):
            prim.CreateJointNamesAttr([plain_text(name) for name in names])
        bind, unit = _bind_transforms(group, rest, factors)
        self.bind_scale = unit
        prim.CreateBindTransformsAttr(_matrices(bind))
        prim.CreateRestTransformsAttr(_matrices(at_rest))
        self._animation = UsdSkel.Animation.Define(stage, f"{path}/animation")
        self._animation.CreateJointsAttr(paths)
        self._set_joints(joint_samples(group, posed, constant))
        UsdSkel.BindingAPI.Apply(prim.GetPrim()).CreateAnimationSourceRel().SetTargets([self._animation.GetPath()])

    def set_blend_weights(self, names: Sequence[str], weights: Floats) -> None:
        """Set the weights (F, M) of blend shapes by name; Blender reads only time samples of them."""
        from pxr import Vt

        rows = weights.astype(np.float32)
        self._animation.CreateBlendShapesAttr(names)
        attribute = self._animation.CreateBlendShapeWeightsAttr(Vt.FloatArray.FromNumpy(rows[0]))
        used = slice(None) if (rows != rows[0]).any() else slice(0, 1)
        for row, code in zip(rows[used], self._codes[used], strict=True):
            attribute.Set(Vt.FloatArray.FromNumpy(row), code)

    def _set_joints(self, samples: JointSamples) -> None:
        from pxr import Vt

        if not self._group.joints:
            frames = len(self._posed.times)
            samples = JointSamples(
                np.zeros((frames, 1, 3), np.float32),
                np.tile(np.array((0, 0, 0, 1), np.float32), (frames, 1, 1)),
                np.ones((frames, 1, 3), np.float16),
            )
        rows: tuple[tuple[Any, AnyArray, Any], ...] = (
            (self._animation.CreateTranslationsAttr(), samples.translation, vectors),
            (self._animation.CreateRotationsAttr(), samples.rotation, Vt.QuatfArray.FromNumpy),
            (self._animation.CreateScalesAttr(), samples.scale, Vt.Vec3hArray.FromNumpy),
        )
        for attribute, values, make in rows:
            set_samples(attribute, make, self._codes, np.ascontiguousarray(values))


def _bind_transforms(group: SkeletonGroup, rest: PosedSkeleton, factors: Floats) -> tuple[Floats, float]:
    """skeleton_from_joint (J, 4, 4) at bind time, and the scale of that pose; without a skin those of the rest pose.

    factors: (J, 3) of scales that are not in the animation.
    """
    if not group.joints:
        return np.eye(4)[None], 1.0
    anchor = np.eye(4)[:3] if group.anchor < 0 else rest.world[group.anchor, 0]
    found = _square(matrix.multiply(matrix.inverse(anchor), rest.world[list(group.joints), 0]))
    of_skins = [i for i, node in enumerate(group.joints) if node in group.inverse_bind]
    for i in of_skins:
        found[i] = np.linalg.inv(np.diag([*factors[i], 1.0]) @ group.inverse_bind[group.joints[i]])
    is_bound = np.isfinite(group.bind_scales())
    found[~is_bound, :3, :3] = _without_scale(found[~is_bound, :3, :3])  # no vertex follows these
    lengths = np.abs(np.linalg.det(found[is_bound, :3, :3])) ** (1 / 3)
    scale = float(np.median(lengths)) if len(lengths) else 1.0
    if abs(scale - 1) <= CONSTANT_SCALE_TOLERANCE:
        return found, 1.0
    found[of_skins, :3, 3] /= scale
    found[is_bound, :3, :3] /= scale
    return found, 1 / scale


def _without_scale(axes: Floats) -> Floats:
    """Matrices (J, 3, 3) with columns of length 1; those of length 0 stay."""
    lengths = np.linalg.norm(axes, axis=1, keepdims=True)
    return np.asarray(axes / np.where(lengths > 0, lengths, 1.0))


def _square(affine: Floats) -> Floats:
    """Matrices (J, 4, 4) of (J, 3, 4); the identity for none."""
    found = np.tile(np.eye(4), (max(len(affine), 1), 1, 1))
    found[: len(affine), :3] = affine
    return found


def _matrices(rows: Floats) -> Any:
    """Matrices (J, 4, 4) as an array of USD, which multiplies row vectors."""
    from pxr import Vt

    return Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(rows.transpose(0, 2, 1)))

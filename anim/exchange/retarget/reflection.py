"""Reflection of a character that a node above its joints mirrors as a whole, unlike the figure of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats
from anim.exchange.retarget.joint_matching import JointMatch
from anim.exchange.retarget.rest_alignment import BUILD_TOLERANCE, fit_similarity
from anim.model import Skeleton
from anim.sampling import rest_world

REFLECTION = np.array((-1.0, 1.0, 1.0))  # x → −x in world space
QUATERNION_REFLECTION = np.array((1.0, -1.0, -1.0, 1.0))  # of a rotation between two such spaces


def match_handedness(source: Skeleton, target: Skeleton, matching: JointMatch) -> Skeleton:
    """Return the target reflected in world space if its rest pose is then nearer to the source's; else the target.

    Builds that differ, and flat figures, which fit both ways, are reflected only if one is mirrored by its transforms.
    Local transforms below the roots stay, so a clip of the reflected skeleton is one of the target: its motion is
    mirrored like the target. A target with a matched root is returned as it is.
    """
    pairs = np.array([*matching.pairs.items()], np.int64)
    if (target.parents[pairs[:, 1]] < 0).any():
        return target
    own, others = rest_world(source)[pairs[:, 0]], rest_world(target)[pairs[:, 1]]
    error = fit_similarity(own[:, :, 3], others[:, :, 3]).error
    reflected = fit_similarity(own[:, :, 3], others[:, :, 3] * REFLECTION).error
    if (_is_mirrored(own) != _is_mirrored(others)).all():
        is_nearer = reflected <= error + BUILD_TOLERANCE
    else:
        is_nearer = reflected <= BUILD_TOLERANCE < error
    return _reflect(target) if is_nearer else target


def _is_mirrored(world: Floats) -> Bools:
    return np.asarray(np.linalg.det(world[..., :3]) < 0)


def _reflect(skeleton: Skeleton) -> Skeleton:
    roots = (skeleton.parents < 0)[:, None]
    sheared = skeleton.sheared_local.copy()
    sheared[skeleton.parents[skeleton.sheared] < 0] *= REFLECTION[:, None]
    return replace(
        skeleton,
        translation=np.where(roots, skeleton.translation * REFLECTION, skeleton.translation),
        rotation=np.where(roots, skeleton.rotation * QUATERNION_REFLECTION, skeleton.rotation),
        scale=np.where(roots, skeleton.scale * REFLECTION, skeleton.scale),
        sheared_local=sheared,
    )

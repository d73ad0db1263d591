"""Reflection of a character whose rest pose is that of the motion, mirrored as a whole by a node above its joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.exchange.retarget.joint_matching import JointMatch
from anim.exchange.retarget.rest_alignment import BUILD_TOLERANCE, fit_similarity
from anim.model import Skeleton
from anim.sampling import rest_world

REFLECTION = np.array((-1.0, 1.0, 1.0))  # x → −x in world space
QUATERNION_REFLECTION = np.array((1.0, -1.0, -1.0, 1.0))  # of a rotation between two such spaces


def match_handedness(source: Skeleton, target: Skeleton, matching: JointMatch) -> Skeleton:
    """Return the target reflected in world space if only then its rest pose is the source's; else the target.

    Local transforms below the roots stay, so a clip of the reflected skeleton is one of the target: its motion is
    mirrored like the target. A target with a matched root is returned as it is.
    """
    pairs = np.array([*matching.pairs.items()], np.int64)
    if (target.parents[pairs[:, 1]] < 0).any():
        return target
    points, others = rest_world(source)[pairs[:, 0], :, 3], rest_world(target)[pairs[:, 1], :, 3]
    if fit_similarity(points, others).error <= BUILD_TOLERANCE:
        return target
    return _reflect(target) if fit_similarity(points, others * REFLECTION).error <= BUILD_TOLERANCE else target


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

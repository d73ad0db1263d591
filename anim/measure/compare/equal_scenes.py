"""Scenes that are equal in all that moves vertices: equal clips move them alike."""

from __future__ import annotations

import numpy as np

from anim.measure.compare.correspondence import Correspondence
from anim.measure.error.point_groups import Binding
from anim.measure.error.surface import Surface
from anim.model import Scene, Skeleton

REST = ("parents", "translation", "rotation", "scale", "sheared", "sheared_local")


def are_equal(scene: Scene, other: Scene, pairs: Correspondence) -> bool:
    """Return whether two scenes with these corresponding surfaces have equal nodes at rest and equal joints."""
    if other is scene:
        return True
    one, second = scene.skeleton, other.skeleton
    return (
        np.array_equal(pairs.nodes, np.arange(len(second)))
        and all(_same(one, second, name) for name in REST)
        and all(new is None or _has_joints(surface, new) for surface, new in pairs.surfaces)
    )


def _same(one: Skeleton, other: Skeleton, name: str) -> bool:
    return np.array_equal(getattr(one, name), getattr(other, name))


def _has_joints(surface: Surface, new: Binding) -> bool:
    return all(np.array_equal(getattr(surface, name), getattr(new, name)) for name in Binding._fields)

"""Scenes that are equal in all that moves vertices: equal clips move them alike."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.measure.compare.correspondence import Correspondence
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.motion_error import MotionError
from anim.measure.error.point_groups import Binding
from anim.measure.error.surface import Surface
from anim.model import Clip, Scene, Skeleton

REST = ("parents", "translation", "rotation", "scale", "sheared", "sheared_local")


def are_equal_motions(ruler: ErrorMetric, before: Clip, after: Clip) -> bool:
    """Return whether two clips have equal tracks, on scenes that are equal in what a metric measures."""
    return before.tracks == after.tracks and are_equal(ruler.scene, ruler.other, ruler.pairs)


def no_error(times: Floats) -> MotionError:
    """Return the error of such clips, at times (F,) in s."""
    return MotionError(0.0, float(times[0]), "", "", len(times))


def are_equal(scene: Scene, other: Scene, pairs: Correspondence) -> bool:
    """Return whether two scenes with these corresponding surfaces have equal nodes at rest, joints and morph weights.

    Those of nodes with morph targets count too: pointers at weights move other nodes where they differ.
    """
    if other is scene:
        return True
    one, second = scene.skeleton, other.skeleton
    return (
        np.array_equal(pairs.nodes, np.arange(len(second)))
        and one.morphed == second.morphed
        and all(_same(one, second, name) for name in REST)
        and all(new is None or _is_bound_alike(surface, new) for surface, new in pairs.surfaces)
    )


def store_alike(scene: Scene, other: Scene) -> tuple[Scene, Scene]:
    """Return both scenes, with repeated primitives stored again unless both repeat the same ones.

    Other tools store equal accessors once, or one accessor several times.
    """
    repeats = [[each.mesh.repeats for each in one.instances] for one in (scene, other)]
    return (scene, other) if repeats[0] == repeats[1] else (scene.store_repeats(), other.store_repeats())


def _same(one: Skeleton, other: Skeleton, name: str) -> bool:
    return np.array_equal(getattr(one, name), getattr(other, name))


def _is_bound_alike(surface: Surface, new: Binding) -> bool:
    return all(np.array_equal(getattr(surface, name), getattr(new, name)) for name in Binding._fields)

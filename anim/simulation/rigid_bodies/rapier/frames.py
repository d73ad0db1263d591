"""Frames of bodies and colliders as Rapier's isometries."""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.maths import quaternion
from anim.simulation.rigid_bodies.rapier.package import load_package
from anim.simulation.rigid_bodies.rigid_scene import BodyCollider, Frame


def isometry(frame: Frame) -> Any:
    """Return a frame as Rapier has it."""
    rapier = load_package()
    x, y, z, w = frame.rotation.tolist()
    return rapier.Isometry3(translation=tuple(frame.position.tolist()), rotation=rapier.Rotation3(w=w, x=x, y=y, z=z))


def shape_frame(collider: BodyCollider) -> Frame:
    """The shape's own frame in the body, its center included."""
    offset = quaternion.rotate(collider.frame.rotation, np.array(collider.shape.center))
    return Frame(collider.frame.position + offset, collider.frame.rotation)

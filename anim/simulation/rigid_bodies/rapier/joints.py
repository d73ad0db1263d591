"""Joints of Rapier: limits and drives of a description on its generic joint of six axes."""

from __future__ import annotations

import math
from typing import Any

from anim.simulation.rigid_bodies.description import JointDrive, JointLimit
from anim.simulation.rigid_bodies.rapier.package import load_package
from anim.simulation.rigid_bodies.rigid_scene import Frame, RigidJoint

AXES = (("LIN_X", "LIN_Y", "LIN_Z"), ("ANG_X", "ANG_Y", "ANG_Z"))  # linear, angular
MAX_DISTANCE_M = 1e9  # of a limit with one bound


def build_joint(joint: RigidJoint) -> Any:
    """Return Rapier's joint for two bodies."""
    rapier = load_package()
    builder = rapier.GenericJointBuilder(_mask(rapier, [axis for each in joint.limits for axis in _locked(each)]))
    builder = builder.local_frame1(_isometry(rapier, joint.frames[0]))
    builder = builder.local_frame2(_isometry(rapier, joint.frames[1]))
    builder = builder.contacts_enabled(joint.enable_collision)
    coupled: list[str] = []
    for limit in joint.limits:
        if _is_soft(limit):
            for axis in limit.axes:
                target = limit.min if len(limit.axes) == 1 else 0.0
                spring = JointDrive(
                    limit.angular,
                    axis,
                    position_target=target,
                    stiffness=limit.stiffness or 0.0,
                    damping=limit.damping,
                )
                builder = _add_drive(rapier, builder, spring)
        elif _is_hard_range(limit):
            alone, together = _divide_axes(limit, coupled)
            for name in alone:
                builder = builder.limits(getattr(rapier.JointAxis, name), *_bounds(limit, is_common=False))
            if together:
                builder = builder.limits(getattr(rapier.JointAxis, together[0]), *_bounds(limit, is_common=True))
            coupled += together
    if coupled:
        builder = builder.coupled_axes(_mask(rapier, coupled))
    for drive in joint.drives:
        builder = _add_drive(rapier, builder, drive)
    return builder.build()


def find_approximations(joint: RigidJoint) -> list[str]:
    """Return what Rapier does other than described, in words for a note."""
    soft_ranges = any(each.stiffness is not None and not _is_soft(each) and _is_bounded(each) for each in joint.limits)
    least = any(len(each.axes) > 1 and each.min > 0 for each in joint.limits)
    angles = [len(each.axes) for each in joint.limits if each.angular and len(each.axes) > 1 and _is_hard_range(each)]
    return [
        *["soft limits of a range are hard"] * soft_ranges,
        *["a least distance of 2 or 3 axes is ignored"] * least,
        *["a limit of the angle about 3 axes is one of the swing, and one of the twist"] * (3 in angles),
        *["of several limits of angles about 2 or 3 axes, the second and later ones hold for each axis by itself"]
        * (len(angles) > 1),
    ]


def _is_bounded(limit: JointLimit) -> bool:
    return math.isfinite(limit.max) or (len(limit.axes) == 1 and math.isfinite(limit.min))


def _is_fixed(limit: JointLimit) -> bool:
    return limit.max <= 0 if len(limit.axes) > 1 else limit.min == limit.max


def _is_soft(limit: JointLimit) -> bool:
    """A limit to one value with a spring, which is a drive to it."""
    return limit.stiffness is not None and math.isfinite(limit.stiffness) and _is_fixed(limit)


def _locked(limit: JointLimit) -> list[str]:
    if _is_soft(limit) or not _is_fixed(limit) or (len(limit.axes) == 1 and limit.min != 0):
        return []
    return [AXES[limit.angular][axis] for axis in limit.axes]


def _is_hard_range(limit: JointLimit) -> bool:
    return not _is_soft(limit) and not _locked(limit) and _is_bounded(limit)


def _divide_axes(limit: JointLimit, coupled: list[str]) -> tuple[list[str], list[str]]:
    """Axes that have the limit each, and those that have it together. coupled: axes of the limits before.

    Rapier has one cone of a joint, of exactly two angular axes: a third gets the range of the cone for itself.
    """
    names = [AXES[limit.angular][axis] for axis in limit.axes]
    if len(names) == 1:
        return names, []
    if not limit.angular:
        return [], names
    if any(name in AXES[True] for name in coupled):
        return [name for name in names if name not in coupled], []
    return names[:-2], names[-2:]


def _bounds(limit: JointLimit, *, is_common: bool) -> tuple[float, float]:
    """Range of a limit. is_common: of several axes together, whose distance or angle is never negative."""
    most = math.pi if limit.angular else MAX_DISTANCE_M
    low = 0.0 if is_common else limit.min if len(limit.axes) == 1 else -limit.max
    return max(low, -most), min(limit.max, most)


def _add_drive(rapier: Any, builder: Any, drive: JointDrive) -> Any:
    axis = getattr(rapier.JointAxis, AXES[drive.angular][drive.axis])
    model = rapier.MotorModel.ACCELERATION_BASED if drive.acceleration else rapier.MotorModel.FORCE_BASED
    target = (drive.position_target, drive.velocity_target)
    builder = builder.motor_model(axis, model).motor(axis, *target, drive.stiffness, drive.damping)
    return builder.motor_max_force(axis, drive.max_force) if math.isfinite(drive.max_force) else builder


def _mask(rapier: Any, names: list[str]) -> Any:
    mask = rapier.JointAxesMask.empty()
    for name in names:
        mask = mask | getattr(rapier.JointAxesMask, name)
    return mask


def _isometry(rapier: Any, frame: Frame) -> Any:
    x, y, z, w = frame.rotation.tolist()
    return rapier.Isometry3(translation=tuple(frame.position.tolist()), rotation=rapier.Rotation3(w=w, x=x, y=y, z=z))

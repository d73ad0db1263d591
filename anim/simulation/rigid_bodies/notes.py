"""Remarks on a run that its user should read."""

from __future__ import annotations

from anim.model import Clip, Skeleton
from anim.simulation.rigid_bodies.assembly import ancestors
from anim.simulation.rigid_bodies.motion import RigidMotion
from anim.simulation.rigid_bodies.rapier_joints import find_approximations
from anim.simulation.rigid_bodies.rigid_scene import RigidScene

MIN_OVERLAP_PER_RADIUS = 0.02  # of the smaller body; less is the tolerance of contacts
FRICTION_DIFFERENCE = 0.2  # of static and dynamic friction, relative, that is worth a word
SHEAR_TOLERANCE = 1e-3
MAX_LISTED = 3


def find_notes(rigid: RigidScene, skeleton: Skeleton, clip: Clip, motion: RigidMotion, shear: float) -> list[str]:
    """Return remarks: overlaps at the start, approximations, animated parents, shear; empty for none."""
    return [
        *_overlaps(rigid, skeleton, motion),
        *_friction(rigid),
        *sorted({words for joint in rigid.joints for words in find_approximations(joint)}),
        *_animated_parents(rigid, skeleton, clip),
        *(
            [f"nodes under scaled parents are sheared by up to {shear:.1%}, which keys can't hold"]
            * (shear > SHEAR_TOLERANCE)
        ),
    ]


def _overlaps(rigid: RigidScene, skeleton: Skeleton, motion: RigidMotion) -> list[str]:
    found = []
    for first, second, depth in motion.overlaps:
        radius = min(rigid.bodies[i].radius or 1e9 for i in (first, second))
        if depth > MIN_OVERLAP_PER_RADIUS * radius:
            names = [
                skeleton.label(rigid.bodies[i].node) if rigid.bodies[i].node >= 0 else "the floor"
                for i in (first, second)
            ]
            found.append(f"{names[0]} and {names[1]} overlap by {depth * 100:.3g} cm at the start")
    more = len(found) - MAX_LISTED
    return [*found[:MAX_LISTED], f"{more} more pairs overlap at the start"] if more > 0 else found


def _friction(rigid: RigidScene) -> list[str]:
    materials = {each.material for body in rigid.bodies for each in body.colliders}
    differing = [
        m for m in materials if abs(m.static_friction - m.dynamic_friction) > FRICTION_DIFFERENCE * m.dynamic_friction
    ]
    return ["static friction differs from dynamic friction, which is used for both"] if differing else []


def _animated_parents(rigid: RigidScene, skeleton: Skeleton, clip: Clip) -> list[str]:
    tracked = {track.node for track in clip.tracks}
    below = [i for i in rigid.moving if tracked & set(ancestors(skeleton, rigid.bodies[i].node)[1:])]
    if not below:
        return []
    label = skeleton.label(rigid.bodies[below[0]].node)
    return [f"a parent of {label} is animated: play its clip too, or merge both"]

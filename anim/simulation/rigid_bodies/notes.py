"""Remarks on a run that its user should read."""

from __future__ import annotations

import numpy as np

from anim.maths import hierarchy
from anim.model import Clip, Interpolation, Skeleton
from anim.model.skeleton import node_mask
from anim.sampling.sample import sample
from anim.simulation.rigid_bodies.assembly import ancestors
from anim.simulation.rigid_bodies.extents import body_extent, smallest_radius
from anim.simulation.rigid_bodies.loop import BLEND_S
from anim.simulation.rigid_bodies.motion import RigidMotion
from anim.simulation.rigid_bodies.rapier.world import find_approximations, plane_reach
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from anim.units import format_number

MIN_OVERLAP_PER_RADIUS = 0.02  # of the smaller body; less is the tolerance of contacts
SHEAR_TOLERANCE = 1e-3
MAX_SEAM_PER_RADIUS = 0.1  # of the smallest body; less is hardly seen
MAX_LISTED = 3
MIN_JUMP_PER_RADIUS = 0.02  # of the body


def find_notes(
    rigid: RigidScene, skeleton: Skeleton, clip: Clip, motion: RigidMotion, shear: float, seam: float
) -> list[str]:
    """Return remarks: overlaps at the start, approximations, animated parents, jumps, shear, a loop's seam."""
    return [
        *_without_colliders(rigid, skeleton),
        *_overlaps(rigid, skeleton, motion),
        *_far(rigid, motion),
        *sorted({words for joint in rigid.joints for words in find_approximations(joint)}),
        *_animated_parents(rigid, skeleton, clip),
        *_jumps(rigid, skeleton, clip),
        *(
            [f"nodes under scaled parents are sheared by up to {shear:.1%}, which keys can't hold"]
            * (shear > SHEAR_TOLERANCE)
        ),
        *_seam(rigid, motion, seam),
    ]


def _without_colliders(rigid: RigidScene, skeleton: Skeleton) -> list[str]:
    own = [rigid.bodies[i] for i in rigid.moving if not rigid.bodies[i].colliders]
    joined = {i for joint in rigid.joints for i in joint.bodies}
    free = [each for each in own if rigid.bodies.index(each) not in joined]
    if not free:
        return []
    more = f" and {len(free) - 1} more" if len(free) > 1 else ""
    return [f"{skeleton.label(free[0].node)}{more}: a body without a collider (triggers are none) touches nothing"]


def _overlaps(rigid: RigidScene, skeleton: Skeleton, motion: RigidMotion) -> list[str]:
    found = []
    for first, second, depth in motion.overlaps:
        radius = min(body_extent(rigid.bodies[i], rigid.extents).radius or 1e9 for i in (first, second))
        if depth > MIN_OVERLAP_PER_RADIUS * radius:
            names = [
                skeleton.label(rigid.bodies[i].node) if rigid.bodies[i].node >= 0 else "the floor"
                for i in (first, second)
            ]
            found.append(f"{names[0]} and {names[1]} overlap by {depth * 100:.3g} cm at the start")
    more = len(found) - MAX_LISTED
    return [*found[:MAX_LISTED], f"{more} more pairs overlap at the start"] if more > 0 else found


def _far(rigid: RigidScene, motion: RigidMotion) -> list[str]:
    """Bodies that reach the end of the box that stands for a plane, where hulls fall."""
    shapes = [each.shape.kind for body in rigid.bodies for each in body.colliders]
    if "plane" not in shapes or not {"hull", "mesh"} & set(shapes):
        return []
    apart = np.linalg.norm(motion.positions - motion.positions[0].mean(axis=0), axis=-1).max(initial=0.0)
    reach = plane_reach(rigid)
    if apart <= reach:
        return []
    far, end = format_number(apart, 3), format_number(reach, 3)
    return [f"a body is {far} m from the others' start: planes end at {end} m for hulls"]


def _animated_parents(rigid: RigidScene, skeleton: Skeleton, clip: Clip) -> list[str]:
    tracked = node_mask(skeleton, (track.node for track in clip.tracks))
    is_moved = np.append(hierarchy.with_descendants(skeleton.parents, tracked), False)  # the last: above a root
    below = [i for i in rigid.moving if is_moved[skeleton.parents[rigid.bodies[i].node]]]
    if not below:
        return []
    label = skeleton.label(rigid.bodies[below[0]].node)
    return [f"a parent of {label} is animated: play its clip too, or merge both"]


def _jumps(rigid: RigidScene, skeleton: Skeleton, clip: Clip) -> list[str]:
    """Animated bodies that STEP keys move at once: within one step, so with any velocity."""
    found: list[str] = []
    stepped = [track for track in clip.tracks if track.interpolation is Interpolation.STEP]
    for i in rigid.animated if stepped else ():
        body = rigid.bodies[i]
        above = set(ancestors(skeleton, body.node))
        steps = [track.times for track in stepped if track.node in above]
        if not steps:
            continue
        at = np.unique(np.concatenate(steps))[1:]
        times = np.unique(np.concatenate((np.nextafter(at, -np.inf), at)))
        world = sample(skeleton, clip, times, space="world").world if len(times) else None
        if world is None:
            continue
        places = world[:, body.node, :, 3]
        jumps = np.linalg.norm(places[1::2] - places[::2], axis=1)
        if jumps.max() > MIN_JUMP_PER_RADIUS * body_extent(body, rigid.extents).radius:
            worst = int(jumps.argmax())
            found.append(
                f"{skeleton.label(body.node)} jumps by {jumps[worst]:.3g} m at {at[worst]:.3g} s (STEP keys): bodies "
                "that it touches are thrown away"
            )
    return found[:MAX_LISTED]


def _seam(rigid: RigidScene, motion: RigidMotion, seam: float) -> list[str]:
    if seam <= MAX_SEAM_PER_RADIUS * smallest_radius(rigid, 0.0):
        return []
    rounds = f"{motion.num_rounds} rounds of the clip"
    return [f"bodies don't repeat their motion in {rounds}: the last {BLEND_S:g} s move them {seam:.3g} m to the start"]

"""Apply an imported motion to a character: match joints by name, then retarget or bind directly."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from anim.errors import NotFoundError
from anim.exchange.euler.from_euler import ImportedMotion
from anim.exchange.retarget.bind_pose import bind_pose, fill_from_parents
from anim.exchange.retarget.ground_contact import has_feet
from anim.exchange.retarget.joint_matching import JointMatch, match_joints, match_same_hierarchy
from anim.exchange.retarget.reflection import match_handedness
from anim.exchange.retarget.rest_alignment import Measure
from anim.exchange.retarget.retarget import GroundMode, retarget
from anim.model import Clip, Scene, Skeleton
from anim.sampling import rest_world

MIN_AXIS_FRACTION = 0.8  # fraction of the length along the axis; 37°
FEET = ("left_foot", "right_foot")


@dataclass(frozen=True, slots=True)
class CharacterClip:
    """The clip for the character, and results of the retargeting.

    scale: of the path, character / motion. lowered: minimum and maximum lowering of the hips, metres.
    measure: source of the scale; None for curves of the nodes themselves. without: unmatched body parts that the path
    and the floor need, "hips", "legs" or "feet".
    num_bound: joints with a rest pose from the skins, because the nodes' rest pose differs.
    up_axes: of the motion's and the character's rest pose, see `up_axis`; "" if unknown.
    """

    clip: Clip
    matching: JointMatch
    scale: float
    lowered: tuple[float, float]
    num_bound: int = 0
    measure: Measure | None = None
    without: tuple[str, ...] = ()
    up_axes: tuple[str, str] = ("", "")


def apply_to_character(
    source: ImportedMotion,
    target: Scene,
    *,
    aliases: Mapping[str, str],
    nested: bool,
    stated: Mapping[str, int] = MappingProxyType({}),
    floor: GroundMode = GroundMode.CONTACT,
    bind_time: float | None = None,
) -> CharacterClip:
    """Return the motion as a clip of the character.

    Joints are those of the character's skins, then nodes without mesh in their tree; all its nodes if it has no skins,
    or if the motion has the character's own hierarchy.
    See `match_same_hierarchy`, `match_joints` and `retarget`.
    stated: the character's nodes by role, if its file states them (`vrm_humanoid.read_vrm_roles`).
    nested: False for a motion without hierarchy: its curves are bound directly to the nodes.
    Raises NotFoundError without any matched joint, or without joints.
    """
    joints = _skin_joints(target)
    moving, moved = matchable_nodes(source, target, nested=nested)
    matching = match_joints(
        source.skeleton.names,
        target.skeleton.names,
        aliases=aliases,
        of_source=moving,
        of_target=moved,
        others=_other_nodes(target, joints) if nested else [],
        same=match_same_hierarchy(source.skeleton, target.skeleton, moving) if nested else {},
        stated=stated,
    )
    if not target.skeleton.names:
        raise NotFoundError("the character has no nodes that a motion could move")
    if not matching.pairs:
        tops = [int(n) for level in target.skeleton.levels() for n in level if not joints or int(n) in joints]
        first = source.skeleton.names[moving[0]], target.skeleton.names[tops[0]]
        raise NotFoundError(
            "no joint of the motion is one of the character",
            help=f"pair them in an `alias` file, in lines such as '{first[0]},{first[1]}'",
        )
    if nested:
        bound = bind_pose(
            target.skeleton, [(each.node, each.skin) for each in target.instances if each.skin is not None]
        )
        figure = replace(target, skeleton=match_handedness(source.skeleton, bound.skeleton, matching))
        done = retarget(source, figure, matching, floor=floor, bind_time=bind_time)
        clip = fill_from_parents(done.clip, bound.skeleton, target.skeleton)
        return CharacterClip(
            clip,
            matching,
            done.scale,
            done.lowered,
            bound.num_joints,
            done.measure,
            _drop_unmatched(matching),
            (up_axis(source.skeleton, matching.source_roles), up_axis(bound.skeleton, matching.target_roles)),
        )
    tracks = [
        replace(track, node=matching.pairs[track.node])
        for track in source.clip.tracks
        if track.node is not None and track.node in matching.pairs
    ]
    return CharacterClip(Clip(source.clip.name, tuple(tracks)), matching, 1.0, (0.0, 0.0))


def matchable_nodes(source: ImportedMotion, target: Scene, *, nested: bool) -> tuple[list[int], list[int]]:
    """Return the matchable nodes of the motion, parents first, and those of the character.

    nested: as for `apply_to_character`.
    """
    joints = _skin_joints(target)
    moved = sorted(joints) if joints and nested else list(range(len(target.skeleton)))
    return _parents_first(source), moved


def _skin_joints(scene: Scene) -> set[int]:
    return {int(node) for each in scene.instances if each.skin is not None for node in each.skin.joints}


def _drop_unmatched(matching: JointMatch) -> tuple[str, ...]:
    found = set(matching.target_roles)
    legs = any({f"{side}_{role}" for role in ("upper_leg", "lower_leg")} <= found for side in ("left", "right"))
    here = {"hips": "hips" in found, "legs": legs, "feet": has_feet(found)}
    return tuple(name for name, known in here.items() if not known)


def _parents_first(source: ImportedMotion) -> list[int]:
    return [int(n) for level in source.skeleton.levels() for n in level if int(n) not in source.ends]


def _other_nodes(target: Scene, joints: Set[int]) -> list[int]:
    """Nodes without mesh below the parents of topmost joints: limbs missing in a skin of head or armor."""
    parents = target.skeleton.parents
    holders = {each.node for each in target.instances}
    inside = set(joints) | {int(parents[node]) for node in joints}
    for level in target.skeleton.levels():
        inside |= {node for node in level.tolist() if int(parents[node]) in inside}
    return sorted(inside - joints - holders - {-1})


def up_axis(skeleton: Skeleton, roles: Mapping[str, int]) -> str:
    """Return "X", "Y" or "Z", the axis from the feet to the hips at rest in world space.

    Without feet, from the hips to the head. "" if these are unknown, or the direction is along no axis clearly: an
    animal's back points forward, its legs still point down.
    """
    places = rest_world(skeleton)[:, :3, 3]
    feet = [places[roles[role]] for role in FEET if role in roles]
    if "hips" not in roles or not (feet or "head" in roles):
        return ""
    hips = places[roles["hips"]]
    way = np.abs(hips - np.mean(feet, axis=0) if feet else places[roles["head"]] - hips)
    axis = int(way.argmax())
    return "XYZ"[axis] if way[axis] > MIN_AXIS_FRACTION * np.linalg.norm(way) else ""

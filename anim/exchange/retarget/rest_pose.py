"""Differences of two rest poses: heading of each skeleton, and directions of its limbs."""

from __future__ import annotations

from collections.abc import Iterable, Set
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.motion import IDENTITY
from anim.exchange.retarget.joint_matching import JointMatch
from anim.exchange.retarget.joint_roles import PERSON
from anim.maths import hierarchy, quaternion
from anim.model.skeleton import nearest_ancestors

UP = np.array((0.0, 1.0, 0.0))
SNAP_ANGLE_RAD = np.radians(30)  # angles nearer to a multiple of 90° are snapped: rest poses are made along axes
LIMBS = {"upper_arm": "lower_arm", "lower_arm": "hand", "upper_leg": "lower_leg", "lower_leg": "foot"}


@dataclass(frozen=True, slots=True)
class RestPose:
    """A skeleton at rest in world space: positions (N, 3), rotations (N, 4), and parents (N,).

    scales: (N, 3) in the parent's space. local: (N, 3, 3), parent_from_node, and to_node: (N, 3, 3), node_from_world,
    both without translation.
    """

    positions: Floats
    rotations: Floats
    parents: tuple[int, ...]
    scales: Floats
    local: Floats
    to_node: Floats


def facing_rotation(source: RestPose, target: RestPose, matching: JointMatch) -> Floats:
    """Return the rotation (4,) about the vertical from the source's heading to the target's.

    The heading is right-to-left × up; skeletons without paired sides have equal headings.
    """
    headings = []
    for pose, roles in ((source, matching.source_roles), (target, matching.target_roles)):
        across = np.zeros(3)
        for role, node in roles.items():
            other = roles.get(role.replace("left_", "right_"))
            if role.startswith("left_") and other is not None:
                across += pose.positions[node] - pose.positions[other]
        headings.append(np.arctan2(across[0], across[2]) if np.hypot(across[0], across[2]) > 1e-9 else np.nan)
    angle = float(headings[1] - headings[0])
    if not np.isfinite(angle):
        angle = 0.0
    quarter = np.pi / 2 * np.rint(angle / (np.pi / 2))
    if abs(angle - quarter) < SNAP_ANGLE_RAD:
        angle = float(quarter)
    return quaternion.from_rotation_vector(UP * angle)


def rest_corrections(source: RestPose, target: RestPose, matching: JointMatch, turn: Floats) -> dict[int, Floats]:
    """Return for each matched target node the world rotation (4,) from its rest pose to the source's.

    turn: rotation from the source's heading to the target's. For human roles, arms and legs get the smallest rotation
    to the source's directions; hands and fingers rotate with the arm. Trunk, head, shoulders, feet and toes are
    unchanged: those differ in build, not in pose, and feet flat at rest remain flat. Other chains get the source's
    directions.
    """
    person = all(role in matching.source_roles for role in PERSON)
    ends = _limb_ends(matching) if person else _chain_ends(source, target, matching)
    found: dict[int, Floats] = {}
    up_rotation = _up_rotation(matching) if person else set()
    nearest = _nearest_above(target, set(matching.pairs.values()))
    for node in _parents_first(target, matching.pairs.values()):
        if node in ends:
            (a, b), end = ends[node]
            goal = quaternion.rotate(turn, source.positions[b] - source.positions[a])
            found[node] = rotation_between(target.positions[end] - target.positions[node], goal)
        elif node in up_rotation:
            found[node] = IDENTITY
        else:
            found[node] = found[nearest[node]] if nearest[node] >= 0 else IDENTITY
    return found


def rotation_between(a: Floats, b: Floats) -> Floats:
    """Return the smallest rotation (4,) from direction a (3,) to b (3,); identity for a zero vector."""
    lengths = np.linalg.norm(a) * np.linalg.norm(b)
    if lengths < 1e-12:
        return IDENTITY
    axis, cosine = np.cross(a, b), float(a @ b)
    if cosine < -0.999999 * lengths:
        side = np.cross(a, (1.0, 0, 0) if abs(a[0]) < 0.9 * np.linalg.norm(a) else (0, 0, 1.0))
        return np.append(side / np.linalg.norm(side), 0.0)
    return quaternion.normalize(np.append(axis, lengths + cosine))


LimbEnds = dict[int, tuple[tuple[int, int], int]]  # target node → source start and end, target end


def _limb_ends(matching: JointMatch) -> LimbEnds:
    ends: LimbEnds = {}
    for side in ("left", "right"):
        for role, outer in LIMBS.items():
            start, end = f"{side}_{role}", f"{side}_{outer}"
            if start in matching.source_roles and end in matching.source_roles:
                pair = matching.source_roles[start], matching.source_roles[end]
                ends[matching.target_roles[start]] = pair, matching.target_roles[end]
    return ends


def _up_rotation(matching: JointMatch) -> set[int]:
    moved = (*LIMBS, "hand")
    return {node for role, node in matching.target_roles.items() if not role.endswith(moved)}


def _chain_ends(source: RestPose, target: RestPose, matching: JointMatch) -> LimbEnds:
    """Joints with exactly one matched joint next below in both skeletons."""
    below_source = _matched_child(source, set(matching.pairs))
    below_target = _matched_child(target, set(matching.pairs.values()))
    ends: LimbEnds = {}
    for a, node in matching.pairs.items():
        children = below_source.get(a, [])
        if len(children) == 1 and below_target.get(node) == [matching.pairs[children[0]]]:
            ends[node] = (a, children[0]), matching.pairs[children[0]]
    return ends


def _matched_child(pose: RestPose, nodes: set[int]) -> dict[int, list[int]]:
    below: dict[int, list[int]] = {}
    nearest = _nearest_above(pose, nodes)
    for node in sorted(nodes):
        below.setdefault(nearest[node], []).append(node)
    return below


def _nearest_above(pose: RestPose, nodes: Set[int]) -> list[int]:
    """For every node (N,) the nearest one above it among some, −1 for none."""
    chosen = np.zeros(len(pose.parents), np.bool_)
    chosen[list(nodes)] = True
    found: list[int] = nearest_ancestors(np.array(pose.parents, np.int64), chosen).tolist()
    return found


def _parents_first(pose: RestPose, nodes: Iterable[int]) -> list[int]:
    depths = hierarchy.find_depths(np.array(pose.parents, np.int64)).tolist()
    return sorted(nodes, key=lambda node: int(depths[node]))

"""Chains as masses on springs, by every integrator: the picture of a report."""

from __future__ import annotations

import math

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Skeleton
from anim.sampling import rest_world
from anim.simulation.comparison import Comparison, compare_integrators
from anim.simulation.mass_spring import MassSpring
from anim.simulation.spring_bones.chains import SpringBones, SpringJoint
from anim.simulation.spring_bones.hierarchy import tail_at_rest

LEAN = 0.3  # of the start, relative to the distance from the root
COMPARED_S = 3.0
NO_GRAVITY = (0.0, 0.0, 0.0)
ABOUT = "the chains as masses on springs, let go from a lean without damping"
VRM, EXACT = "VRM's spring bones", "exact oscillators"  # methods without an integrator


def compare_springs(skeleton: Skeleton, bones: SpringBones, step: float, integrator: str) -> Comparison:
    """Return the chains, released from a lean without damping, by every integrator. integrator: that of the run, or "".

    Each tail is a mass of 1 kg on a spring to its position at rest. For joints by VRM the frequency is that of small
    angles: in one step of h the tail moves stiffness · h towards rest, (ωh)² = stiffness · h / length.
    """
    joints = [joint for chain in bones.chains for joint in chain.joints]
    rest, heads = _rest(skeleton, joints)
    lengths = np.linalg.norm(rest - heads, axis=1)
    omega = np.array([find_omega(each, float(length), step) for each, length in zip(joints, lengths, strict=True)])
    count = len(joints)
    system = MassSpring(
        np.concatenate([np.full(count, np.inf), np.ones(count)]),
        np.stack([np.arange(count), count + np.arange(count)], axis=1),
        np.zeros(count),
        omega**2,
        np.zeros(count),
        gravity=NO_GRAVITY,
    )
    edges, distances = _edges(bones, rest, heads)
    x = np.concatenate([rest, rest + LEAN * distances[:, None] * _sideways(rest - heads, rest)])
    fastest = float(omega.max()) * step
    runs = compare_integrators(system, x, np.zeros_like(x), step=step, duration=COMPARED_S)
    return Comparison(runs, fastest, step, edges, about=ABOUT, method=integrator or _method(joints))


def _method(joints: list[SpringJoint]) -> str:
    """The methods of a run without an integrator, in words."""
    return " and ".join(sorted({VRM if each.parameters.frequency is None else EXACT for each in joints}))


def find_omega(joint: SpringJoint, length: float, step: float) -> float:
    """Return the angular frequency of a joint in rad/s, for small angles."""
    own = joint.parameters
    if own.frequency is not None:
        return 2 * math.pi * own.frequency
    return math.sqrt(own.stiffness / (step * length)) if length > 0 else 0.0


def _rest(skeleton: Skeleton, joints: list[SpringJoint]) -> tuple[Floats, Floats]:
    """Tails and heads (J, 3) at rest, in world space."""
    world = rest_world(skeleton)
    tails = [world[each.node, :, :3] @ tail_at_rest(skeleton, each) + world[each.node, :, 3] for each in joints]
    return np.array(tails), world[[each.node for each in joints], :, 3]


def _edges(bones: SpringBones, rest: Floats, heads: Floats) -> tuple[Ints, Floats]:
    """Pairs of points along the chains to draw, and the distance (J,) of each tail from the head of its chain."""
    edges, distances, first = [], [], 0
    count = len(rest)
    for chain in bones.chains:
        for i in range(len(chain.joints)):
            j = first + i
            if i:
                edges.append((count + j - 1, count + j))
            distances.append(float(np.linalg.norm(rest[j] - heads[first])))
        first += len(chain.joints)
    if not edges:  # one joint each: the spring itself
        edges = [(j, count + j) for j in range(count)]
    return np.array(edges, np.int64), np.array(distances)


def _sideways(bones: Floats, rest: Floats) -> Floats:
    """Unit vectors (J, 3) in the plane that is drawn: along x or z for bones that are upright, upwards for others."""
    across = np.eye(3)[0 if np.ptp(rest[:, 0]) >= np.ptp(rest[:, 2]) else 2]
    upright = np.abs(bones[:, 1]) > 0.7 * np.linalg.norm(bones, axis=1)
    return np.where(upright[:, None], across, np.array([0.0, 1.0, 0.0]))

"""Spring bones: chains of joints that follow the motion of their parents late."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from anim.simulation.spring_bones.angle_limits import AngleLimit
from anim.simulation.spring_bones.colliders import ORIGIN, Collider, Vector, check_quantity, check_vector

DEFAULT_STIFFNESS = 1.0  # VRMC_springBone's schema, as all defaults here
DEFAULT_DRAG = 0.5
DEFAULT_DAMPING_RATIO = 0.5  # one visible overshoot; less resonates from joint to joint
MAX_FORCE = 1e6  # of stiffness and gravity; far above what can be seen, far below what overflows
MIN_FREQUENCY_HZ, MAX_FREQUENCY_HZ = 1e-3, 1e6
MAX_DAMPING_RATIO = 1e6
RANGES = {  # of the fields of `SpringParameters`, of gravity by component
    "stiffness": (0.0, MAX_FORCE),
    "drag": (0.0, 1.0),
    "gravity": (0.0, MAX_FORCE),
    "hit_radius": (0.0, math.inf),
    "frequency": (MIN_FREQUENCY_HZ, MAX_FREQUENCY_HZ),
    "damping_ratio": (0.0, MAX_DAMPING_RATIO),
}
DOWN: Vector = (0.0, -1.0, 0.0)


@dataclass(frozen=True, slots=True)
class SpringParameters:
    """Parameters of a joint, constant in time.

    stiffness: speed in m/s by which the tail returns to its rest direction, ≥ 0. drag: fraction of the tail's velocity
    lost in each step, 0 … 1. gravity: (3,) in m/s, power times direction, in world space.
    hit_radius: of the tail against colliders, in metres, ≥ 0.
    frequency: Hz of an angular spring that replaces stiffness and drag, or None; damping_ratio belongs to it:
    0 oscillates for ever, from 1 on nothing overshoots. Its gravity is an acceleration in m/s².
    Raises RangeError for values out of range, NaN included.
    """

    stiffness: float = DEFAULT_STIFFNESS
    drag: float = DEFAULT_DRAG
    gravity: Vector = ORIGIN
    hit_radius: float = 0.0
    frequency: float | None = None
    damping_ratio: float = DEFAULT_DAMPING_RATIO

    def __post_init__(self) -> None:
        for name in RANGES:
            if name != "frequency" or self.frequency is not None:
                check_parameter(name, getattr(self, name), name.replace("_", " "))
        object.__setattr__(self, "gravity", check_vector(self.gravity, "gravity"))
        for name in ("stiffness", "drag", "hit_radius", "damping_ratio"):
            object.__setattr__(self, name, float(getattr(self, name)))  # numpy has no type for the integers of JSON


def check_parameter(name: str, value: Any, label: str) -> None:
    """Raise RangeError unless `value` is in the range of a field of `SpringParameters`. label: for the message."""
    least, most = RANGES[name]
    number = max(map(abs, check_vector(value, label))) if name == "gravity" else value
    check_quantity(number, label, least=least, most=most)


@dataclass(frozen=True, slots=True)
class SpringJoint:
    """A joint that rotates, and its tail: the point whose motion is simulated.

    node: index of the rotating node. tail: index of a descendant, or None.
    tail_offset: (3,) m, the tail in the joint's space if there is no such node. limit: of its direction.
    """

    node: int
    tail: int | None
    parameters: SpringParameters
    tail_offset: Vector = ORIGIN
    limit: AngleLimit | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "tail_offset", check_vector(self.tail_offset, "tail offset"))


@dataclass(frozen=True, slots=True)
class SpringChain:
    """Joints from the root to the tip, with the colliders that they collide with.

    colliders: indices into `SpringBones.colliders`, in the order of their evaluation.
    center: node in whose space inertia is evaluated, None for world space.
    """

    name: str
    joints: tuple[SpringJoint, ...]
    colliders: tuple[int, ...] = ()
    center: int | None = None


@dataclass(frozen=True, slots=True)
class SpringBones:
    """All spring chains and colliders of a file.

    notes: lines about what a file states and this library does otherwise.
    """

    chains: tuple[SpringChain, ...]
    colliders: tuple[Collider, ...] = ()
    notes: tuple[str, ...] = field(default=())

    def with_parameters(self, **changes: Any) -> SpringBones:
        """Return the same chains with these parameters, fields of `SpringParameters`, for all joints."""
        chains = []
        for chain in self.chains:
            joints = [replace(each, parameters=replace(each.parameters, **changes)) for each in chain.joints]
            chains.append(replace(chain, joints=tuple(joints)))
        return replace(self, chains=tuple(chains))

    @property
    def nodes(self) -> tuple[int, ...]:
        """Nodes of all joints that rotate, in the order of the chains."""
        return tuple(joint.node for chain in self.chains for joint in chain.joints)


def chain_label(chains: Sequence[SpringChain], index: int) -> str:
    """Return the label of a chain for messages: "spring 2 'ponytail'"."""
    name = chains[index].name
    return f"spring {index} '{name}'" if name else f"spring {index}"

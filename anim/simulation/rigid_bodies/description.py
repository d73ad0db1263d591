"""Rigid bodies as a file or options describe them: by node, in the nodes' own space, before any scale."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import RangeError

Vector = tuple[float, float, float]
COMBINE_MODES = ("average", "minimum", "maximum", "multiply")  # the first that either material has counts
WATER_KG_M3 = 1000.0
MAX_SPEED_M_S = 1e6  # beyond which float32 has no distances
MAX_SIZE_M, MAX_MASS_KG = 1e5, 1e9  # of the engine's float32; a body of infinite mass has that mass
NO_POINTS: Floats = np.empty((0, 3))
NO_FACES: Ints = np.empty((0, 3), np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Shape of a collider, around the origin of its node or around `center`.

    kind: "sphere" (radius), "box" (size x, y, z), "capsule" and "cylinder" along Y (height, radius at the bottom, at
    the top), "plane" through the origin with normal +Y, solid below, "hull" of `points` (V, 3), or "mesh" of `points`
    and `faces` (T, 3). A capsule's height is that of its straight part. size: m.
    """

    kind: str
    size: tuple[float, ...] = ()
    points: Floats = field(default_factory=lambda: NO_POINTS)
    faces: Ints = field(default_factory=lambda: NO_FACES)
    center: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) and value >= 0 for value in self.size) or (self.size and not any(self.size)):
            raise RangeError(f"a {self.kind} has size {list(self.size)} (expected numbers above 0)")
        if self.size and max(self.size) > MAX_SIZE_M:
            raise RangeError(f"a {self.kind} has size {list(self.size)} (limit {MAX_SIZE_M:g} m)")
        if self.kind in ("sphere", "box") and not all(self.size):
            raise RangeError(f"a {self.kind} has size {list(self.size)} (expected numbers above 0)")
        if self.kind == "mesh" and not len(self.faces):
            raise RangeError("the mesh has no faces")
        if self.kind == "hull" and len(self.points) < 4:
            raise RangeError(f"the hull of {len(self.points)} points has no volume")


@dataclass(frozen=True, slots=True)
class Material:
    """Surface of a collider. static_friction, dynamic_friction: Coulomb's, restitution: speed kept by a bounce.

    friction_combine, restitution_combine: one of COMBINE_MODES. Raises RangeError.
    """

    static_friction: float = 0.6
    dynamic_friction: float = 0.6
    restitution: float = 0.0
    friction_combine: str = "average"
    restitution_combine: str = "average"

    def __post_init__(self) -> None:
        for name in ("static_friction", "dynamic_friction", "restitution"):
            check_positive(name.replace("_", " "), getattr(self, name))
        for mode in (self.friction_combine, self.restitution_combine):
            if mode not in COMBINE_MODES:
                raise RangeError(f"the combine mode is '{mode}' (expected {', '.join(COMBINE_MODES)})")


@dataclass(frozen=True, slots=True)
class CollisionFilter:
    """Systems of a collider, and those it collides with: all but `not_collide_with`, or `collide_with` alone."""

    systems: frozenset[str] = frozenset()
    collide_with: frozenset[str] | None = None
    not_collide_with: frozenset[str] = frozenset()

    def accepts(self, other: CollisionFilter) -> bool:
        """Return whether a collider with this filter collides with one of `other`, if that accepts it too."""
        if self.collide_with is not None and not other.systems & self.collide_with:
            return False
        return not other.systems & self.not_collide_with


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of a body. Vectors are in its node's space; None: computed from the colliders.

    kinematic: it keeps its velocity. mass: kg, infinite for math.inf. density: kg/m³, without `mass`.
    inertia_diagonal: kg·m², infinite for 0. inertia_orientation: quaternion xyzw.
    follows_clip: the driving clip moves the body if it has tracks of its node.
    velocity_in_world: `linear_velocity` is in world space. Raises RangeError.
    """

    kinematic: bool = False
    mass: float | None = None
    density: float = WATER_KG_M3
    center_of_mass: Vector | None = None
    inertia_diagonal: Vector | None = None
    inertia_orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    linear_velocity: Vector = (0.0, 0.0, 0.0)
    angular_velocity: Vector = (0.0, 0.0, 0.0)
    gravity_factor: float = 1.0
    follows_clip: bool = True
    velocity_in_world: bool = False

    def __post_init__(self) -> None:
        if self.mass is not None and not self.mass > 0:
            raise RangeError(f"mass is {self.mass:g} kg (expected above 0)")
        if self.mass is not None and MAX_MASS_KG < self.mass < math.inf:
            raise RangeError(f"mass is {self.mass:g} kg (limit {MAX_MASS_KG:g}; 0 is an infinite mass)")
        if not (math.isfinite(self.density) and self.density > 0):
            raise RangeError(f"density is {self.density:g} kg/m³ (expected above 0)")
        if self.inertia_diagonal is not None:
            for value in self.inertia_diagonal:
                check_positive("inertia", value)
        vectors = (self.linear_velocity, self.angular_velocity, self.center_of_mass or (), (self.gravity_factor,))
        if not all(math.isfinite(value) for vector in vectors for value in vector):
            raise RangeError("a velocity, center of mass or gravity factor isn't finite")
        if (speed := math.hypot(*self.linear_velocity)) > MAX_SPEED_M_S:
            raise RangeError(f"the velocity is {speed:g} m/s (limit {MAX_SPEED_M_S:g})")


@dataclass(frozen=True, slots=True, eq=False)
class Collider:
    """Shape, material and filter of a node."""

    shape: Shape
    material: Material = field(default_factory=Material)
    filter: CollisionFilter = field(default_factory=CollisionFilter)


@dataclass(frozen=True, slots=True)
class JointLimit:
    """Range of the relative translation (m) along, or rotation (rad) about, 1 to 3 axes together.

    With two or three axes the distance, or the angle, is limited. stiffness: None for a hard limit. Raises RangeError.
    """

    angular: bool
    axes: tuple[int, ...]
    min: float = -math.inf
    max: float = math.inf
    stiffness: float | None = None
    damping: float = 0.0

    def __post_init__(self) -> None:
        check_axes(self.axes)
        if self.min > self.max:
            raise RangeError(f"a joint's limits are {self.min:g} to {self.max:g} (expected min below max)")
        check_positive("a joint's stiffness", self.stiffness or 0.0)
        check_positive("a joint's damping", self.damping)


@dataclass(frozen=True, slots=True)
class JointDrive:
    """Motor on an axis: force = stiffness · (position_target − position) + damping · (velocity_target − velocity).

    acceleration: scale the force by the effective mass. Metres and newtons, or radians and newton metres.
    """

    angular: bool
    axis: int
    acceleration: bool = False
    max_force: float = math.inf
    position_target: float = 0.0
    velocity_target: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        check_axes((self.axis,))
        for name in ("max_force", "stiffness", "damping"):
            check_positive(name.replace("_", " "), getattr(self, name), finite=name != "max_force")


@dataclass(frozen=True, slots=True)
class Joint:
    """Connection of two nodes' frames: `connected` moves relative to `node`, both carried by their bodies."""

    node: int
    connected: int
    limits: tuple[JointLimit, ...] = ()
    drives: tuple[JointDrive, ...] = ()
    enable_collision: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class PhysicsDescription:
    """Motions and colliders by node, and joints. floor: height of a static plane, None for none. Raises RangeError."""

    motions: Mapping[int, Motion] = field(default_factory=dict)
    colliders: Mapping[int, Collider] = field(default_factory=dict)
    joints: tuple[Joint, ...] = ()
    floor: float | None = None
    floor_material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        if self.floor is not None and not abs(self.floor) <= MAX_SIZE_M:
            raise RangeError(f"`floor` is at {self.floor:g} m (limit {MAX_SIZE_M:g})")


def combine(modes: tuple[str, str], first: float, second: float, order: Sequence[str] = COMBINE_MODES) -> float:
    """Return the friction or restitution of two materials, by the mode of both that counts first in `order`."""
    mode = min(modes, key=order.index)
    if mode == "average":
        return (first + second) / 2
    if mode == "multiply":
        return first * second
    return min(first, second) if mode == "minimum" else max(first, second)


def check_positive(name: str, value: float, *, finite: bool = True) -> None:
    """Raise RangeError for a negative number, or one that isn't finite."""
    if math.isnan(value) or value < 0 or (finite and math.isinf(value)):
        raise RangeError(f"{name} is {value:g} (expected at least 0)")


def check_axes(axes: tuple[int, ...]) -> None:
    """Raise RangeError unless these are one to three different axes, 0 to 2."""
    if not axes or len(set(axes)) < len(axes) or not set(axes) <= {0, 1, 2}:
        raise RangeError(f"a joint has axes {list(axes)} (expected some of 0, 1, 2)")

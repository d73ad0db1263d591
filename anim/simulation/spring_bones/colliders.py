"""Colliders of spring bones: spheres, capsules and planes on nodes, and those that keep joints inside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from anim.errors import RangeError, ShapeError

Vector = tuple[float, float, float]
ORIGIN: Vector = (0.0, 0.0, 0.0)
FORWARD: Vector = (0.0, 0.0, 1.0)  # the normal of a plane, unless stated


class ColliderShape(StrEnum):
    """Shape of a collider, by the names of VRMC_springBone."""

    SPHERE = "sphere"
    CAPSULE = "capsule"
    PLANE = "plane"


@dataclass(frozen=True, slots=True)
class Collider:
    """One collider.

    node: index of the node that carries it, None for the scene itself.
    offset: center of a sphere, first center of a capsule, a point of a plane; in the node's space, in metres.
    tail: second center of a capsule. normal: of a plane, the side that joints stay on; any length but 0.
    radius: in metres, not scaled by the node, as in players. inside: joints stay inside the sphere or capsule.
    Raises RangeError for a negative radius, numbers that are not finite, or a normal without length.
    Collider(3, ColliderShape.SPHERE, radius=0.1): a ball of 10 cm around node 3
    """

    node: int | None
    shape: ColliderShape
    offset: Vector = ORIGIN
    tail: Vector = ORIGIN
    normal: Vector = FORWARD
    radius: float = 0.0
    inside: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        for field in ("offset", "tail", "normal"):
            object.__setattr__(self, field, check_vector(getattr(self, field), field))
        check_quantity(self.radius, "radius", least=0.0)
        object.__setattr__(self, "radius", float(self.radius))  # numpy has no type for the integers of JSON
        if self.shape is ColliderShape.PLANE and not any(self.normal):
            raise RangeError("normal is 0, 0, 0 (expected a direction)")


def check_vector(value: object, name: str) -> Vector:
    """Return three finite numbers as a tuple. Raises ShapeError or RangeError otherwise."""
    x, y, z = check_numbers(value, name, 3)
    return x, y, z


def check_numbers(value: object, name: str, count: int) -> tuple[float, ...]:
    """Return `count` finite numbers as a tuple of floats. Raises ShapeError or RangeError otherwise."""
    try:
        numbers = tuple(_as_float(each) for each in value)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise ShapeError(f"{name} is {value!r} (expected {count} numbers)") from None
    if len(numbers) != count:
        raise ShapeError(f"{name} has {len(numbers)} numbers (expected {count})")
    if not all(map(math.isfinite, numbers)):
        raise RangeError(f"{name} holds {next(x for x in numbers if not math.isfinite(x))} (expected finite numbers)")
    return numbers


def check_quantity(value: float, name: str, *, least: float, most: float = math.inf) -> None:
    """Raise RangeError unless `value` is a finite number from `least` to `most`."""
    number = _as_float(value)
    if not (math.isfinite(number) and least <= number <= most):
        limit = f"{least:g} to {most:g}" if math.isfinite(most) else f"{least:g} or more"
        raise RangeError(f"{name} is {number:g} (expected {limit})")


def _as_float(value: float) -> float:
    """A number as a float; infinity for an integer beyond all floats."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf

"""EulerMotion, the common form of all track formats: nodes with one curve per axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.curve import Curve
from anim.maths.euler import AxesConvention

ZERO, ONES = np.zeros(3), np.ones(3)
IDENTITY = np.array((0.0, 0.0, 0.0, 1.0))


class Unit(StrEnum):
    """Unit of angles."""

    DEG = "deg"
    RAD = "rad"

    @property
    def radians(self) -> float:
        """Radians per unit."""
        return np.pi / 180 if self is Unit.DEG else 1.0


@dataclass(frozen=True, slots=True)
class Convention:
    """Combination of three angles to a rotation: one of 24 conventions, and the unit."""

    order: str
    frame: AxesConvention
    unit: Unit

    def __str__(self) -> str:
        return f"{self.order} {self.frame} {self.unit}"


@dataclass(frozen=True, slots=True)
class Pivots:
    """Offsets of FBX and Maya around the rotation: T·Roff·Rp·Rpre·R·Rpost⁻¹·Rp⁻¹·Soff·Sp·S·Sp⁻¹.

    pre_rotation, post_rotation: unit quaternions (4,). The others: offsets (3,) in metres.
    """

    pre_rotation: Floats = field(default_factory=lambda: IDENTITY)
    post_rotation: Floats = field(default_factory=lambda: IDENTITY)
    rotation_offset: Floats = field(default_factory=lambda: ZERO)
    rotation_pivot: Floats = field(default_factory=lambda: ZERO)
    scaling_offset: Floats = field(default_factory=lambda: ZERO)
    scaling_pivot: Floats = field(default_factory=lambda: ZERO)


NO_PIVOTS = Pivots()
OFFSETS = ("rotation_offset", "rotation_pivot", "scaling_offset", "scaling_pivot")


@dataclass(frozen=True, slots=True)
class EulerNode:
    """One node: parent, rest pose, and animation curves.

    parent: index of the parent, −1 for a root. translation, scale: (3,) at rest.
    order, frame: convention of `angles` and the rotation curves; as many axes as angles. Angles at rest are in radians.
    rotation: a curve per axis of the order, None for an axis with its constant rest angle.
    moves, scales: curves by 0, 1, 2 for x, y, z; metres and factors.
    end: True for a node that only marks the end of its parent: an End Site of BVH.
    """

    name: str
    parent: int
    translation: Floats
    order: str
    frame: AxesConvention
    angles: Floats
    rotation: tuple[Curve | None, ...]
    moves: Mapping[int, Curve] = field(default_factory=dict)
    scale: Floats = field(default_factory=lambda: ONES)
    scales: Mapping[int, Curve] = field(default_factory=dict)
    pivots: Pivots = NO_PIVOTS
    end: bool = False


@dataclass(frozen=True, slots=True)
class EulerMotion:
    """All nodes, parents before children, and facts about the source.

    sampled: True for a recording: curves are frames without defined motion between them, and a jump of an angle by a
    multiple of 360° is no rotation. None if only the keys can tell.
    nested: True if the source has a hierarchy; if not, `parent` is −1 everywhere.
    notes: lines for the user about corrected faults.
    """

    nodes: tuple[EulerNode, ...]
    sampled: bool | None = None
    nested: bool = True
    notes: tuple[str, ...] = ()


def scale_motion(motion: EulerMotion, factor: float) -> EulerMotion:
    """Return the motion with every length multiplied: offsets, pivots and translation curves."""
    return motion if factor == 1 else replace(motion, nodes=tuple(_scale_curve(node, factor) for node in motion.nodes))


def z_up_to_y_up(motion: EulerMotion) -> EulerMotion:
    """Return a Z-up motion as a Y-up one: every coordinate (x, y, z) becomes (x, z, −y).

    Axes are renamed, rotations remain Euler rotations: about Z becomes about Y, about Y becomes about −Z.
    """
    return replace(motion, nodes=tuple(_rotate_node(node) for node in motion.nodes))


def _scale_curve(node: EulerNode, factor: float) -> EulerNode:
    pivots = node.pivots
    if pivots is not NO_PIVOTS:
        pivots = replace(pivots, **{name: getattr(pivots, name) * factor for name in OFFSETS})
    moves = {axis: curve.scaled(factor) for axis, curve in node.moves.items()}
    return replace(node, translation=node.translation * factor, moves=moves, pivots=pivots)


def _rotate_node(node: EulerNode) -> EulerNode:
    sign = [-1.0 if axis == "Y" else 1.0 for axis in node.order]
    rotation = tuple(
        curve.scaled(-1.0) if curve is not None and s < 0 else curve
        for curve, s in zip(node.rotation, sign, strict=True)
    )
    moves = {(0, 2, 1)[axis]: curve.scaled(-1.0) if axis == 1 else curve for axis, curve in node.moves.items()}
    pivots = node.pivots
    if pivots is not NO_PIVOTS:
        turned = {name: _rotate_vector(getattr(pivots, name)) for name in OFFSETS}
        turned |= {
            name: np.append(_rotate_vector(getattr(pivots, name)[:3]), getattr(pivots, name)[3])
            for name in ("pre_rotation", "post_rotation")
        }
        pivots = replace(pivots, **turned)
    return replace(
        node,
        translation=_rotate_vector(node.translation),
        order=node.order.translate(str.maketrans("YZ", "ZY")),
        angles=node.angles * sign,
        rotation=rotation,
        moves=moves,
        scale=node.scale[[0, 2, 1]],
        scales={(0, 2, 1)[axis]: curve for axis, curve in node.scales.items()},
        pivots=pivots,
    )


def _rotate_vector(vector: Floats) -> Floats:
    return np.array((vector[0], vector[2], -vector[1]))

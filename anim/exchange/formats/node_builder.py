"""Build EulerNodes from the channels of CSV and JSON files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.errors import AnimError, FormatError
from anim.exchange.euler.convention import axis_index
from anim.exchange.euler.curve import Curve
from anim.exchange.euler.motion import NO_PIVOTS, Convention, EulerMotion, EulerNode, Pivots, scale_motion

MAX_UNIT_M = 1e9  # m; limit of a file's unit of length
KINDS = {"t": "translation", "r": "rotation", "s": "scale"}
PATHS = tuple(KINDS.values())
AXIS_NAMES, ANGLE_NAMES = tuple("xyz"), tuple("xyz123")


@dataclass(slots=True)
class NodeBuilder:
    """A node under construction. Angles at rest and lengths are in the file's units, rotation curves in radians."""

    name: str
    convention: Convention
    parent: str | None = None
    translation: Floats = field(default_factory=lambda: np.zeros(3))
    angles: Floats = field(default_factory=lambda: np.zeros(3))
    scale: Floats = field(default_factory=lambda: np.ones(3))
    pivots: Pivots = NO_PIVOTS
    curves: dict[tuple[str, int], Curve] = field(default_factory=dict)

    def place(self, kind: str, axis: str) -> tuple[str, int]:
        """Return the slot of a channel such as ("rotation", "x"). Raises FormatError for others."""
        if kind == "rotation" and axis in ANGLE_NAMES:
            number = axis_index(axis, self.convention.order)
            if number is None:
                raise FormatError(
                    f"axis '{axis}' has no single place in order {self.convention.order} (expected 1, 2, 3 by place)"
                )
            return kind, number
        if kind in PATHS and axis in AXIS_NAMES:
            return kind, AXIS_NAMES.index(axis)
        raise FormatError(f"unknown channel '{kind}.{axis}' (expected translation, rotation or scale, and x, y or z)")

    def unit(self, slot: tuple[str, int]) -> float:
        """Return radians per unit of a rotation, 1 for lengths and factors."""
        return self.convention.unit.radians if slot[0] == "rotation" else 1.0

    def add(self, slot: tuple[str, int], curve: Curve) -> None:
        """Store a curve in its slot, rotations in radians. Raises FormatError for a used slot."""
        if slot in self.curves:
            raise FormatError(f"a second curve for {slot[0]} {slot[1] + 1} of node '{self.name}'")
        self.curves[slot] = curve


def build_nodes(drafts: list[NodeBuilder], meters_per_unit: float) -> tuple[tuple[EulerNode, ...], bool]:
    """Return the nodes, parents first, lengths in metres, and True if any has a parent.

    Raises FormatError for a missing parent, or a cycle of parents.
    """
    by_name = {draft.name: draft for draft in drafts}
    ordered: list[NodeBuilder] = []
    numbers: dict[str, int] = {}
    for draft in drafts:
        chain, names = [draft], {draft.name}
        while chain[-1].parent is not None and chain[-1].name not in numbers:
            parent = by_name.get(chain[-1].parent)
            if parent is None:
                raise FormatError(f"node '{chain[-1].name}' has the parent '{chain[-1].parent}', which is not there")
            if parent.name in names:
                raise FormatError(f"node '{parent.name}' is its own ancestor")
            chain.append(parent)
            names.add(parent.name)
        for each in reversed(chain):
            if each.name not in numbers:
                numbers[each.name] = len(ordered)
                ordered.append(each)
    nodes = tuple(_node(d, -1 if d.parent is None else numbers[d.parent]) for d in ordered)
    return scale_motion(EulerMotion(nodes), meters_per_unit).nodes, any(node.parent >= 0 for node in nodes)


def check_nodes(draft: NodeBuilder, slot: tuple[str, int], build: Callable[[float], Curve]) -> None:
    """Store the curve of `build(unit)` in a node's slot. Raises FormatError with the position of a fault.

    unit: the factor of values and tangents, which gives radians.
    """
    try:
        draft.add(slot, build(draft.unit(slot)))
    except FormatError:
        raise
    except AnimError as error:
        raise FormatError(error.problem, where=error.where, help=error.help) from None


def _node(draft: NodeBuilder, parent: int) -> EulerNode:
    curves, convention = draft.curves, draft.convention
    return EulerNode(
        draft.name,
        parent,
        draft.translation,
        convention.order,
        convention.frame,
        draft.angles * convention.unit.radians,
        tuple(curves.get(("rotation", place)) for place in range(3)),
        {axis: curve for (kind, axis), curve in curves.items() if kind == "translation"},
        draft.scale,
        {axis: curve for (kind, axis), curve in curves.items() if kind == "scale"},
        draft.pivots,
    )

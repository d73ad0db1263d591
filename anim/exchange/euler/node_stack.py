"""Many EulerNodes of one convention: local transforms of all of them in one pass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.exchange.euler.baked_keys import curves_of
from anim.exchange.euler.curve import Curve
from anim.exchange.euler.curve_stack import CurveStack
from anim.exchange.euler.motion import NO_PIVOTS, EulerNode
from anim.maths import euler, quaternion

PATHS = ("translation", "rotation", "scale")


def path_curves(node: EulerNode, path: str) -> list[Curve]:
    """Return the curves that a path of a node depends on; with pivots a translation depends on all."""
    if path == "translation" and node.pivots is not NO_PIVOTS:
        return curves_of(node)
    if path == "rotation":
        return [curve for curve in node.rotation if curve is not None]
    return [*(node.moves if path == "translation" else node.scales).values()]


class NodeStack:
    """M nodes with one order and frame, all with pivots or all without, key times rounded to float32.

    Values are those of `evaluate.evaluate_rotation` and its neighbors for single nodes, to the bit.
    """

    def __init__(self, nodes: Sequence[EulerNode]) -> None:
        self.nodes = nodes
        self._order, self._frame = nodes[0].order, nodes[0].frame
        angles = len(self._order)
        slots = {
            "rotation": range(angles),
            "translation": range(angles, angles + 3),
            "scale": range(angles + 3, angles + 6),
        }
        self._slots = {path: np.array(slot, np.int64) for path, slot in slots.items()}
        self._resting = np.array([(*node.angles, *node.translation, *node.scale) for node in nodes])
        rows = [(*node.rotation, *map(node.moves.get, range(3)), *map(node.scales.get, range(3))) for node in nodes]
        curves = [curve for row in rows for curve in row if curve is not None]
        self._curve_of = np.full(self._resting.shape, -1)
        self._curve_of[np.array([[curve is not None for curve in row] for row in rows])] = np.arange(len(curves))
        self._curves = CurveStack(curves)
        self._curves.round_times()
        self._constant, self._stepped = self._curves.is_constant, self._curves.is_stepped
        self._has_pivots = nodes[0].pivots is not NO_PIVOTS

    def knots(self, path: str) -> tuple[Ints, Floats]:
        """Return the key times (T,) of the curves that a path depends on, each after its node (T,)."""
        node, curve = self._among(path)
        return self._curves.knots(curve, node)

    def is_stepped(self, path: str) -> Bools:
        """Return True (M,) for nodes whose changing curves of a path are steps, of which there are some."""
        node, curve = self._among(path)
        changing = ~self._constant[curve]
        changes, moves = np.zeros(len(self.nodes), bool), np.zeros(len(self.nodes), bool)
        changes[node[changing]] = True
        moves[node[changing & ~self._stepped[curve]]] = True
        return changes & ~moves

    def values(self, path: str, which: Ints, at: Floats, before: bool) -> Floats:
        """Return a path's values (F, C) of nodes `which` (F,) at times `at` (F,); before: left limits."""
        if path == "rotation":
            return self._rotation(which, at, before)
        values = self._axes(path, which, at, before)
        if path == "translation" and self._has_pivots:
            return self._about_pivots(values, which, at, before)
        return values

    def travel(self, which: Ints, a: Floats, b: Floats) -> Floats:
        """Return bounds (B,) of the sums of all angles' variation of nodes `which` (B,) from times a to b (B,)."""
        found = np.zeros(len(which))
        for slot in self._slots["rotation"].tolist():
            curve = self._curve_of[which, slot]
            some = np.flatnonzero(curve >= 0)
            if len(some):
                found[some] = found[some] + self._curves.travel(curve[some], a[some], b[some])
        return found

    def _among(self, path: str) -> tuple[Ints, Ints]:
        """Nodes and indices of the curves that a path depends on, by node; with pivots a translation needs all."""
        every = path == "translation" and self._has_pivots
        table = self._curve_of if every else self._curve_of[:, self._slots[path]]
        node, slot = np.nonzero(table >= 0)
        return node, table[node, slot]

    def _axes(self, path: str, which: Ints, at: Floats, before: bool) -> Floats:
        found = self._resting[which[:, None], self._slots[path]]
        curve = self._curve_of[which[:, None], self._slots[path]]
        row, column = np.nonzero(curve >= 0)
        if len(row):
            found[row, column] = self._curves.evaluate(curve[row, column], at[row], before=before)
        return found

    def _rotation(self, which: Ints, at: Floats, before: bool) -> Floats:
        turn = euler.to_quaternion(self._axes("rotation", which, at, before), order=self._order, frame=self._frame)
        if not self._has_pivots:
            return turn
        after = quaternion.conjugate(self._pivot("post_rotation")[which])
        return quaternion.multiply(quaternion.multiply(self._pivot("pre_rotation")[which], turn), after)

    def _about_pivots(self, moved: Floats, which: Ints, at: Floats, before: bool) -> Floats:
        arm = self._pivot("scaling_offset") + self._pivot("scaling_pivot") - self._pivot("rotation_pivot")
        scaled = self._axes("scale", which, at, before) * self._pivot("scaling_pivot")[which]
        swung = quaternion.rotate(self._rotation(which, at, before), arm[which] - scaled)
        return moved + self._pivot("rotation_offset")[which] + self._pivot("rotation_pivot")[which] + swung

    def _pivot(self, name: str) -> Floats:
        return np.array([getattr(node.pivots, name) for node in self.nodes])

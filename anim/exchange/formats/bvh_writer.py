"""EulerMotion → the text of a BVH."""

from __future__ import annotations

import io
from collections.abc import Iterator
from functools import cache

import numpy as np

from anim.arrays import Floats, group_indices
from anim.errors import UnsupportedError
from anim.exchange.euler.curve import Curve, evaluate
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode
from anim.maths.euler import AxesConvention
from anim.model import TimeAxis

MAX_INDENT = 64  # tabs: with one per joint the size of a long chain is quadratic
INDENTS = ["\t" * depth for depth in range(MAX_INDENT + 1)]
DECIMALS = 6  # decimals of degrees and of the file's unit of length


class _Columns:
    """Channels in order: curves, constants (M,) for those without one, and which are angles."""

    def __init__(self) -> None:
        self.curves: list[Curve | None] = []
        self.constants: list[float] = []
        self.is_angle: list[bool] = []

    def add(self, node: EulerNode) -> None:
        if _has_position(node):
            self.curves += map(node.moves.get, range(3))
            self.constants += node.translation.tolist()
            self.is_angle += [False] * 3
        self.curves += node.rotation
        self.constants += node.angles.tolist()
        self.is_angle += [True] * len(node.rotation)

    def rows(self, axis: TimeAxis) -> Floats:
        """Values (F, M) at the frames: metres of the file's unit, and degrees."""
        rows = np.tile(self.constants, (len(axis), 1))
        for i, curve in enumerate(self.curves):
            if curve is not None:  # on the axis of all, as is usual
                rows[:, i] = curve.values if curve.time_axis is axis else evaluate(curve, axis.times)
        return np.where(self.is_angle, np.degrees(rows), rows)


def write(motion: EulerMotion) -> bytes:
    """Return a BVH of the motion: degrees, positions that replace the OFFSET, unscaled lengths.

    Moving nodes have six channels, others three; each node has its own order. Frames are the even grid of the first
    curve's times. Raises UnsupportedError without a grid, or for a node with extrinsic or pivoted angles.
    """
    for node in motion.nodes:
        if node.frame is AxesConvention.EXTRINSIC or node.pivots is not NO_PIVOTS:
            raise UnsupportedError("a BVH has intrinsic angles and no pivots", where=f"node '{node.name}'")
    axis = _frame_times(motion)
    times = axis.times
    columns, data = _Columns(), io.BytesIO()
    # Encoded while it is written: of the whole there is one copy. A lone surrogate is valid in JSON names.
    text = io.TextIOWrapper(data, "utf-8", "backslashreplace", newline="\n")
    text.write("HIERARCHY\n")
    children = group_indices(node.parent for node in motion.nodes)
    offsets = list(_format_vectors(np.array([node.translation for node in motion.nodes])))
    waiting: list[tuple[int, int]] = [(root, 0) for root in reversed(children.get(-1, []))]
    while waiting:  # iterative: a rope may have more joints in sequence than Python's recursion limit
        number, depth = waiting.pop()
        tabs = INDENTS[min(depth, MAX_INDENT)]
        if number < 0:
            text.write(f"{tabs}}}\n")
            continue
        node, below = motion.nodes[number], children.get(number, [])
        text.write(_open_joint(node, offsets[number], tabs, is_leaf=not below))
        if not node.end:
            columns.add(node)
            waiting.append((-1, depth))  # its end
            waiting += [(child, depth + 1) for child in reversed(below)]
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1 / 30
    text.write(f"MOTION\nFrames: {len(times)}\n" + f"Frame Time: {step:.9f}".rstrip("0") + "\n")
    rows = np.round(columns.rows(axis), DECIMALS) + 0.0
    pattern = " ".join([f"%.{DECIMALS}f"] * rows.shape[1]) + "\n"
    for row in rows:
        text.write(pattern % tuple(row.tolist()))
    text.flush()
    return data.getvalue()


def _frame_times(motion: EulerMotion) -> TimeAxis:
    curves = [c for node in motion.nodes for c in (*node.rotation, *node.moves.values()) if c is not None]
    if not curves:
        raise UnsupportedError("nothing moves: a BVH needs frames")
    axis = max((curve.time_axis for curve in curves), key=lambda each: len(each.times))
    steps = np.diff(axis.times)
    if len(steps) and np.ptp(steps) > 1e-3 * steps.mean():
        raise UnsupportedError("keys are not evenly spaced, as a BVH requires", help="choose a frame rate with `fps`")
    return axis


def _open_joint(node: EulerNode, offset: str, tab: str, *, is_leaf: bool) -> str:
    """The lines of a node before its children; complete for an End Site and for a joint without children."""
    if node.end:
        return f"{tab}End Site\n{tab}{{\n{tab}\tOFFSET {offset}\n{tab}}}\n"
    channels = _channels(node.order, _has_position(node))
    kind = "JOINT" if node.parent >= 0 else "ROOT"
    lines = f"{tab}{kind} {node.name}\n{tab}{{\n{tab}\tOFFSET {offset}\n{tab}\t{channels}\n"
    return lines + f"{tab}\tEnd Site\n{tab}\t{{\n{tab}\t\tOFFSET 0 0 0\n{tab}\t}}\n" if is_leaf else lines


@cache
def _channels(order: str, has_position: bool) -> str:
    names = [f"{axis}position" for axis in "XYZ"] if has_position else []
    names += [f"{axis}rotation" for axis in order]
    return f"CHANNELS {len(names)} {' '.join(names)}"


def _has_position(node: EulerNode) -> bool:
    return bool(node.moves) or node.parent < 0


def _format_vectors(vectors: Floats) -> Iterator[str]:
    """Yield the text of each vector (N, 3)."""
    for vector in (np.round(vectors, DECIMALS) + 0.0).tolist():
        yield " ".join([str(int(x)) if x == int(x) else f"{x:.{DECIMALS}f}" for x in vector])

"""EulerMotion → the text of a BVH."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.errors import UnsupportedError
from anim.exchange.euler.curve import Curve, evaluate
from anim.exchange.euler.motion import NO_PIVOTS, EulerMotion, EulerNode
from anim.maths.euler import AxesConvention
from anim.model import TimeAxis

MAX_INDENT = 64  # tabs: with one per joint the size of a long chain is quadratic
DECIMALS = 6  # decimals of degrees and of the file's unit of length


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
    lines = ["HIERARCHY"]
    children: dict[int, list[int]] = {}
    for number, node in enumerate(motion.nodes):
        children.setdefault(node.parent, []).append(number)
    columns: list[Floats] = []
    waiting: list[tuple[int, int] | str] = [(root, 0) for root in reversed(children.get(-1, []))]
    while waiting:  # iterative: a rope may have more joints in sequence than Python's recursion limit
        item = waiting.pop()
        if isinstance(item, str):
            lines.append(item)
            continue
        number, depth = item
        node, below = motion.nodes[number], children.get(number, [])
        lines += _open_joint(node, depth, is_leaf=not below)
        if not node.end:
            columns += _columns(node, axis, _has_position(node))
            waiting.append("\t" * min(depth, MAX_INDENT) + "}")
            waiting += [(child, depth + 1) for child in reversed(below)]
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1 / 30
    lines += ["MOTION", f"Frames: {len(times)}", f"Frame Time: {step:.9f}".rstrip("0")]
    rows = np.round(np.stack(columns, axis=-1), DECIMALS) + 0.0
    pattern = " ".join([f"%.{DECIMALS}f"] * rows.shape[1])
    lines += [pattern % tuple(row) for row in rows.tolist()]
    return ("\n".join(lines) + "\n").encode(errors="backslashreplace")  # a lone surrogate, valid in JSON names


def _frame_times(motion: EulerMotion) -> TimeAxis:
    curves = [c for node in motion.nodes for c in (*node.rotation, *node.moves.values()) if c is not None]
    if not curves:
        raise UnsupportedError("nothing moves: a BVH needs frames")
    axis = max((curve.time_axis for curve in curves), key=lambda each: len(each.times))
    steps = np.diff(axis.times)
    if len(steps) and np.ptp(steps) > 1e-3 * steps.mean():
        raise UnsupportedError("keys are not evenly spaced, as a BVH requires", help="choose a frame rate with `fps`")
    return axis


def _open_joint(node: EulerNode, depth: int, *, is_leaf: bool) -> list[str]:
    """The lines of a node before its children; complete for an End Site and for a joint without children."""
    tab = "\t" * min(depth, MAX_INDENT)
    offset = f"OFFSET {_format_vector(node.translation)}"
    if node.end:
        return [f"{tab}End Site", f"{tab}{{", f"{tab}\t{offset}", f"{tab}}}"]
    positions = [f"{axis}position" for axis in "XYZ"] if _has_position(node) else []
    names = positions + [f"{axis}rotation" for axis in node.order]
    lines = [f"{tab}{'JOINT' if depth else 'ROOT'} {node.name}", f"{tab}{{", f"{tab}\t{offset}"]
    lines.append(f"{tab}\tCHANNELS {len(names)} {' '.join(names)}")
    end = [f"{tab}\tEnd Site", f"{tab}\t{{", f"{tab}\t\tOFFSET 0 0 0", f"{tab}\t}}"]
    return lines + end if is_leaf else lines


def _has_position(node: EulerNode) -> bool:
    return bool(node.moves) or node.parent < 0


def _columns(node: EulerNode, axis: TimeAxis, with_position: bool) -> list[Floats]:
    columns = []
    for i in range(3) if with_position else ():
        columns.append(_at_frames(node.moves.get(i), node.translation[i], axis))
    for angle, turn in zip(node.angles.tolist(), node.rotation, strict=True):
        columns.append(np.degrees(_at_frames(turn, angle, axis)))
    return columns


def _at_frames(curve: Curve | None, constant: float, axis: TimeAxis) -> Floats:
    """Values (F,) of a curve at the frames; its own ones on the axis of all, as is usual."""
    if curve is None:
        return np.full(len(axis.times), constant)
    return curve.values if curve.time_axis is axis else evaluate(curve, axis.times)


def _format_vector(vector: Floats) -> str:
    rounded = (np.round(vector, DECIMALS) + 0.0).tolist()
    return " ".join(str(int(x)) if x == int(x) else f"{x:.{DECIMALS}f}" for x in rounded)

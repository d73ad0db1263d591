"""Keys of many short nodes in one pass per convention and path: `from_euler` of thousands of nodes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, freeze
from anim.curves.fitting.stacked_keys import MAX_KEYS, MotionStack, StackedKeys, fit_linear_keys
from anim.exchange.euler.baked_keys import curves_of
from anim.exchange.euler.motion import NO_PIVOTS, EulerNode
from anim.exchange.euler.node_stack import PATHS, NodeStack
from anim.maths import quaternion
from anim.maths.euler import AxesConvention
from anim.model import Interpolation

MAX_NODE_KEYS = 2048  # of all curves; nodes with more take as long alone
BLOCK_KEYS = 1 << 14  # of nodes converted together, if they have several


class NodeKeys(NamedTuple):
    """Keys of one path of a node: times (K,) s, values (K, C)."""

    interpolation: Interpolation
    times: Floats
    values: Floats


def divide_nodes(nodes: Sequence[EulerNode]) -> Iterator[range]:
    """Yield ranges of nodes to convert together, so that memory is that of one block."""
    first, keys = 0, 0
    for number, node in enumerate(nodes):
        keys += _num_keys(node)
        if keys > BLOCK_KEYS:
            yield range(first, number + 1)
            first, keys = number + 1, 0
    yield range(first, len(nodes))


def fit_nodes(
    nodes: Mapping[int, EulerNode],
    tolerance: float,
    units: Mapping[str, float],
    *,
    sampled: Collection[int] = (),
    limit: int = MAX_KEYS,
) -> dict[tuple[int, str], NodeKeys]:
    """Return keys by node and path; nodes and paths that take as long alone are omitted.

    tolerance: rad. units: of the tolerance by path: metres and factors per radian. sampled: nodes without added keys.
    limit: of keys, above which a path is omitted too.
    """
    groups: dict[tuple[str, AxesConvention, bool], list[int]] = {}
    for number, node in nodes.items():
        if 0 < _num_keys(node) <= MAX_NODE_KEYS:
            groups.setdefault((node.order, node.frame, node.pivots is NO_PIVOTS), []).append(number)
    found: dict[tuple[int, str], NodeKeys] = {}
    for numbers in groups.values():
        stack = NodeStack([nodes[number] for number in numbers])
        for path in PATHS:
            at_keys = np.array([number in sampled for number in numbers])
            for i, keys in _path_keys(stack, path, at_keys, tolerance * units[path], limit):
                found[numbers[i], path] = keys
    return found


def _path_keys(
    stack: NodeStack, path: str, sampled: Bools, tolerance: float, limit: int
) -> Iterator[tuple[int, NodeKeys]]:
    """Yield the keys of one path by index of the node; sampled: (M,) True for nodes without added keys."""
    node, knots = stack.knots(path)
    stepped = stack.is_stepped(path)
    at_knots = (sampled | stepped)[node]
    if at_knots.any():
        part, times = node[at_knots], knots[at_knots]
        values = stack.values(path, part, times, False)
        values = quaternion.align_signs(values, part) if path == "rotation" else values
        yield from _by_node(StackedKeys(part, times, values), stepped)
    if not at_knots.all():
        motions = MotionStack(
            lambda which, at, before: stack.values(path, which, at, before),
            rotation=path == "rotation",
            travel=stack.travel if path == "rotation" else None,
        )
        keys = fit_linear_keys(motions, node[~at_knots], knots[~at_knots], tolerance=tolerance, most=limit)
        yield from _by_node(keys, stepped)


def _by_node(keys: StackedKeys, stepped: Bools) -> Iterator[tuple[int, NodeKeys]]:
    values = freeze(keys.values)
    bounds = np.flatnonzero(np.diff(keys.motion, prepend=-1, append=-1))  # of nodes
    starts, ends = bounds[:-1], bounds[1:]
    for node, start, end in zip(keys.motion[starts].tolist(), starts.tolist(), ends.tolist(), strict=True):
        mode = Interpolation.STEP if stepped[node] else Interpolation.LINEAR
        yield node, NodeKeys(mode, keys.times[start:end], values[start:end])


def _num_keys(node: EulerNode) -> int:
    return sum(len(curve.values) for curve in curves_of(node))

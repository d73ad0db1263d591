"""Trees of nodes: subtrees, and products along the paths from the roots.

Products take one step per level, or few steps for deep and thin trees.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeVar

import numpy as np

from anim.arrays import Bools, Floats, Ints

MIN_DEPTH = 256  # levels of a tree that is divided: with fewer a step per level is faster
MAX_WIDTH = 16  # nodes per level, on average, of such a tree

Number = TypeVar("Number", int, float)
Compose = Callable[[Floats, Floats], Floats]


def accumulate(
    local: Floats, parents: Ints, levels: Sequence[Ints], compose: Compose, *, out: Floats | None = None
) -> Floats:
    """Return the products (N, ...) of the values on the path from the root to each node.

    local: (N, ...). parents: (N,), −1 for roots. levels: node indices by depth, roots first. compose: associative,
    of the parents' products (M, ...) and the nodes' own values (M, ...). out: array for the result, which may be
    `local` itself.
    accumulate([2, 3, 5], [-1, 0, 1], [[0], [1], [2]], np.multiply) → [2, 6, 30]
    """
    found = np.empty(local.shape) if out is None else out
    (_by_section if is_deep(levels) else _by_level)(local, parents, levels, compose, found)
    return found


def is_deep(levels: Sequence[Ints]) -> bool:
    """Return whether a tree is deep and thin, so that a step per level would take long for its number of nodes."""
    return len(levels) >= MIN_DEPTH and sum(map(len, levels)) <= MAX_WIDTH * len(levels)


def filter_levels(levels: Sequence[Ints], chosen: Bools) -> tuple[Ints, ...]:
    """Return of each level only the nodes in a mask (N,), as views of one array; a level may become empty."""
    if not levels:
        return ()
    order = np.concatenate(levels)
    kept = chosen[order]
    ends = np.cumsum(kept)[np.cumsum(np.fromiter(map(len, levels), np.int64, len(levels))) - 1].tolist()
    nodes = order[kept]
    return tuple(nodes[start:end] for start, end in pairwise([0, *ends]))


def find_subtrees(parents: Ints) -> tuple[Ints, Ints]:
    """Return the first position (N,) of each node's subtree in depth-first order, and the one after its last.

    Node j is below node i if first[i] < first[j] < end[i]. parents: (N,), −1 for roots.
    find_subtrees([-1, 0]) → [0, 1], [2, 2]
    """
    order = _depth_first(parents)
    first = np.empty(len(parents), np.int64)
    first[order] = np.arange(len(order))
    return first, first + np.array(_sum_up(order, parents, [1] * len(order)), np.int64)


def is_below(subtrees: tuple[Ints, Ints], node: int, other: int) -> bool:
    """Return whether a node is below another one. subtrees: as of `find_subtrees`."""
    first, end = subtrees
    return bool(first[other] < first[node] < end[other])


def find_depths(parents: Ints) -> Ints:
    """Return the number (N,) of nodes above each node. parents: (N,), −1 for roots.

    In steps as of `with_descendants`.
    """
    found, above = (parents >= 0).astype(np.int64), parents.copy()
    while len(some := np.flatnonzero(above >= 0)):
        found[some] += found[above[some]]
        above[some] = above[above[some]]
    return found


def subtree_sums(parents: Ints, values: Floats) -> Floats:
    """Return the sum (N,) of each node's value and those of all nodes below it. parents: (N,), −1 for roots."""
    return np.array(_sum_up(_depth_first(parents), parents, values.tolist()), np.float64)


def _sum_up(order: list[int], parents: Ints, values: list[Number]) -> list[Number]:
    """The sums of each node's value and those below it. order: all nodes, parents before those below them."""
    total, above = values.copy(), parents.tolist()
    for node in reversed(order):
        if above[node] >= 0:
            total[above[node]] += total[node]
    return total


def with_descendants(parents: Ints, chosen: Bools) -> Bools:
    """Return the mask (N,) of some nodes and of all below them. parents: (N,), −1 for roots.

    Each step looks twice as far up, so that a chain of N nodes takes log2(N) steps.
    """
    found, above = chosen.copy(), parents.copy()
    while len(some := np.flatnonzero(above >= 0)):
        found[some] |= found[above[some]]
        above[some] = above[above[some]]
    return found


def with_ancestors(parents: Ints, chosen: Bools) -> Bools:
    """Return the mask (N,) of some nodes and of all above them. parents: (N,), −1 for roots.

    In steps as of `with_descendants`.
    """
    found, above = chosen.copy(), parents
    while len(some := above[found & (above >= 0)]):
        found[some] = True
        above = np.where(above >= 0, above[above], -1)
    return found


def _by_level(local: Floats, parents: Ints, levels: Sequence[Ints], compose: Compose, found: Floats) -> None:
    for depth, nodes in enumerate(levels):
        at = slice(int(nodes[0]), int(nodes[-1]) + 1) if _are_neighbors(nodes) else nodes  # a slice copies nothing
        if depth:
            above = parents[nodes]
            found[at] = compose(found[above[0] : above[0] + 1] if len(above) == 1 else found[above], local[at])
        elif found is not local:
            found[at] = local[at]


def _by_section(local: Floats, parents: Ints, levels: Sequence[Ints], compose: Compose, found: Floats) -> None:
    """Products of D levels in 2 √D steps: first in all sections of √D levels at once, then of one after the other."""
    height, order = math.isqrt(len(levels)), np.concatenate(levels)
    sizes = np.fromiter(map(len, levels), np.int64, len(levels))
    step = np.repeat(np.arange(len(levels)) % height, sizes)  # of each node: its level in its section
    by_step = np.split(order[np.argsort(step, kind="stable")], np.cumsum(np.bincount(step))[:-1])
    sections = np.split(order, np.cumsum(sizes)[height - 1 : -1 : height])
    if found is not local:
        found[:] = local
    above = parents.copy()  # of each node: the parent of its section's first node above it
    for nodes in by_step[1:]:
        found[nodes] = compose(found[parents[nodes]], local[nodes])
        above[nodes] = above[parents[nodes]]
    for nodes in sections[1:]:
        found[nodes] = compose(found[above[nodes]], found[nodes])


def _are_neighbors(nodes: Ints) -> bool:
    """Return whether nodes (M,) follow each other in steps of one; not without any."""
    if not len(nodes) or int(nodes[-1]) - int(nodes[0]) != len(nodes) - 1:
        return False
    return bool((nodes[1:] - nodes[:-1] == 1).all())


def _depth_first(parents: Ints) -> list[int]:
    """All nodes, parents before those below them."""
    first_child = [-1] * (len(parents) + 1)  # the last is the first root
    next_sibling = [-1] * len(parents)
    above = parents.tolist()
    for node in reversed(range(len(above))):
        next_sibling[node] = first_child[above[node]]
        first_child[above[node]] = node
    order, waiting = [], [first_child[-1]]
    while waiting:
        node = waiting.pop()
        while node >= 0:
            order.append(node)
            waiting.append(next_sibling[node])
            node = first_child[node]
    return order

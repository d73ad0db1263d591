"""Products along the paths from the roots of trees: one step per level, or few steps for deep and thin trees."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from anim.arrays import Floats, Ints

MIN_DEPTH = 256  # levels of a tree that is divided: with fewer a step per level is faster
MAX_WIDTH = 16  # nodes per level, on average, of such a tree

Compose = Callable[[Floats, Floats], Floats]


def accumulate(local: Floats, parents: Ints, levels: Sequence[Ints], compose: Compose) -> Floats:
    """Return the products (N, ...) of the values on the path from the root to each node.

    local: (N, ...). parents: (N,), −1 for roots. levels: node indices by depth, roots first. compose: associative,
    of the parents' products (M, ...) and the nodes' own values (M, ...).
    accumulate([2, 3, 5], [-1, 0, 1], [[0], [1], [2]], np.multiply) → [2, 6, 30]
    """
    if len(levels) < MIN_DEPTH or len(parents) > MAX_WIDTH * len(levels):
        return _by_level(local, parents, levels, compose)
    return _by_section(local, parents, levels, compose)


def _by_level(local: Floats, parents: Ints, levels: Sequence[Ints], compose: Compose) -> Floats:
    found = np.empty(local.shape)
    for depth, nodes in enumerate(levels):
        at = _index(nodes)
        found[at] = compose(found[_index(parents[nodes])], local[at]) if depth else local[at]
    return found


def _by_section(local: Floats, parents: Ints, levels: Sequence[Ints], compose: Compose) -> Floats:
    """Products of D levels in 2 √D steps: first in all sections of √D levels at once, then of one after the other."""
    height = math.isqrt(len(levels))
    sections = [levels[i : i + height] for i in range(0, len(levels), height)]
    found = local.copy()
    above = parents.copy()  # of each node: the parent of its section's first node above it
    for step in range(1, height):
        nodes = np.concatenate([section[step] for section in sections if step < len(section)])
        found[nodes] = compose(found[parents[nodes]], local[nodes])
        above[nodes] = above[parents[nodes]]
    for section in sections[1:]:
        nodes = np.concatenate(section)
        found[nodes] = compose(found[above[nodes]], found[nodes])
    return found


def _index(nodes: Ints) -> Ints | slice:
    """The nodes as an index; a single one as a slice, which copies nothing."""
    return nodes if len(nodes) != 1 else slice(int(nodes[0]), int(nodes[0]) + 1)

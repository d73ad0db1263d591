"""Skeleton: node hierarchy of a file in its rest pose."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from anim import arrays
from anim.arrays import AnyArray, Bools, Floats, Ints
from anim.errors import FormatError, ShapeError
from anim.maths import hierarchy
from anim.model.morphed_node import MorphedNode


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """All nodes by index in the file; joints of skins are a subset.

    names: (N,) as in the file, empty for a node without a name.
    parents: (N,) index of the parent, −1 for a root; acyclic.
    translation (N, 3) m, rotation (N, 4) unit xyzw, scale (N, 3): the rest pose, in the parent's space.
    sheared: (X,) indices of nodes with a `matrix` that has no translation, rotation, scale (sheared, singular or
    projective); they can't be animated.
    sheared_local: (X, 3, 4) local matrices of those.
    morphed: the nodes with morph targets, for pointers to their weights.
    Skeletons compare by identity.
    """

    names: tuple[str, ...]
    parents: Ints
    translation: Floats
    rotation: Floats
    scale: Floats
    sheared: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    sheared_local: Floats = field(default_factory=lambda: np.empty((0, 3, 4)))
    morphed: tuple[MorphedNode, ...] = ()
    _levels: Any = field(init=False, repr=False)  # tuple of (M,) for each depth
    _derived: Any = field(init=False, repr=False)  # arrays by the function that computed them

    def __reduce__(self) -> tuple[Any, ...]:
        restore, (kind, values) = arrays.reduce_fields(self)
        return restore, (kind, [*values[:-1], {}])

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "parents", arrays.own(np.asarray(self.parents, dtype=np.int64)))
        arrays.check_shape(self.parents, "N", name="parents")
        for name, shape in (("translation", "N 3"), ("rotation", "N 4"), ("scale", "N 3")):
            array = arrays.as_floats(getattr(self, name), shape, name=name)
            if len(array) != len(self.names) or len(self.parents) != len(self.names):
                raise ShapeError(f"{name} has {len(array)} rows for {len(self.names)} names")
            set_field(self, name, array)
        set_field(self, "sheared", arrays.own(np.asarray(self.sheared, dtype=np.int64)))
        arrays.check_shape(self.sheared, "X", name="sheared")
        set_field(self, "sheared_local", arrays.as_floats(self.sheared_local, "X 3 4", name="sheared_local"))
        if len(self.sheared_local) != len(self.sheared):
            raise ShapeError(f"sheared_local has {len(self.sheared_local)} matrices for {len(self.sheared)} nodes")
        set_field(self, "_levels", _find_levels(self.parents))
        set_field(self, "_derived", {})

    def __repr__(self) -> str:
        roots = np.flatnonzero(self.parents < 0)
        return f"Skeleton(nodes={len(self)}, roots={len(roots)}, first={self.names[roots[0]] if len(roots) else ''!r})"

    def __len__(self) -> int:
        return len(self.names)

    def label(self, node: int) -> str:
        """Return the name of a node for messages: "node 7 'hip'"."""
        return f"node {node} '{self.names[node]}'" if self.names[node] else f"node {node}"

    def display_name(self, node: int) -> str:
        """Return the name of a node for reports: its own, or "node 7"."""
        return self.names[node] or f"node {node}"

    def descendants(self, node: int) -> Bools:
        """Return a mask (N,) of `node` and its descendants."""
        found = np.zeros(len(self.parents), np.bool_)
        found[node] = True
        return hierarchy.with_descendants(self.parents, found)

    def derive(self, compute: Callable[[Skeleton], AnyArray]) -> AnyArray:
        """Return the array that a function computes from this skeleton, read-only: computed once, kept here.

        compute: a function of a module; one that is made for the call would be kept, and never found again.
        """
        if compute not in self._derived:
            self._derived[compute] = arrays.own(compute(self))
        found: AnyArray = self._derived[compute]
        return found

    def subtrees(self) -> tuple[Ints, Ints]:
        """Return the range (N,), (N,) of each node's subtree in depth-first order, as `hierarchy.find_subtrees`."""
        first, end = self.derive(_find_subtrees)
        return first, end

    def levels(self) -> list[Ints]:
        """Return the nodes by depth, roots first, so that parents precede their children."""
        return list(self._levels)


def ancestors(parents: Sequence[int] | Ints, node: int) -> Iterator[int]:
    """Yield the nodes above a node, the nearest first; none of −1. parents: (N,), −1 for roots."""
    while node >= 0 and (node := int(parents[node])) >= 0:
        yield node


def node_mask(skeleton: Skeleton, nodes: Iterable[int | None]) -> Bools:
    """Return the mask (N,) of some nodes; None is left out."""
    found = np.zeros(len(skeleton), np.bool_)
    found[[node for node in nodes if node is not None]] = True
    return found


def nearest_ancestors(parents: Ints, chosen: Bools) -> Ints:
    """Return for every node (N,) the nearest one above it among those of a mask (N,), −1 for none.

    parents: (N,), −1 for roots. Each step looks twice as far up, so that a chain of N nodes takes log2(N) steps.
    """
    found = parents.copy()
    while len(some := np.flatnonzero((found >= 0) & ~chosen[found])):
        found[some] = found[found[some]]
    return found


def nearest_at_or_above(parents: Ints, chosen: Bools) -> Ints:
    """Return for every node (N,) itself if it is among those of a mask (N,), else the nearest one above it, or −1."""
    return np.where(chosen, np.arange(len(parents)), nearest_ancestors(parents, chosen))


def _find_subtrees(skeleton: Skeleton) -> AnyArray:
    return np.stack(hierarchy.find_subtrees(skeleton.parents))


def _find_levels(parents: Ints) -> tuple[Ints, ...]:
    """The nodes of each depth; raises FormatError for a cycle or a parent that does not exist.

    Views of one array: a chain has as many levels as nodes.
    """
    if len(parents) and (parents.min() < -1 or parents.max() >= len(parents)):
        raise FormatError("a node's parent does not exist")
    by_parent = np.argsort(parents, kind="stable")
    ends = np.cumsum(np.bincount(parents + 1, minlength=len(parents) + 1)).tolist()  # of children, after the roots
    children, order = by_parent.tolist(), by_parent[: ends[0]].tolist()
    for node in order:  # grows during the loop
        order += children[ends[node] : ends[node + 1]]
    if len(order) != len(parents):
        raise FormatError("nodes form a cycle (expected trees)")
    found = arrays.freeze(np.array(order, np.int64))
    sizes = np.bincount(hierarchy.find_depths(parents))
    return tuple(found[start:end] for start, end in pairwise([0, *np.cumsum(sizes).tolist()]))

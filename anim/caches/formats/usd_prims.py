"""Memory of the prims that a USD layer composes from its references to itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from anim.errors import UnsupportedError

# Measured with usd-core 25, where 1 GB of these bytes is composed in 5 to 15 s, of which 0.1 to 0.6 GB are in memory.
PRIM_BYTES = 1000  # 0.5 kB and 9 µs
FURTHER_SPEC_BYTES = 100  # of each spec of a prim after the first
ARC_BYTES = 4000  # 0.8 kB and 25 µs, for a graph of the prim's own
NESTED_ARC_BYTES = 500  # of each arc and one of a prim above it, which is in the graph too: 50 B and 1 to 8 µs
ARCS = ("references", "payload", "inheritPaths", "specializes")


def has_arcs(spec: Any) -> bool:
    """Return whether a spec refers to others."""
    return any(map(spec.HasInfo, ARCS))


def check_size(layer: Any, paths: Sequence[Any], limit_bytes: int) -> None:
    """Raise UnsupportedError if prims that one layer composes beyond its own ones take more memory than the limit.

    A prim that refers to another of the same file has copies of all prims below it: 20 lines with two references each
    make a million. paths: of the specs with arcs. Variants are not counted: for them the limit of allocations holds.
    """
    num_prims, num_bytes = _Counter(layer, limit_bytes).count(_topmost(paths))
    if num_bytes > limit_bytes:
        raise UnsupportedError(
            f"composes {num_prims} prims or more by its references to itself, which would take "
            f"{num_bytes / 1e9:.3g} GB (limit {limit_bytes / 1e9:.3g} GB)",
            help="raise `memory_limit`, or split the file",
        )


class _Composed(NamedTuple):
    """Counts and bytes of a prim and all below it."""

    num_prims: int = 0
    num_arcs: int = 0
    num_bytes: int = 0


class _Prim(NamedTuple):
    """Set of specs that are composed into one prim. children: paths of the specs of each prim below it."""

    paths: frozenset[Any]
    num_arcs: int
    children: list[tuple[Any, ...]]

    @property
    def num_bytes(self) -> int:
        return PRIM_BYTES + FURTHER_SPEC_BYTES * (len(self.paths) - 1) + ARC_BYTES * self.num_arcs

    def compose(self, below: list[_Composed]) -> _Composed:
        """Return the sums of this prim and of those below it."""
        arcs = sum(each.num_arcs for each in below)
        nested_bytes = NESTED_ARC_BYTES * self.num_arcs * arcs
        return _Composed(
            1 + sum(each.num_prims for each in below),
            self.num_arcs + arcs,
            self.num_bytes + nested_bytes + sum(each.num_bytes for each in below),
        )


class _Counter:
    """Prims of a stage. Each set of specs is counted once, and without recursion: prims may be nested deeply."""

    def __init__(self, layer: Any, limit_bytes: int) -> None:
        self._layer, self._limit_bytes = layer, limit_bytes
        self._prims: dict[tuple[Any, ...], _Prim] = {}  # many references to one prim ask for the same below it
        self._below: dict[frozenset[Any], list[frozenset[Any]]] = {}
        self._totals: dict[frozenset[Any], _Composed] = {}
        self._num_bytes = 0  # of all sets, each once

    def count(self, paths: Sequence[Any]) -> tuple[int, int]:
        """Return the number of prims at the paths and below, and their bytes without those of the layer's own prims.

        Both are the least possible if the sets alone take more than the limit: counting ends there.
        """
        own = PRIM_BYTES * sum(map(self._num_specs, paths))
        found = [self._compose((path,), self._limit_bytes + own) for path in paths]
        num_prims = max(sum(each.num_prims for each in found), len(self._below))
        return num_prims, max(sum(each.num_bytes for each in found), self._num_bytes) - own

    def _num_specs(self, path: Any) -> int:
        """Number of the layer's own prims at a path and below."""
        found: list[Any] = []
        self._layer.Traverse(path, found.append)
        return sum(each.IsPrimPath() and not each.ContainsPrimVariantSelection() for each in found)

    def _compose(self, paths: tuple[Any, ...], limit_bytes: int) -> _Composed:
        top = self._prim(paths)
        waiting = [top]
        while waiting and self._num_bytes <= limit_bytes:
            prim = waiting[-1]
            if prim.paths in self._below:
                waiting.pop()
                below = self._below[prim.paths]  # without a total if it is a circle, which usd-core leaves out
                self._totals[prim.paths] = prim.compose([self._totals.get(each, _Composed()) for each in below])
                continue
            self._num_bytes += prim.num_bytes
            children = [self._prim(each) for each in prim.children]
            self._below[prim.paths] = [each.paths for each in children]
            waiting += [each for each in children if each.paths not in self._below]
        return self._totals.get(top.paths, _Composed())

    def _prim(self, paths: tuple[Any, ...]) -> _Prim:
        if paths not in self._prims:
            self._prims[paths] = self._find(paths)
        return self._prims[paths]

    def _find(self, paths: tuple[Any, ...]) -> _Prim:
        """The prim of the specs at the paths, and at all that they refer to."""
        found: dict[Any, Any] = {}
        waiting, num_arcs = list(paths), 0
        while waiting:
            spec = self._layer.GetPrimAtPath(waiting.pop())
            if spec is not None and spec.path not in found:
                found[spec.path] = spec
                targets = list(self._targets(spec))
                num_arcs += len(targets)
                waiting += targets
        below: dict[str, list[Any]] = {}
        for spec in found.values():
            for child in spec.nameChildren.values():
                below.setdefault(child.name, []).append(child.path)
        return _Prim(frozenset(found), num_arcs, [tuple(each) for each in below.values()])

    def _targets(self, spec: Any) -> Iterator[Any]:
        for name in ARCS:
            if not spec.HasInfo(name):
                continue
            for item in spec.GetInfo(name).GetAppliedItems():
                path = getattr(item, "primPath", item)  # of references and payloads; the others are paths
                yield path or f"/{self._layer.defaultPrim}"


def _topmost(paths: Sequence[Any]) -> list[Any]:
    """Those of the paths that are below no other: what is elsewhere in the layer is composed of itself alone."""
    outside = [path for path in paths if not path.ContainsPrimVariantSelection()]
    every = set(outside)
    return [path for path in outside if not every.intersection(path.GetParentPath().GetPrefixes())]

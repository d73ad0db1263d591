"""Number of prims that a USD layer composes from its references to itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from anim.errors import UnsupportedError

# Measured of 1e6 prims, each with two references above it: composed by usd-core 25, 8.8 GB in 400 s
PRIM_BYTES = 8000
MAX_DEPTH = 300  # of prims below each other; deeper ones are not counted
ARCS = ("references", "payload", "inheritPaths", "specializes")


def check_size(layer: Any, limit_bytes: int) -> None:
    """Raise UnsupportedError if the prims of the stage of one layer take more memory than the limit.

    A prim that refers to another of the same file has copies of all prims below it: 20 lines with two references each
    make a million. Variants are not counted: for them the limit of allocations holds.
    """
    most = limit_bytes // PRIM_BYTES
    number = _Counter(layer, most).count()
    if number > most:
        raise UnsupportedError(
            f"has {number} prims or more by its references to itself (limit {most} with {limit_bytes / 1e9:.3g} GB)",
            help="raise `memory_limit`, or split the file",
        )


class _Counter:
    """Prims below sets of specs that are composed into one prim, each set counted once."""

    def __init__(self, layer: Any, most: int) -> None:
        self._layer, self._most = layer, most
        self._counts: dict[frozenset[Any], int] = {}

    def count(self) -> int:
        """Return the number of prims of the stage, at least `most` + 1 if there are more sets than `most`."""
        return sum(self._count([spec.path], 0) for spec in self._layer.rootPrims)

    def _count(self, paths: list[Any], depth: int) -> int:
        sites = self._with_targets(paths)
        key = frozenset(sites)
        if key in self._counts or depth > MAX_DEPTH or len(self._counts) > self._most:
            return self._counts.get(key, 1)
        self._counts[key] = 0  # if it is met again below itself, a circle that usd-core refuses
        below: dict[str, list[Any]] = {}
        for spec in sites.values():
            for child in spec.nameChildren.values():
                below.setdefault(child.name, []).append(child.path)
        self._counts[key] = 1 + sum(self._count(children, depth + 1) for children in below.values())
        return self._counts[key]

    def _with_targets(self, paths: list[Any]) -> dict[Any, Any]:
        """Specs at the paths, and at all that they refer to, by path."""
        found: dict[Any, Any] = {}
        waiting = list(paths)
        while waiting:
            path = waiting.pop()
            spec = None if path in found else self._layer.GetPrimAtPath(path)
            if spec is not None:
                found[path] = spec
                waiting += self._targets(spec)
        return found

    def _targets(self, spec: Any) -> Iterator[Any]:
        for name in ARCS:
            if not spec.HasInfo(name):
                continue
            for item in spec.GetInfo(name).GetAppliedItems():
                path = getattr(item, "primPath", item)  # of references and payloads; the others are paths
                yield path or f"/{self._layer.defaultPrim}"

"""Prims whose place changes over time."""

from __future__ import annotations

from typing import Any


class VaryingPrims:
    """Answers for the prims of a stage, each of which is asked once for itself and all below it."""

    def __init__(self) -> None:
        self._known: dict[Any, bool] = {}

    def moves(self, prim: Any) -> bool:
        """Return True if the transform of a prim, or of one above it, has several time samples."""
        from pxr import UsdGeom

        line = []
        while prim.GetPath() not in self._known and not prim.IsPseudoRoot():
            line.append(prim)
            prim = prim.GetParent()
        found = self._known.get(prim.GetPath(), False)
        for each in reversed(line):
            found = found or bool(each.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(each).TransformMightBeTimeVarying())
            self._known[each.GetPath()] = found
        return found

"""usd-core as a judge: what its validators find, and where its own skinning has vertices."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from anim.arrays import Floats


def opened_stage(path: Path) -> Any:
    """Return the stage in a file."""
    from pxr import Usd

    return Usd.Stage.Open(str(path))


def findings(path: Path) -> list[str]:
    """Return the findings of all validators of usd-core."""
    from pxr import UsdValidation

    every = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(every).Validate(opened_stage(path))
    return [f"{each.GetName()}: {each.GetMessage()}" for each in found]


def skinned_stage(path: Path) -> Any:
    """Return a stage whose skins and blend shapes are replaced by points, by UsdSkel.BakeSkinning."""
    from pxr import UsdSkel

    stage = opened_stage(path)
    session = stage.GetSessionLayer()
    session.timeCodesPerSecond = stage.GetTimeCodesPerSecond()
    stage.SetEditTarget(session)
    for prim in [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]:
        assert UsdSkel.BakeSkinning(UsdSkel.Root(prim))
    return stage


def world_points(stage: Any, code: float) -> dict[str, Floats]:
    """Return the world-space points (V, 3) of all meshes of a stage by path, at a time code."""
    from pxr import UsdGeom

    found = {}
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            mesh = UsdGeom.Mesh(prim)
            matrix = np.array(mesh.ComputeLocalToWorldTransform(code))
            found[str(prim.GetPath())] = (
                np.array(mesh.GetPointsAttr().Get(code), float) @ matrix[:3, :3] + matrix[3, :3]
            )
    return found

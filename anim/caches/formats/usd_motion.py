"""Motion of a USD stage besides points: skeletons, blend shapes, instances and animated transforms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError, UnsupportedError

MIN_FPS = 24.0  # frames per second of transforms and joints: a rotation is not linear between its samples
MAX_FRAMES = 1_000_000  # of animated transforms and joints
MIN_GAP = 1e-9  # time codes between frames; less is one frame, computed in two ways
JOINT_ATTRIBUTES = ("translations", "rotations", "scales", "blendShapeWeights")


def meshes(stage: Any) -> list[Any]:
    """Meshes of the stage, with skinning and blend shapes as time samples of their points.

    The file stays unchanged: the edits are in the session layer. Raises UnsupportedError for a PointInstancer,
    FormatError for a skeleton that usd-core can't evaluate, and for motion of more than MAX_FRAMES.
    """
    from pxr import UsdGeom

    session = stage.GetSessionLayer()
    session.timeCodesPerSecond = stage.GetTimeCodesPerSecond()  # else its samples are scaled, and skins are out of time
    stage.SetEditTarget(session)
    _separate_instances(stage)
    _set_frames(stage)
    _bake_skeletons(stage)
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.PointInstancer):
            raise UnsupportedError(
                f"{prim.GetPath()} is a PointInstancer, whose copies are not read",
                help="make its copies real meshes where the file is written",
            )
    return [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]


def time_codes(stage: Any, meshes: Sequence[Any]) -> Floats:
    """Time codes (F,) of all points, and of animated transforms with at least 24 frames per second; 0 without any.

    stage: after `meshes`.
    """
    found = {code for mesh in meshes for code in mesh.GetPointsAttr().GetTimeSamples()}
    moved = {code for mesh in meshes for code in _transform_codes(mesh.GetPrim())}
    if moved:
        first, step = stage.GetStartTimeCode(), stage.GetTimeCodesPerSecond() / stage.GetFramesPerSecond()
        frames = np.arange(first, max(moved), step)
        found |= moved | set(frames[frames >= min(moved)].tolist())
    codes = np.array(sorted(found) or [0.0])
    return codes[np.diff(codes, prepend=-np.inf) > MIN_GAP]


def _set_frames(stage: Any) -> None:
    """Make the frames of the stage, at which usd-core bakes skeletons, cover all motion at 24 per second or more.

    A file may have no first and last frame, or others: then joints would move on straight lines between their samples.
    """
    moved = {code for prim in stage.Traverse() for code in (*_joint_codes(prim), *_own_transform_codes(prim))}
    if not moved:
        return
    rate = stage.GetTimeCodesPerSecond()
    step = min(1.0, rate / MIN_FPS)
    if max(moved) - min(moved) > MAX_FRAMES * step:
        raise FormatError(f"has transforms or joints animated from time code {min(moved):g} to {max(moved):g}")
    session = stage.GetSessionLayer()
    session.startTimeCode, session.endTimeCode = min(moved), max(moved)
    session.framesPerSecond = rate / step


def _separate_instances(stage: Any) -> None:
    """Give every instance its own prims: a traversal leaves out those of shared prototypes."""
    while instances := [prim for prim in stage.Traverse() if prim.IsInstance()]:
        for prim in instances:
            prim.SetInstanceable(False)


def _bake_skeletons(stage: Any) -> None:
    from pxr import UsdSkel

    for prim in [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]:
        if not UsdSkel.BakeSkinning(UsdSkel.Root(prim)):
            raise FormatError(f"{prim.GetPath()}: its skeleton can't be evaluated")


def _transform_codes(prim: Any) -> Iterator[float]:
    """Time samples of the animated transforms of a prim and those above it."""
    from pxr import UsdGeom

    while prim:
        yield from _own_transform_codes(prim)
        transform = UsdGeom.Xformable(prim)
        if transform and transform.GetResetXformStack():
            return
        prim = prim.GetParent()


def _own_transform_codes(prim: Any) -> Iterator[float]:
    from pxr import UsdGeom

    transform = UsdGeom.Xformable(prim)
    if transform:
        for operation in transform.GetOrderedXformOps():
            samples = operation.GetTimeSamples()
            yield from samples if len(samples) > 1 else ()


def _joint_codes(prim: Any) -> Iterator[float]:
    """Time samples of joints and weights of blend shapes, if the prim is their animation."""
    from pxr import UsdSkel

    if prim.IsA(UsdSkel.Animation):
        for name in JOINT_ATTRIBUTES:
            samples = prim.GetAttribute(name).GetTimeSamples()
            yield from samples if len(samples) > 1 else ()

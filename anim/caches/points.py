"""Points that are born and die → .npz or USD, for other programs.

A .npz has the arrays of `PointCache`: times (F,) float64 s, offsets (F + 1,) int64, and for the points of frame f,
rows offsets[f] … offsets[f + 1] of ids (M,) int64, positions (M, 3) m, velocities (M, 3) m/s, ages and lifetimes (M,)
s, float32; radius () m; meta, JSON. A stage has a UsdGeomPoints with ids, widths, velocities, and the primvars age and
lifetime, at every frame.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable

import numpy as np
from numpy.lib import format as npy

from anim.arrays import AnyArray
from anim.caches import temporary_files
from anim.caches.formats.npz import EPOCH
from anim.caches.formats.usd_stage import package
from anim.caches.storage import Memory, Outputs
from anim.model.point_cache import PointCache

SCHEMA = "points/1"
PRIM = "/particles"


def encode_points(points: PointCache, fps: float, ending: str) -> bytes:
    """Return the bytes of a file. ending: in POINT_FORMATS. Raises UnsupportedError without the package it needs."""
    outputs = Memory(f"points{ending}")
    POINT_FORMATS[ending](points, outputs, fps)
    return outputs.files[outputs.main]


def _write_npz(points: PointCache, outputs: Outputs, fps: float) -> None:
    arrays: dict[str, AnyArray] = {
        "times": points.times,
        "offsets": points.offsets.astype(np.int64),
        "ids": points.ids.astype(np.int64),
        "positions": points.positions.astype(np.float32),
        "velocities": points.velocities.astype(np.float32),
        "ages": points.ages.astype(np.float32),
        "lifetimes": points.lifetimes.astype(np.float32),
        "radius": np.array(points.size),
        "meta": np.array(json.dumps({"schema": SCHEMA, "up": "y", "fps": fps})),
    }
    with outputs.create(outputs.main) as file, zipfile.ZipFile(file, "w") as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy", EPOCH), "w", force_zip64=True) as member:
                npy.write_array(member, np.ascontiguousarray(array).reshape(array.shape), allow_pickle=False)


def _write_usd(points: PointCache, outputs: Outputs, fps: float) -> None:
    usd, geom, vt = package()
    from pxr import Sdf, Tf

    ending, failures = outputs.main[-5:], (Tf.ErrorException,)
    with temporary_files.temp_output(outputs, outputs.main, ending, failures=failures) as path:
        stage = usd.Stage.CreateNew(path)
        geom.SetStageUpAxis(stage, geom.Tokens.y)
        geom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetTimeCodesPerSecond(fps)
        stage.SetFramesPerSecond(fps)
        codes = np.round(points.times * fps, 9).tolist()
        stage.SetStartTimeCode(codes[0])
        stage.SetEndTimeCode(codes[-1])
        prim = geom.Points.Define(stage, PRIM)
        stage.SetDefaultPrim(prim.GetPrim())
        primvars = geom.PrimvarsAPI(prim)
        ages, lifetimes = (
            primvars.CreatePrimvar(name, Sdf.ValueTypeNames.FloatArray, geom.Tokens.vertex)
            for name in ("age", "lifetime")
        )
        attributes = (
            prim.CreatePointsAttr(),
            prim.CreateVelocitiesAttr(),
            prim.CreateIdsAttr(),
            prim.CreateWidthsAttr(),
            prim.CreateExtentAttr(),
        )
        prim.SetWidthsInterpolation(geom.Tokens.vertex)
        for i, code in enumerate(codes):
            rows = slice(points.offsets[i], points.offsets[i + 1])
            at = points.positions[rows].astype(np.float32)
            widths = np.full(len(at), 2 * points.size, np.float32)
            values = (
                vt.Vec3fArray.FromNumpy(at),
                vt.Vec3fArray.FromNumpy(points.velocities[rows].astype(np.float32)),
                vt.Int64Array.FromNumpy(points.ids[rows].astype(np.int64)),
                vt.FloatArray.FromNumpy(widths),
                vt.Vec3fArray.FromNumpy(_bounds(at, points.size)),
            )
            for attribute, value in zip(attributes, values, strict=True):
                attribute.Set(value, code)
            ages.Set(vt.FloatArray.FromNumpy(points.ages[rows].astype(np.float32)), code)
            lifetimes.Set(vt.FloatArray.FromNumpy(points.lifetimes[rows].astype(np.float32)), code)
        stage.GetRootLayer().Save()


def _bounds(at: AnyArray, size: float) -> AnyArray:
    if not len(at):
        return np.zeros((2, 3), np.float32)
    return np.stack([at.min(axis=0) - size, at.max(axis=0) + size]).astype(np.float32)


POINT_FORMATS: dict[str, Callable[[PointCache, Outputs, float], None]] = {
    ".npz": _write_npz,
    ".usdc": _write_usd,
    ".usda": _write_usd,
}

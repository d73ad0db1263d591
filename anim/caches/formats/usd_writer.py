"""VertexCache → .usdc/.usda: a mesh with time-sampled points, through usd-core (extra `usd`).

Stage: upAxis of the cache, metersPerUnit 1, timeCodesPerSecond the frame rate, start and end time code. Mesh: points,
extent and, if present, vertex normals and primvars:tangents (float4: xyz and handedness) at every frame; the rest mesh
is their default. It is saved chunk by chunk, a .usda as a temporary .usdc that is then exported as text, so only the
disk limits its length.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches import frame_blocks, rest_mesh, temporary_files
from anim.caches.formats.npz import about
from anim.caches.options import WriteOptions, WriteResult
from anim.caches.storage import Outputs
from anim.errors import UnsupportedError
from anim.model import VertexCache

DEFAULT_FPS = 24.0  # USD's own default
PRIM = "/mesh"
TANGENTS = "tangents"  # primvar name used by exporters from glTF
KEY = "gltf_anim"  # in the layer's custom data: the parts, as in an .npz
USUAL_FPS = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)  # frame rates tried, in this order


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions, *, ending: str) -> WriteResult:
    """Write a stage with one mesh losslessly, ".usdc" binary or ".usda" text.

    Raises UnsupportedError without usd-core.
    """
    usd, geom, vt = package()
    rate = _rate(cache.times)
    codes = np.round(cache.times * rate, 9).tolist()
    with temporary_files.temp_output(outputs, outputs.main, ending) as path:
        is_text = ending == ".usda"
        stage = usd.Stage.CreateNew(f"{path}.usdc" if is_text else path)
        geom.SetStageUpAxis(stage, geom.Tokens.z if cache.up == "z" else geom.Tokens.y)
        geom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetTimeCodesPerSecond(rate)
        stage.SetFramesPerSecond(rate)
        stage.SetStartTimeCode(codes[0])
        stage.SetEndTimeCode(codes[-1])
        layer = stage.GetRootLayer()
        layer.customLayerData = {KEY: json.dumps(about(cache))}
        mesh = _mesh(stage, cache, geom, vt)
        step = frame_blocks.per_chunk(cache.vertex_count)
        points, normals, extent = mesh.GetPointsAttr(), mesh.GetNormalsAttr(), mesh.GetExtentAttr()
        tangents = geom.PrimvarsAPI(mesh).GetPrimvar(TANGENTS).GetAttr()
        for chunk in cache.chunks():
            for i, positions in enumerate(chunk.positions):
                code = codes[chunk.first + i]
                points.Set(_vectors(vt, positions), code)
                extent.Set(_bounds(vt, positions), code)
                if chunk.normals is not None:
                    normals.Set(_vectors(vt, chunk.normals[i]), code)
                if chunk.tangents is not None and cache.handedness is not None:
                    tangents.Set(_signed(vt, chunk.tangents[i], cache.handedness), code)
                if (chunk.first + i + 1) % step == 0:
                    layer.Save()
        layer.Save()
        if is_text:
            layer.Export(path)
    return WriteResult()


def package() -> tuple[Any, Any, Any]:
    """Return usd-core's Usd, UsdGeom and Vt. Raises UnsupportedError if it is not installed."""
    try:
        from pxr import Usd, UsdGeom, Vt
    except ImportError:
        raise UnsupportedError("USD needs the package usd-core", help="pip install 'gltf-anim[usd]'") from None
    return Usd, UsdGeom, Vt


def _mesh(stage: Any, cache: VertexCache, geom: Any, vt: Any) -> Any:
    mesh = geom.Mesh.Define(stage, PRIM)
    stage.SetDefaultPrim(mesh.GetPrim())
    mesh.CreateSubdivisionSchemeAttr(geom.Tokens.none)
    mesh.CreateFaceVertexCountsAttr(vt.IntArray.FromNumpy(np.full(len(cache.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(vt.IntArray.FromNumpy(cache.faces.reshape(-1).astype(np.int32)))
    still = rest_mesh.positions(cache).astype(np.float32)
    mesh.CreatePointsAttr(_vectors(vt, still))
    mesh.CreateExtentAttr(_bounds(vt, still))
    if cache.has_normals:
        mesh.CreateNormalsAttr()
        mesh.SetNormalsInterpolation(geom.Tokens.vertex)
    if cache.has_tangents:
        from pxr import Sdf

        kind = Sdf.ValueTypeNames.Float4Array
        geom.PrimvarsAPI(mesh).CreatePrimvar(TANGENTS, kind, geom.Tokens.vertex)
    return mesh


def _vectors(vt: Any, rows: AnyArray) -> Any:
    return vt.Vec3fArray.FromNumpy(np.ascontiguousarray(rows, np.float32))


def _signed(vt: Any, rows: AnyArray, signs: Floats) -> Any:
    return vt.Vec4fArray.FromNumpy(np.concatenate((rows, signs[:, None]), axis=1).astype(np.float32))


def _bounds(vt: Any, rows: AnyArray) -> Any:
    return _vectors(vt, np.stack((rows.min(axis=0), rows.max(axis=0))) if len(rows) else np.zeros((2, 3)))


def _rate(times: Floats) -> float:
    """The first common rate with all times but the last on its frames, else 24: codes may be fractions."""
    for rate in USUAL_FPS:
        off = times[: max(len(times) - 1, 1)] * rate
        if np.abs(off - np.rint(off)).max() < 1e-3:
            return float(rate)
    return DEFAULT_FPS

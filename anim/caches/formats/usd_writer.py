"""VertexCache → .usdc/.usda/.usdz: a mesh with time-sampled points, through usd-core (extra `usd`).

Stage: upAxis of the cache, metersPerUnit 1, timeCodesPerSecond the frame rate, start and end time code. Mesh: points,
extent and, if present, vertex normals and primvars:tangents (float4: xyz and handedness) at every frame; the rest mesh
is their default. With a source: its texture coordinates, and its materials as UsdPreviewSurface. It is saved chunk by
chunk, a .usda as a temporary .usdc that is then exported as text, so only the disk limits its length.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches import frame_blocks, rest_mesh, temporary_files
from anim.caches.formats.npz import about
from anim.caches.formats.usd_materials import UsdMaterials, bind_materials
from anim.caches.formats.usd_package import write_package
from anim.caches.options import WriteOptions, WriteResult
from anim.caches.source_document.bake_source import BakeSource
from anim.caches.storage import Outputs, companion_name
from anim.errors import UnsupportedError
from anim.model import VertexCache

DEFAULT_FPS = 24.0  # USD's own default
PRIM = "/mesh"
ROOT, MATERIALS = "/root", "/root/materials"  # with materials
TANGENTS = "tangents"  # primvar name used by exporters from glTF
KEY = "gltf_anim"  # in the layer's custom data: the parts, as in an .npz
USUAL_FPS = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)  # frame rates tried, in this order


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions, *, ending: str) -> WriteResult:
    """Write a stage with one mesh losslessly: ".usdc" binary, ".usda" text, or ".usdz", a package with the images.

    Images of a source lie beside a .usdc or .usda. Raises UnsupportedError without usd-core.
    """
    usd, _, _ = package()
    images: list[tuple[str, bytes]] = []
    notes: list[str] = []

    def save_image(number: int, kind: str, data: bytes) -> str:
        own = f"image{number}{kind}"
        images.append((own if ending == ".usdz" else companion_name(outputs.main, f"-{own}"), data))
        return images[-1][0] if ending == ".usdz" else f"./{images[-1][0]}"

    with temporary_files.temp_output(outputs, outputs.main, ending) as path:
        binary = path if ending == ".usdc" else f"{path}.usdc"
        stage = usd.Stage.CreateNew(binary)
        _write_stage(stage, cache, writing.source, save_image, notes.append)
        if ending == ".usda":
            stage.GetRootLayer().Export(path)
        elif ending == ".usdz":
            del stage
            write_package(path, binary, images)
    for name, data in images if ending != ".usdz" else ():
        with outputs.create(name) as file:
            file.write(data)
    return WriteResult(notes=tuple(notes))


def _write_stage(
    stage: Any,
    cache: VertexCache,
    source: BakeSource | None,
    save_image: Callable[[int, str, bytes], str],
    note: Callable[[str], None],
) -> None:
    _, geom, vt = package()
    rate = _rate(cache.times)
    codes = np.round(cache.times * rate, 9).tolist()
    geom.SetStageUpAxis(stage, geom.Tokens.z if cache.up == "z" else geom.Tokens.y)
    geom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(codes[0])
    stage.SetEndTimeCode(codes[-1])
    layer = stage.GetRootLayer()
    layer.customLayerData = {KEY: json.dumps(about(cache))}
    mesh = _mesh(stage, cache, geom, vt, PRIM if source is None else f"{ROOT}{PRIM}")
    if source is None:
        stage.SetDefaultPrim(mesh.GetPrim())
    else:
        stage.SetDefaultPrim(geom.Xform.Define(stage, ROOT).GetPrim())
        geom.Scope.Define(stage, MATERIALS)
        materials = UsdMaterials(source.document, stage, MATERIALS, save_image, note)
        bind_materials(cache, source.document, mesh, materials)
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


def package() -> tuple[Any, Any, Any]:
    """Return usd-core's Usd, UsdGeom and Vt. Raises UnsupportedError if it is not installed."""
    try:
        from pxr import Usd, UsdGeom, Vt
    except ImportError:
        raise UnsupportedError("USD needs the package usd-core", help="pip install 'gltf-anim[usd]'") from None
    return Usd, UsdGeom, Vt


def _mesh(stage: Any, cache: VertexCache, geom: Any, vt: Any, path: str) -> Any:
    mesh = geom.Mesh.Define(stage, path)
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

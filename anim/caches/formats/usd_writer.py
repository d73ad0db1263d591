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
from anim.caches import frame_blocks, rest_mesh
from anim.caches.formats.npz import about
from anim.caches.formats.usd_losses import node_loss_notes
from anim.caches.formats.usd_materials import UsdMaterials, bind_materials
from anim.caches.formats.usd_stage import (
    MATERIALS,
    ROOT,
    SaveImage,
    package,
    set_metadata,
    usual_rate,
    vectors,
    write_stage,
)
from anim.caches.options import WriteOptions, WriteResult
from anim.caches.source_document.bake_source import BakeSource
from anim.caches.storage import Outputs
from anim.files.signals import hold_signals
from anim.model import VertexCache

DEFAULT_FPS = 24.0  # USD's own default
PRIM = "/mesh"
TANGENTS = "tangents"  # primvar name used by exporters from glTF
PHONE_NOTE = "Quick Look on phones does not play moving points, but skinned USD (see `convert`)"
KEY = "gltf_anim"  # in the layer's custom data: the parts, as in an .npz


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions, *, ending: str) -> WriteResult:
    """Write a stage with one mesh losslessly: ".usdc" binary, ".usda" text, or ".usdz", a package with the images.

    Images of a source lie beside a .usdc or .usda. Raises UnsupportedError without usd-core.
    """
    notes = [] if writing.source is None else node_loss_notes(writing.source.document.json)
    if ending == ".usdz" and cache.frame_count > 1:
        notes.append(PHONE_NOTE)

    def build(stage: Any, save_image: SaveImage) -> None:
        _fill(stage, cache, writing.source, save_image, notes.append)

    write_stage(outputs, ending, "cache.usdc", build)
    return WriteResult(notes=tuple(notes))


def _fill(
    stage: Any, cache: VertexCache, source: BakeSource | None, save_image: SaveImage, note: Callable[[str], None]
) -> None:
    """Write the mesh and its materials; codes may be fractions of frames."""
    _, geom, vt = package()
    rate = usual_rate(cache.times) or DEFAULT_FPS
    codes = np.round(cache.times * rate, 9).tolist()
    layer = stage.GetRootLayer()
    with hold_signals():
        set_metadata(stage, rate, codes, up=cache.up)
        layer.customLayerData = {KEY: json.dumps(about(cache))}
        mesh = _default_prim(stage, cache, source, save_image, note)
    step = frame_blocks.per_chunk(cache.vertex_count)
    points, normals, extent = mesh.GetPointsAttr(), mesh.GetNormalsAttr(), mesh.GetExtentAttr()
    tangents = geom.PrimvarsAPI(mesh).GetPrimvar(TANGENTS).GetAttr()
    for chunk in cache.chunks():
        for i, positions in enumerate(chunk.positions):
            code = codes[chunk.first + i]
            with hold_signals():
                points.Set(vectors(positions), code)
                extent.Set(_bounds(positions), code)
                if chunk.normals is not None:
                    normals.Set(vectors(chunk.normals[i]), code)
                if chunk.tangents is not None and cache.handedness is not None:
                    tangents.Set(_signed(vt, chunk.tangents[i], cache.handedness), code)
                if (chunk.first + i + 1) % step == 0:
                    layer.Save()
    with hold_signals():
        layer.Save()


def _default_prim(
    stage: Any, cache: VertexCache, source: BakeSource | None, save_image: SaveImage, note: Callable[[str], None]
) -> Any:
    """Define the mesh, and with a source a root with it and its materials; return the mesh."""
    _, geom, vt = package()
    mesh = _mesh(stage, cache, geom, vt, PRIM if source is None else f"{ROOT}{PRIM}")
    if source is None:
        stage.SetDefaultPrim(mesh.GetPrim())
    else:
        stage.SetDefaultPrim(geom.Xform.Define(stage, ROOT).GetPrim())
        geom.Scope.Define(stage, MATERIALS)
        materials = UsdMaterials(source.document, stage, MATERIALS, save_image, note)
        bind_materials(cache, source.document, mesh, materials)
    return mesh


def _mesh(stage: Any, cache: VertexCache, geom: Any, vt: Any, path: str) -> Any:
    mesh = geom.Mesh.Define(stage, path)
    mesh.CreateSubdivisionSchemeAttr(geom.Tokens.none)
    mesh.CreateFaceVertexCountsAttr(vt.IntArray.FromNumpy(np.full(len(cache.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(vt.IntArray.FromNumpy(cache.faces.reshape(-1).astype(np.int32)))
    still = rest_mesh.positions(cache).astype(np.float32)
    mesh.CreatePointsAttr(vectors(still))
    mesh.CreateExtentAttr(_bounds(still))
    if cache.has_normals:
        mesh.CreateNormalsAttr()
        mesh.SetNormalsInterpolation(geom.Tokens.vertex)
    if cache.has_tangents:
        from pxr import Sdf

        kind = Sdf.ValueTypeNames.Float4Array
        geom.PrimvarsAPI(mesh).CreatePrimvar(TANGENTS, kind, geom.Tokens.vertex)
    return mesh


def _signed(vt: Any, rows: AnyArray, signs: Floats) -> Any:
    return vt.Vec4fArray.FromNumpy(np.concatenate((rows, signs[:, None]), axis=1).astype(np.float32))


def _bounds(rows: AnyArray) -> Any:
    return vectors(np.stack((rows.min(axis=0), rows.max(axis=0))) if len(rows) else np.zeros((2, 3)))

"""VertexCache → Alembic (.abc, Ogawa), through alembic3d (extra `alembic`).

One PolyMesh with positions, normals if present, and texture coordinates of a source, at times as they are.
Faces are wound the other way than in glTF. Alembic has no unit and no up axis; programs take metres with Y up.
There is no reader: the library crashes on damaged files.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches import temporary_files
from anim.caches.formats.mesh_materials import mesh_materials
from anim.caches.options import WriteOptions, WriteResult
from anim.caches.storage import Outputs
from anim.errors import UnsupportedError
from anim.model import VertexCache

MESH = "mesh"
RATE_TOLERANCE_S = 1e-6  # s, of frames at a rate; others are written one by one


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write positions, normals and texture coordinates losslessly. Raises UnsupportedError without alembic3d."""
    abc, geom, core, imath = _package()
    vertex = geom.GeometryScope.kVertexScope
    coordinates = None if writing.source is None else mesh_materials(cache, writing.source.document, "").coordinates
    vectors = cache.vertex_count * cache.frame_count * (1 + cache.has_normals) + len(cache.faces)
    temporary_files.check_free_space(12 * vectors, outputs.main)  # alembic3d aborts the process where a write fails
    with temporary_files.temp_output(outputs, outputs.main, ".abc") as path:
        archive = abc.OArchive(path)
        sampling = _time_sampling(core, cache.times)
        archive.addTimeSampling(sampling)
        mesh = geom.OPolyMesh(archive.getTop(), MESH)
        schema = mesh.getSchema()
        schema.setTimeSampling(sampling)
        sample = geom.OPolyMeshSchemaSample()
        sample.setFaceIndices(imath.IntArrayFromBuffer(_plain(cache.faces[:, ::-1].reshape(-1), np.int32)))
        sample.setFaceCounts(imath.IntArrayFromBuffer(np.full(len(cache.faces), 3, np.int32)))
        if coordinates is not None and coordinates.any():
            rows = imath.V2fArrayFromBuffer(_plain(coordinates, np.float32))
            sample.setUVs(geom.OV2fGeomParamSample(rows, vertex))
        for chunk in cache.chunks():
            for i, positions in enumerate(chunk.positions):
                sample.setPositions(imath.V3fArrayFromBuffer(_plain(positions, np.float32)))
                if chunk.normals is not None:
                    normals = imath.V3fArrayFromBuffer(_plain(chunk.normals[i], np.float32))
                    sample.setNormals(geom.ON3fGeomParamSample(normals, vertex))
                schema.set(sample)
                sample = geom.OPolyMeshSchemaSample()
        del sample, schema, mesh, archive  # the file is complete when all are gone
    return WriteResult()


def _time_sampling(core: Any, times: Floats) -> Any:
    """Frames at a rate, or a time for each."""
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1.0
    if np.abs(times - (times[0] + step * np.arange(len(times)))).max() < RATE_TOLERANCE_S:
        return core.TimeSampling(float(step), float(times[0]))
    each = core.TimeVector()
    for time in times.tolist():
        each.append(time)
    return core.TimeSampling(core.TimeSamplingType(core.AcyclicFlag.kAcyclic), each)


def _plain(rows: AnyArray, kind: type) -> AnyArray:
    """A writable, contiguous copy, as the package's buffers need."""
    return np.array(rows, kind, order="C")


def _package() -> tuple[Any, Any, Any, Any]:
    try:
        import alembic3d
        import imath
    except ImportError:
        raise UnsupportedError("Alembic needs the package alembic3d", help="pip install 'gltf-anim[alembic]'") from None
    return alembic3d.Abc, alembic3d.AbcGeom, alembic3d.AbcCoreAbstract, imath

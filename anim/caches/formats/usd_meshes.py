"""Meshes of a USD file as arrays, in a process that may crash: usd-core trusts what it reads (extra `usd`)."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.caches import frame_blocks
from anim.caches.formats import usd_motion, usd_prims, usd_stage, usd_writer
from anim.errors import FormatError
from anim.model import FrameChunk

UNREADABLE = "is no USD that can be read"
MORE_MEMORY = "if it is large, raise `memory_limit`"


class StageSummary(NamedTuple):
    """Contents of a stage besides frames.

    codes: time codes (F,) at which any mesh moves, `rate` of them per second. faces: triangles (T, 3).
    rest: default points (V, 3) m, None if a mesh has none. kept: JSON of our own writer. up: "y" or "z".
    handedness: signs (V,) of tangents, None without tangents.
    """

    codes: Floats
    rate: float
    vertices: int
    faces: Ints
    rest: Floats | None
    kept: dict[str, Any]
    up: str
    has_normals: bool
    handedness: Floats | None


def summary(path: str, limit_bytes: int) -> Iterator[StageSummary]:
    """Yield the summary of the stage in a file.

    limit_bytes: of memory. Raises UnsupportedError without usd-core, for a PointInstancer and for prims that take more
    memory, FormatError without meshes.
    """
    with _format_errors():
        stage = _Stage(path, limit_bytes)
        still = stage.positions(None)
        yield StageSummary(
            stage.codes(),
            stage.rate,
            stage.vertices,
            stage.faces(),
            None if still is None or len(still) != stage.vertices else still * stage.unit,
            stage.kept,
            stage.up,
            stage.has_normals,
            stage.handedness,
        )


def frames(path: str, limit_bytes: int, codes: Floats, *, normals: bool, tangents: bool) -> Iterator[FrameChunk]:
    """Yield positions in metres, normals and tangents at the time codes, in blocks of bounded size."""
    with _format_errors():
        stage = _Stage(path, limit_bytes)
        step = frame_blocks.per_chunk(stage.vertices)
        for first in range(0, len(codes), step):
            some = codes[first : first + step].tolist()
            positions = np.stack([_checked(stage.positions(code), stage.vertices, code) for code in some]) * stage.unit
            wanted = ((normals, stage.normals), (tangents, stage.tangents))
            turned = (np.stack([of(code) for code in some]).astype(np.float32) if want else None for want, of in wanted)
            yield FrameChunk(first, positions.astype(np.float32), *turned)


@contextmanager
def _format_errors() -> Iterator[None]:
    """Raise FormatError for errors of usd-core, and for attributes that hold values of another type than USD says."""
    usd_stage.package()
    from pxr import Tf

    try:
        yield
    except Tf.ErrorException:  # its messages are about its source code
        raise FormatError(UNREADABLE, help=MORE_MEMORY) from None
    except (TypeError, ValueError, LookupError, ArithmeticError, RuntimeError):
        raise FormatError(UNREADABLE) from None


class _Stage:
    """Meshes of a stage, opened from an input."""

    def __init__(self, path: str, limit_bytes: int) -> None:
        stages, geom, _ = usd_stage.package()
        self._stage = stages.Stage.Open(_single_layer(path, limit_bytes))
        self._geom, self._default, self._earliest = geom, stages.TimeCode.Default(), stages.TimeCode.EarliestTime()
        self.rate = float(self._stage.GetTimeCodesPerSecond())
        self.unit = float(geom.GetStageMetersPerUnit(self._stage))
        if not (math.isfinite(self.rate) and self.rate > 0 and math.isfinite(self.unit) and self.unit > 0):
            raise FormatError(f"has {self.rate:g} time codes per second and {self.unit:g} m per unit")
        self._meshes = usd_motion.meshes(self._stage)  # usd-core never ends with 0 or infinite time codes per second
        counts = [len(self._points(mesh)) for mesh in self._meshes]
        self._ends = np.cumsum([0, *counts])
        self.vertices = int(self._ends[-1])
        if not self.vertices:
            raise FormatError("has no mesh with points (points of `simulate particles` are no mesh)")
        self.up = "z" if geom.GetStageUpAxis(self._stage) == geom.Tokens.z else "y"
        self.has_normals = all(self._normals(mesh, self._first(mesh)) is not None for mesh in self._meshes)
        self.handedness = self._handedness()
        try:
            self.kept = json.loads(self._stage.GetRootLayer().customLayerData.get(usd_writer.KEY, "{}"))
        except (ValueError, TypeError):
            self.kept = {}

    def codes(self) -> Floats:
        """Time codes at which any mesh moves; 0 for a static stage."""
        return usd_motion.time_codes(self._stage, self._meshes)

    def faces(self) -> Ints:
        """Triangles (T, 3) of all meshes, counter-clockwise from outside in world space."""
        found = [np.empty((0, 3), np.int64)]
        for mesh, first, end in zip(self._meshes, self._ends, self._ends[1:], strict=False):
            counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
            corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
            fits = counts.sum() == len(corners) and counts.min(initial=0) >= 0
            if not fits or (corners.size and not 0 <= corners.min() <= corners.max() < end - first):
                raise FormatError(f"{mesh.GetPath()}: faces don't fit the points")
            triangles = _fans(counts, corners) + first
            found.append(triangles[:, [0, 2, 1]] if self._is_reversed(mesh) else triangles)
        return np.concatenate(found)

    def _is_reversed(self, mesh: Any) -> bool:
        """True if faces are clockwise in world space: of a left-handed mesh, or of one that its transform mirrors."""
        matrix = np.array(mesh.ComputeLocalToWorldTransform(self._earliest))[:3, :3]
        is_left_handed = mesh.GetOrientationAttr().Get() == self._geom.Tokens.leftHanded
        return bool(is_left_handed != (np.linalg.det(matrix) < 0))

    def positions(self, code: float | None) -> Floats | None:
        """Points of all meshes at a time code, None for the default ones if a mesh has none."""
        rows = []
        for mesh in self._meshes:
            points = np.asarray(mesh.GetPointsAttr().Get(self._default if code is None else code) or (), np.float64)
            if not len(points) and code is None:
                return None
            matrix = np.array(mesh.ComputeLocalToWorldTransform(self._earliest if code is None else code))
            rows.append(points.reshape(-1, 3) @ matrix[:3, :3] + matrix[3, :3])
        return np.concatenate(rows)

    def normals(self, code: float) -> Floats:
        """World-space normals of all meshes at a time code."""
        return self._turned(self._normals, code, lambda matrix: np.asarray(np.linalg.inv(matrix).T, np.float64))

    def tangents(self, code: float) -> Floats:
        """World-space tangents of all meshes at a time code."""
        return self._turned(self._tangents, code, lambda matrix: matrix)

    def _turned(self, of: Callable[[Any, Any], Any], code: float, turn: Callable[[Floats], Floats]) -> Floats:
        """Unit directions of all meshes: rows times `turn` of each mesh's matrix (3, 3)."""
        rows = []
        for mesh in self._meshes:
            matrix = np.array(mesh.ComputeLocalToWorldTransform(code))[:3, :3]
            found = of(mesh, code)
            if found is None:
                raise FormatError(f"{mesh.GetPath()}: normals or tangents don't fit the points at time code {code:g}")
            turned = np.asarray(found, np.float64)[:, :3] @ turn(matrix)
            rows.append(turned / np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-30))
        return np.concatenate(rows)

    def _handedness(self) -> Floats | None:
        found = [self._tangents(mesh, self._first(mesh)) for mesh in self._meshes]
        signs = [np.asarray(each, np.float64)[:, 3] for each in found if each is not None]
        return np.concatenate(signs) if len(signs) == len(found) else None

    def _tangents(self, mesh: Any, code: Any) -> Any:
        primvar = self._geom.PrimvarsAPI(mesh).GetPrimvar(usd_writer.TANGENTS)
        found = primvar.Get(code) if primvar and primvar.GetInterpolation() == self._geom.Tokens.vertex else None
        fits = found is not None and np.shape(found) == (len(self._points(mesh)), 4)
        return found if fits else None

    def _first(self, mesh: Any) -> Any:
        samples = mesh.GetPointsAttr().GetTimeSamples()
        return samples[0] if samples else self._default

    def _points(self, mesh: Any) -> Any:
        return mesh.GetPointsAttr().Get(self._first(mesh)) or ()

    def _normals(self, mesh: Any, code: Any) -> Any:
        if mesh.GetNormalsInterpolation() not in (self._geom.Tokens.vertex, self._geom.Tokens.varying):
            return None
        found = mesh.GetNormalsAttr().Get(code)
        return found if found is not None and len(found) == len(self._points(mesh)) else None


def _single_layer(path: str, limit_bytes: int) -> Any:
    """The layer in a file. Raises FormatError if it names other files: only files that the user names are read.

    Raises UnsupportedError for one that refers to itself so often that its prims take more memory than the limit.
    """
    from pxr import Sdf, Tf

    layer = Sdf.Layer.FindOrOpen(path)
    if layer is None:
        raise Tf.ErrorException("no layer")
    others = [each for each in layer.GetCompositionAssetDependencies() if each]
    clips: list[str] = []
    arcs: list[Any] = []

    def look(spec_path: Any) -> None:
        spec = layer.GetObjectAtPath(spec_path)
        if spec is not None and spec.HasInfo("clips"):
            clips.append(str(spec_path))
        if spec is not None and usd_prims.has_arcs(spec):
            arcs.append(spec_path)

    layer.Traverse(Sdf.Path.absoluteRootPath, look)
    if others or clips:
        other = f"'{others[0]}'" if others else f"value clips at {clips[0]}"
        raise FormatError(f"refers to other files ({other}): only one layer is read", help="flatten the stage")
    if arcs:
        usd_prims.check_size(layer, arcs, limit_bytes)
    return layer


def _fans(counts: Ints, corners: Ints) -> Ints:
    if (counts == 3).all():
        return corners.reshape(-1, 3)
    first = np.cumsum(counts) - counts
    triangles = [
        np.stack([np.full(n - 2, start), start + 1 + np.arange(n - 2), start + 2 + np.arange(n - 2)], axis=1)
        for start, n in zip(first.tolist(), counts.tolist(), strict=True)
        if n >= 3
    ]
    chosen: Ints = corners[np.concatenate([np.empty((0, 3), np.int64), *triangles])]
    return chosen


def _checked(rows: Floats | None, vertices: int, code: float) -> Floats:
    if rows is None or len(rows) != vertices:
        raise FormatError(f"has {0 if rows is None else len(rows)} points at time code {code:g} (expected {vertices})")
    if not np.isfinite(rows).all():
        raise FormatError(f"holds NaN or infinity at time code {code:g}")
    return rows

"""Error of a stage: the distance of its vertices, as usd-core skins them, from those of the source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.exchange.usd_skel.sample_times import add_times
from anim.model import Clip, Scene
from anim.skinning.bake import prepare_bake
from anim.skinning.bound_mesh import BoundMesh

MIN_INTERVAL_S = 1e-5  # s; shorter ones are jumps, during which there is no right vertex
MAX_TIMES = 2000  # measured ones: of longer clips some, evenly


class StageError(NamedTuple):
    """Largest distance (m) of a vertex of the stage from the source, and its time (s)."""

    distance: float
    time: float


def stage_error(
    stage: Any, prims: Mapping[int, Any], scene: Scene, clip: Clip, times: Floats, codes: Sequence[float]
) -> StageError:
    """Return the largest error at `times` (F,) s, whose time codes have samples, at all keys, and half-way between.

    prims: the Mesh prim of each instance, by node.
    """
    if not prims:
        return StageError(0.0, float(times[0]))
    baker = prepare_bake(scene, rigid=True, nodes=list(prims))
    measured = _measured_times(add_times(times, clip.key_times))
    code_of = dict(zip(times.tolist(), codes, strict=True))
    rate, most = float(stage.GetTimeCodesPerSecond()), StageError(0.0, float(times[0]))
    points = StagePoints(stage)
    layers = baker.bind_each()
    for chunk in baker.bake(clip, times=measured).chunks():
        for i, expected in enumerate(chunk.positions):
            time = float(measured[chunk.first + i])
            for layer in layers:
                found = points.at(prims[layer.instance.node], code_of.get(time, time * rate))
                most = max(most, StageError(_distance(found, expected, layer), time))
    return most


def _measured_times(times: Floats) -> Floats:
    width = np.diff(times)
    middle = (times[:-1] + width / 2)[width > MIN_INTERVAL_S]
    found = np.unique(np.concatenate((times, middle)))
    chosen: Floats = found[np.unique(np.linspace(0, len(found) - 1, MAX_TIMES).round().astype(int))]
    return chosen


def _distance(found: Floats, expected: Floats, layer: BoundMesh) -> float:
    difference = found - expected[layer.at : layer.at + len(found)]
    return float(np.sqrt((difference * difference).sum(axis=1).max()))


class StagePoints:
    """World-space points of meshes of a stage, skinned by usd-core."""

    def __init__(self, stage: Any) -> None:
        from pxr import Usd, UsdSkel

        self._cache = UsdSkel.Cache()
        self._skeletons: dict[str, Any] = {}
        self._blends: dict[str, Any] = {}
        root = UsdSkel.Root(stage.GetDefaultPrim())
        if root:
            self._cache.Populate(root, Usd.PrimDefaultPredicate)

    def at(self, mesh: Any, code: float) -> Floats:
        """Return the points (V, 3) of a mesh at a time code."""
        points = mesh.GetPointsAttr().Get()
        query = self._cache.GetSkinningQuery(mesh.GetPrim())
        placed = mesh
        if query.HasJointInfluences() or query.HasBlendShapes():
            skeleton = self._skeleton(mesh)
            if query.HasBlendShapes():
                points = self._blended(mesh, query, skeleton, points, code)
            if query.HasJointInfluences():
                query.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(code), points, code)
                placed = skeleton.GetSkeleton()
        matrix = np.array(placed.ComputeLocalToWorldTransform(code))
        world: Floats = np.asarray(points, np.float64) @ matrix[:3, :3] + matrix[3, :3]
        return world

    def _skeleton(self, mesh: Any) -> Any:
        from pxr import UsdSkel

        (path,) = UsdSkel.BindingAPI(mesh).GetSkeletonRel().GetTargets()
        if str(path) not in self._skeletons:
            prim = mesh.GetPrim().GetStage().GetPrimAtPath(path)
            self._skeletons[str(path)] = self._cache.GetSkelQuery(UsdSkel.Skeleton(prim))
        return self._skeletons[str(path)]

    def _blended(self, mesh: Any, query: Any, skeleton: Any, points: Any, code: float) -> Any:
        from pxr import UsdSkel

        path = str(mesh.GetPath())
        if path not in self._blends:
            blend = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(mesh))
            self._blends[path] = (blend, blend.ComputeBlendShapePointIndices(), blend.ComputeSubShapePointOffsets())
        blend, indices, offsets = self._blends[path]
        weights = query.GetBlendShapeMapper().Remap(skeleton.GetAnimQuery().ComputeBlendShapeWeights(code))
        blend.ComputeDeformedPoints(*blend.ComputeSubShapeWeights(weights), indices, offsets, points)
        return points

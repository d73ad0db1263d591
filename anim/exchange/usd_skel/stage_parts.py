"""Meshes of a stage whose points are computed together: plain ones, skinned ones, and one with blend shapes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from anim.arrays import Floats, Ints


class StagePart(Protocol):
    """Some meshes of a stage."""

    def points(self, code: float) -> Floats:
        """Return the world-space points (V, 3) at a time code, mesh by mesh."""
        ...


class PlainMeshes:
    """Meshes that only their transforms move."""

    def __init__(self, meshes: Sequence[Any], *, moves: bool) -> None:
        rows = [np.asarray(mesh.GetPointsAttr().Get(), np.float64) for mesh in meshes]
        self._points, self._owner = np.concatenate(rows), _owners(rows)
        self._placement = Placement(meshes, moves=moves)

    def points(self, code: float) -> Floats:
        """As of StagePart."""
        return self._placement.world(self._points, self._owner, code)


class SkinnedMeshes:
    """Meshes with as many influences per point and the same matrix into the bind pose, each with its skeleton's query.

    usd-core skins them in one call, as meshes of one skeleton with the joints of all.
    """

    def __init__(self, queries: Sequence[Any], skeletons: Sequence[Any], *, moves: bool) -> None:
        from pxr import UsdGeom, Vt

        self._skeletons = list({str(each.GetPrim().GetPath()): each for each in skeletons}.values())
        number = {str(each.GetPrim().GetPath()): i for i, each in enumerate(self._skeletons)}
        owner = [number[str(each.GetPrim().GetPath())] for each in skeletons]
        first = np.cumsum([0, *(len(each.GetJointOrder()) for each in self._skeletons)])
        rows = [np.asarray(UsdGeom.Mesh(each.GetPrim()).GetPointsAttr().Get(), np.float32) for each in queries]
        influences = [each.ComputeJointInfluences() for each in queries]
        joints = [np.asarray(own) + first[i] for (own, _), i in zip(influences, owner, strict=True)]
        self._joints = Vt.IntArray.FromNumpy(np.concatenate(joints).astype(np.int32))
        self._weights = Vt.FloatArray.FromNumpy(
            np.concatenate([np.asarray(each, np.float32) for _, each in influences])
        )
        self._points = Vt.Vec3fArray.FromNumpy(np.concatenate(rows))
        self._owner = np.repeat(owner, [len(each) for each in rows])
        self._width, self._to_bind = queries[0].GetNumInfluencesPerComponent(), queries[0].GetGeomBindTransform()
        self._placement = Placement([each.GetSkeleton() for each in self._skeletons], moves=moves)

    def points(self, code: float) -> Floats:
        """As of StagePart."""
        from pxr import UsdSkel, Vt

        joints = np.concatenate([np.asarray(each.ComputeSkinningTransforms(code)) for each in self._skeletons])
        skinned = Vt.Vec3fArray(self._points)
        UsdSkel.SkinPointsLBS(
            self._to_bind, Vt.Matrix4dArray.FromNumpy(joints), self._joints, self._weights, self._width, skinned
        )
        return self._placement.world(np.asarray(skinned, np.float64), self._owner, code)


class BlendedMesh:
    """A mesh with blend shapes, and with influences or without."""

    def __init__(self, query: Any, skeleton: Any) -> None:
        from pxr import UsdGeom, UsdSkel

        self._query, self._skeleton = query, skeleton
        self._mesh = UsdGeom.Mesh(query.GetPrim())
        self._blend = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(self._mesh))
        self._shapes = self._blend.ComputeBlendShapePointIndices(), self._blend.ComputeSubShapePointOffsets()

    def points(self, code: float) -> Floats:
        """As of StagePart."""
        points, placed = self._mesh.GetPointsAttr().Get(), self._mesh
        weights = self._skeleton.GetAnimQuery().ComputeBlendShapeWeights(code)
        own = self._query.GetBlendShapeMapper().Remap(weights)
        self._blend.ComputeDeformedPoints(*self._blend.ComputeSubShapeWeights(own), *self._shapes, points)
        if self._query.HasJointInfluences():
            self._query.ComputeSkinnedPoints(self._skeleton.ComputeSkinningTransforms(code), points, code)
            placed = self._skeleton.GetSkeleton()
        matrix = np.array(placed.ComputeLocalToWorldTransform(code))
        world: Floats = np.asarray(points, np.float64) @ matrix[:3, :3] + matrix[3, :3]
        return world


class Placement:
    """World matrices of prims.

    moves: whether they change, else they are computed once.
    """

    def __init__(self, prims: Sequence[Any], *, moves: bool) -> None:
        from pxr import UsdGeom

        self._prims, self._moves = [each.GetPrim() for each in prims], moves
        self._cache = UsdGeom.XformCache()  # ancestors once, and operations once for all times
        self._matrices = self._computed(0.0)

    def world(self, points: Floats, owner: Ints, code: float) -> Floats:
        """Return points (V, 3) in the space of the prim of each, `owner` (V,), in world space at a time code."""
        matrices = self._computed(code) if self._moves else self._matrices
        if (matrices == matrices[0]).all():
            return np.asarray(points @ matrices[0, :3, :3] + matrices[0, 3, :3])
        own = matrices[owner]
        return np.asarray(np.einsum("vi,vij->vj", points, own[:, :3, :3]) + own[:, 3, :3])

    def _computed(self, code: float) -> Floats:
        self._cache.SetTime(code)
        return np.array([self._cache.GetLocalToWorldTransform(each) for each in self._prims], np.float64)


def _owners(rows: Sequence[Floats]) -> Ints:
    """The index of the row of arrays that each point belongs to."""
    return np.repeat(np.arange(len(rows)), [len(each) for each in rows])

"""World-space points of the meshes of a stage, skinned by usd-core: meshes together, and what does not move once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats, Ints, group_indices
from anim.exchange.usd_skel.stage_parts import BlendedMesh, PlainMeshes, SkinnedMeshes, StagePart
from anim.exchange.usd_skel.varying_prims import VaryingPrims


class StagePoints:
    """Points (V, 3) of meshes of a stage, one mesh after the other."""

    def __init__(self, stage: Any, meshes: Sequence[Any]) -> None:
        sizes = [len(mesh.GetPointsAttr().Get()) for mesh in meshes]
        owner = np.repeat(np.arange(len(meshes)), sizes)
        part_of = np.empty(len(meshes), np.int64)
        self._world = np.empty((len(owner), 3))
        self._moving: list[tuple[Ints, StagePart]] = []
        parts = list(_parts(stage, meshes))
        for number, (own, _, _) in enumerate(parts):
            part_of[own] = number
        order = np.argsort(part_of[owner], kind="stable")
        ends = np.cumsum(np.bincount(part_of[owner], minlength=len(parts)))
        for columns, (_, part, moves) in zip(np.split(order, ends[:-1]), parts, strict=True):
            if moves:
                self._moving.append((columns, part))
            else:
                self._world[columns] = part.points(0.0)

    def at(self, code: float) -> Floats:
        """Return the points at a time code, which the next call overwrites."""
        for columns, part in self._moving:
            self._world[columns] = part.points(code)
        return self._world


class _Skinning(NamedTuple):
    """A mesh with usd-core's queries for it, `skeleton` None without influences and blend shapes."""

    mesh: Any
    query: Any
    skeleton: Any

    def key(self, number: int, varying: VaryingPrims) -> tuple[object, ...]:
        """Return what meshes have in common that are computed together, first whether they are placed anew."""
        placed = self.mesh if self.skeleton is None else self.skeleton.GetSkeleton()
        is_placed = varying.moves(placed.GetPrim())
        if self.skeleton is None:
            return is_placed, False
        animation = self.skeleton.GetAnimQuery()
        moves = bool(animation.JointTransformsMightBeTimeVarying())
        if self.query.HasBlendShapes():
            return is_placed, moves or bool(animation.BlendShapeWeightsMightBeTimeVarying()), number
        matrix = np.array(self.query.GetGeomBindTransform()).tobytes()
        return is_placed, moves, self.query.GetNumInfluencesPerComponent(), matrix


def _parts(stage: Any, meshes: Sequence[Any]) -> Iterator[tuple[list[int], StagePart, bool]]:
    """Indices of meshes, their part, and whether it moves."""
    varying, skinning = VaryingPrims(), _skinning(stage, meshes)
    groups = group_indices(each.key(number, varying) for number, each in enumerate(skinning))
    for (is_placed, moves, *_), numbers in groups.items():
        some = [skinning[number] for number in numbers]
        yield numbers, _part(some, is_placed=bool(is_placed)), bool(is_placed or moves)


def _part(some: Sequence[_Skinning], *, is_placed: bool) -> StagePart:
    first = some[0]
    if first.skeleton is None:
        return PlainMeshes([each.mesh for each in some], moves=is_placed)
    if first.query.HasBlendShapes():
        return BlendedMesh(first.query, first.skeleton)
    return SkinnedMeshes([each.query for each in some], [each.skeleton for each in some], moves=is_placed)


def _skinning(stage: Any, meshes: Sequence[Any]) -> list[_Skinning]:
    from pxr import Usd, UsdSkel

    cache, found, skeletons = UsdSkel.Cache(), list[_Skinning](), dict[str, Any]()
    root = UsdSkel.Root(stage.GetDefaultPrim())
    if root:
        cache.Populate(root, Usd.PrimDefaultPredicate)
    for mesh in meshes:
        query = cache.GetSkinningQuery(mesh.GetPrim())
        skeleton = None
        if query.HasJointInfluences() or query.HasBlendShapes():
            (path,) = map(str, UsdSkel.BindingAPI(mesh).GetSkeletonRel().GetTargets())
            if path not in skeletons:
                skeletons[path] = cache.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath(path)))
            skeleton = skeletons[path]
        found.append(_Skinning(mesh, query, skeleton))
    return found

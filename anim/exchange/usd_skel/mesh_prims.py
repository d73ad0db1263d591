"""Mesh instances as Mesh prims: points, faces, normals, influences and blend shapes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.formats.usd_stage import define_prims, vectors
from anim.exchange.usd_skel.blend_weights import NEGATIVE_SUFFIX, ScaledTarget
from anim.exchange.usd_skel.prim_names import UniqueNames, valid
from anim.gltf.document import Json
from anim.model import Mesh, MeshInstance


def define_mesh(stage: Any, path: str, mesh: Mesh, faces: Ints) -> Any:
    """Return a new Mesh prim with the points, faces (T, 3) and normals of a mesh in its own space."""
    from pxr import UsdGeom, Vt

    prim = UsdGeom.Mesh.Define(stage, path)
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.reshape(-1).astype(np.int32)))
    prim.CreatePointsAttr(vectors(mesh.positions))
    prim.CreateExtentAttr(vectors(np.stack((mesh.positions.min(axis=0), mesh.positions.max(axis=0)))))
    if mesh.normals is not None:
        prim.CreateNormalsAttr(vectors(mesh.normals))
        prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    return prim


def bind_influences(prim: Any, instance: MeshInstance, joints: list[int], to_skeleton: Floats) -> None:
    """Bind the points of a mesh to joints of its skeleton. joints: index in the skeleton of each joint of the skin.

    to_skeleton: (4, 4) from the mesh to the skeleton's bind pose.
    """
    mesh = instance.mesh
    used = np.flatnonzero((mesh.weights > 0).any(axis=0))  # columns
    weights, own = mesh.weights[:, used], np.array(joints)[mesh.joints[:, used]]
    own[weights == 0] = 0
    _bind(prim, own, weights, to_skeleton)


def bind_to_joint(prim: Any, num_points: int, joint: int, to_skeleton: Floats) -> None:
    """Bind all points of a mesh to one joint of its skeleton."""
    _bind(prim, np.full((num_points, 1), joint), np.ones((num_points, 1)), to_skeleton)


def _bind(prim: Any, joints: AnyArray, weights: Floats, to_skeleton: Floats) -> None:
    """Set the influences (V, I) of the points."""
    from pxr import Gf, UsdSkel, Vt

    binding, width = UsdSkel.BindingAPI.Apply(prim.GetPrim()), joints.shape[1]
    indices = Vt.IntArray.FromNumpy(joints.astype(np.int32).reshape(-1))
    binding.CreateJointIndicesPrimvar(False, width).Set(indices)
    binding.CreateJointWeightsPrimvar(False, width).Set(Vt.FloatArray.FromNumpy(weights.astype(np.float32).reshape(-1)))
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(to_skeleton.T.tolist()))


def add_blend_shapes(
    stage: Any, prim: Any, mesh: Mesh, shapes: Sequence[ScaledTarget], about: Json, taken: UniqueNames
) -> list[str]:
    """Add morph targets of a mesh as blend shapes; return their names, which no other mesh of the skeleton has.

    about: the mesh in the file, for the names of its targets. taken: names of the skeleton's other blend shapes.
    """
    from pxr import UsdSkel

    path = prim.GetPath()
    own = UniqueNames(each.GetName() for each in prim.GetPrim().GetChildren())
    given = [target_name(about, each.target) + (NEGATIVE_SUFFIX if each.factor < 0 else "") for each in shapes]
    targets = [path.AppendChild(own.add(name)) for name in given]
    define_prims(stage, [(str(target), "BlendShape") for target in targets])
    for each, target in zip(shapes, targets, strict=True):
        shape = UsdSkel.BlendShape(stage.GetPrimAtPath(target))
        offsets, normal_offsets = _offsets(mesh, each)
        moved = _moved(offsets, normal_offsets)
        shape.CreateOffsetsAttr(vectors(offsets[moved]))
        if normal_offsets is not None:
            shape.CreateNormalOffsetsAttr(vectors(normal_offsets[moved]))
        if len(moved) < len(offsets):
            _set_points(shape, moved)
    names = [taken.add(target.name) for target in targets]
    binding = UsdSkel.BindingAPI.Apply(prim.GetPrim())
    binding.CreateBlendShapesAttr(names)
    binding.CreateBlendShapeTargetsRel().SetTargets(targets)
    return names


def target_name(about: Json, number: int) -> str:
    """Return the valid name of a morph target, by the mesh's extras or its index."""
    extras = about.get("extras")
    names = extras.get("targetNames") if isinstance(extras, dict) else None
    given = names[number] if isinstance(names, list) and number < len(names) else None
    return valid(given) if isinstance(given, str) and given else f"target{number}"


def _offsets(mesh: Mesh, shape: ScaledTarget) -> tuple[Floats, Floats | None]:
    """Offsets (V, 3) of a blend shape, and those of its normals."""
    offsets = shape.factor * mesh.targets[shape.target]
    if mesh.normal_targets is None or mesh.normals is None:
        return offsets, None
    return offsets, shape.factor * mesh.normal_targets[shape.target]


def _moved(offsets: Floats, normal_offsets: Floats | None) -> Ints:
    """Indices of the points with an offset, of position or normal; the first point if none."""
    moved = offsets.any(axis=1) if normal_offsets is None else offsets.any(axis=1) | normal_offsets.any(axis=1)
    found: Ints = np.flatnonzero(moved)
    return found if len(found) else np.zeros(1, np.int64)


def _set_points(shape: Any, moved: Ints) -> None:
    from pxr import Vt

    shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(moved.astype(np.int32)))

"""Document → stage: nodes, skeletons, meshes, blend shapes and materials."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.caches.formats.usd_face_materials import face_materials
from anim.caches.formats.usd_materials import UsdMaterials, bind_primitives
from anim.caches.formats.usd_stage import MATERIALS, ROOT, SaveImage, define_prims, set_metadata
from anim.exchange.usd_skel import mesh_prims
from anim.exchange.usd_skel.blend_weights import scale_targets
from anim.exchange.usd_skel.node_prims import NodePrims
from anim.exchange.usd_skel.prim_names import UniqueNames
from anim.exchange.usd_skel.skeleton_group import SkeletonGroup, group_skeletons
from anim.exchange.usd_skel.skeleton_prims import SkeletonPrim
from anim.exchange.usd_skel.stage_layout import lay_out
from anim.gltf.document import Document, Json
from anim.model import Clip, MeshInstance, Scene
from anim.model.track import NUM_COMPONENTS
from anim.sampling.pose import PosedSkeleton, PoseSampler
from anim.units import plural

TIME_TOLERANCE_S = 4e-7  # s, of frames; less than half the shortest jump


@dataclass(frozen=True, slots=True)
class StageTimes:
    """Times (F,) in seconds of a clip, and the time codes per second."""

    seconds: Floats
    rate: float

    @property
    def codes(self) -> list[float]:
        """Time codes (F,), whole numbers for frames."""
        exact = self.seconds * self.rate
        whole = np.round(exact)
        is_frame = np.abs(exact - whole) < TIME_TOLERANCE_S * self.rate
        return [float(each) for each in np.where(is_frame, whole, np.round(exact, 9))]


class StageBuilder:
    """Writer of a document's meshes into an empty stage."""

    def __init__(self, stage: Any, document: Document, scene: Scene, clip: Clip, times: StageTimes) -> None:
        self._stage, self._document, self._scene, self._times = stage, document, scene, times
        self._rest = PosedSkeleton.at_rest(scene.skeleton)
        self._mirrored = np.linalg.det(self._rest.world[:, 0, :, :3]) < 0
        self._posed = PoseSampler(scene.skeleton, clip).posed(times.seconds)
        moving = [track for track in clip.tracks if track.path in NUM_COMPONENTS]
        self._animated = {track.node for track in moving if track.node is not None}
        self._num_scaled = 0  # morph targets with weights outside 0 … 1
        self._prims: dict[int, Any] = {}

    def build(self, save_image: SaveImage, note: Callable[[str], None]) -> dict[int, Any]:
        """Write everything, and return the Mesh prim of every instance, by node.

        save_image, note: as of UsdMaterials.
        """
        from pxr import UsdGeom, UsdSkel

        stage = self._stage
        set_metadata(stage, self._times.rate, self._times.codes)
        shown = [each for each in self._scene.instances if len(each.mesh.faces)]
        groups = group_skeletons(self._scene, shown, self._animated)
        kind = UsdSkel.Root if groups else UsdGeom.Xform
        stage.SetDefaultPrim(kind.Define(stage, ROOT).GetPrim())
        self._nodes = NodePrims(stage, self._rest, self._posed, self._times.codes)
        self._nodes.names.child(ROOT, "materials")
        UsdGeom.Scope.Define(stage, MATERIALS)
        self._materials = UsdMaterials(self._document, stage, MATERIALS, save_image, note)
        bound = {each.node for group in groups for each, _ in group.members}
        plain = [each for each in shown if each.node not in bound]
        self._nodes.add([*(each.node for each in plain), *(group.anchor for group in groups)])
        self._layout = lay_out(self._scene.skeleton, self._nodes, plain, groups)
        define_prims(stage, self._layout.prims)
        self._materials.add_prims(
            self._shown_materials([*plain, *(each for group in groups for each, _ in group.members)])
        )
        for each in plain:
            self._mesh(each, each.node)
        for group, path in zip(groups, self._layout.skeletons, strict=True):
            self._skeleton(group, path)
        if self._num_scaled:
            verb = "is" if self._num_scaled == 1 else "are"
            scaled = f"{plural(self._num_scaled, 'morph target')} {verb} scaled or split in two"
            note(f"{scaled}, for weights from 0 to 1, to which Blender clamps them")
        return self._prims

    def _shown_materials(self, instances: Sequence[MeshInstance]) -> Iterator[int]:
        for each in instances:
            yield from face_materials(self._document.json, each.mesh.faces, self._primitives(each)).numbers

    def _skeleton(self, group: SkeletonGroup, path: str) -> None:
        """Write a skeleton and its meshes, side by side."""
        from pxr import UsdSkel

        made = SkeletonPrim(self._stage, path, group, self._rest, self._posed, self._times.codes)
        number = {node: i for i, node in enumerate(group.joints)}
        names, weights, taken = list[str](), list[Floats](), UniqueNames()
        for instance, to_bind in group.members:
            to_skeleton = np.diag([made.bind_scale] * 3 + [1.0]) @ to_bind
            prim = self._mesh(instance, group.anchor)
            binding = UsdSkel.BindingAPI.Apply(prim.GetPrim())
            binding.CreateSkeletonRel().SetTargets([path])
            if instance.skin is not None:
                joints = [number[node] for node in instance.skin.joints.tolist()]
                mesh_prims.bind_influences(prim, instance, joints, to_skeleton)
            elif instance.node in number:
                mesh_prims.bind_to_joint(prim, len(instance.mesh.positions), number[instance.node], to_skeleton)
            if len(instance.mesh.targets):
                shapes = scale_targets(self._weights(instance))
                self._num_scaled += len({each.target for each in shapes if each.factor != 1})
                about = self._about(instance)
                names += mesh_prims.add_blend_shapes(self._stage, prim, instance.mesh, shapes, about, taken)
                weights += [each.weights for each in shapes]
        if names:
            made.set_blend_weights(names, np.stack(weights, axis=1))

    def _mesh(self, instance: MeshInstance, parent: int) -> Any:
        """Write a mesh below the prim of a node, its faces reversed if only one of both nodes mirrors them."""
        is_mirrored = self._is_mirrored(instance.node) != self._is_mirrored(parent)
        faces = instance.mesh.faces[:, ::-1] if is_mirrored else instance.mesh.faces
        prim = mesh_prims.define_mesh(self._stage, self._layout.meshes[instance.node], instance.mesh, faces)
        primitives = self._primitives(instance)
        count = len(instance.mesh.positions)
        bind_primitives(self._document, prim, self._materials, count, instance.mesh.faces, primitives)
        self._prims[instance.node] = prim
        return prim

    def _is_mirrored(self, node: int) -> bool:
        return node >= 0 and bool(self._mirrored[node])

    def _primitives(self, instance: MeshInstance) -> list[tuple[Json, tuple[int, int]]]:
        """The primitives with vertices, and their spans."""
        found, at = [], 0
        for about, part in zip(self._about(instance)["primitives"], instance.mesh.primitives, strict=True):
            if part.vertices:
                found.append((about, (at, at + part.vertices)))
            at += part.vertices
        return found

    def _about(self, instance: MeshInstance) -> Json:
        about: Json = self._document.json["meshes"][self._document.json["nodes"][instance.node]["mesh"]]
        return about

    def _weights(self, instance: MeshInstance) -> Floats:
        """Morph weights (F, M)."""
        animated = self._posed.weights.get(instance.node)
        return np.tile(instance.weights, (len(self._times.seconds), 1)) if animated is None else animated

"""Collapse of linear blending in a clip, and scores of other methods: candy wrappers, volumes, bulges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats
from anim.errors import NotFoundError, RangeError
from anim.model import Clip, MeshInstance, Scene
from anim.sampling.pose import PosedSkeleton
from anim.skinning.analysis.collapse_index import CollapseIndices, CollapsePoint, collapse_indices
from anim.skinning.analysis.equal_meshes import first_equal_mesh
from anim.skinning.analysis.method_scores import BindMeasures, MethodScore, bind_measures, score_methods
from anim.skinning.bake import prepare_bake

LOW_INDEX = 0.7  # collapse index below which skin looks pinched: that of 90° between two joints


@dataclass(frozen=True, slots=True)
class MeshCollapse:
    """One skinned mesh in one clip.

    indices: (F,) smallest collapse index of its vertices at each of `times` (F,) s. worst: location of the minimum.
    low: fraction of vertices that are ever below 0.7. inverted: fraction that is ever inside out.
    closed: fraction of faces that enclose a volume. methods: score of each method.
    """

    mesh: str
    node: int
    vertices: int
    times: Floats
    indices: Floats
    worst: CollapsePoint
    low: float
    inverted: float
    closed: float
    methods: tuple[MethodScore, ...]


def collapse(
    scene: Scene,
    clip: Clip,
    *,
    times: Floats,
    methods: Sequence[str] = ("lbs", "dqs"),
    bulge_clamp: bool = False,
    nodes: Sequence[int] | None = None,
) -> tuple[MeshCollapse, ...]:
    """Return the collapse of each skinned mesh of a scene at `times` (F,) s of a clip.

    The collapse index of a vertex belongs to linear blending; the methods are compared by enclosed volume and by
    distance from the bones. bulge_clamp: with the clamp on methods other than lbs. nodes: only meshes on these. For
    many clips create a `Comparison`. collapse(tube, twist90, times=[0, 1]) → one mesh with indices 1, 0.707
    """
    return Comparison(scene, methods=methods, bulge_clamp=bulge_clamp, nodes=nodes).of(clip, times=times)


class Comparison:
    """Comparison of methods on one scene, for any clip. meshes: number of compared meshes.

    Raises NotFoundError without a skinned mesh, RangeError for a bulge clamp if lbs is the only method.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        methods: Sequence[str] = ("lbs", "dqs"),
        bulge_clamp: bool = False,
        nodes: Sequence[int] | None = None,
    ) -> None:
        skinned = [i for i in scene.instances if i.skin is not None and (nodes is None or i.node in nodes)]
        if not skinned:
            raise NotFoundError("there is no skinned mesh to look at")
        if bulge_clamp and set(methods) == {"lbs"}:
            raise RangeError("`bulge_clamp` requires a method other than lbs (expected dqs or cor)")
        self._scene = scene
        rest = PosedSkeleton.at_rest(scene.skeleton)
        self._instances = [each for each in skinned if len(each.mesh.positions)]
        first = first_equal_mesh(self._instances, rest)
        distinct = sorted(set(first))
        self._subject_of = np.searchsorted(distinct, first).tolist()
        looked_at = [self._instances[i].node for i in distinct]  # equal meshes are compared once
        self._bakers = {
            method: prepare_bake(scene, method=method, bulge_clamp=bulge_clamp and method != "lbs", nodes=looked_at)
            for method in methods
        }
        self._linear = self._bakers.get("lbs") or prepare_bake(scene, nodes=looked_at)
        self._subjects = bind_measures(next(iter(self._bakers.values())).bind_each(), rest)
        self.meshes = len(self._instances)

    def of(self, clip: Clip, *, times: Floats) -> tuple[MeshCollapse, ...]:
        """Return the collapse of each mesh in a clip."""
        scores = list(score_methods(self._bakers, self._linear, self._subjects, clip, times))
        indices = collapse_indices(self._scene.skeleton, [each.layer for each in self._subjects], clip, times)
        found = [
            self._mesh_collapse(each, seen, methods, times)
            for each, seen, methods in zip(self._subjects, indices, scores, strict=True)
        ]
        return tuple(
            replace(found[i], mesh=self._name(instance), node=instance.node)
            for instance, i in zip(self._instances, self._subject_of, strict=True)
        )

    def _mesh_collapse(
        self, subject: BindMeasures, seen: CollapseIndices, methods: tuple[MethodScore, ...], times: Floats
    ) -> MeshCollapse:
        instance, rig = subject.layer.instance, subject.layer.rig
        return MeshCollapse(
            self._name(instance),
            instance.node,
            len(rig.points),
            times,
            seen.by_frame,
            seen.worst,
            float((seen.least < LOW_INDEX).mean()),
            float(seen.inverted.mean()),
            len(subject.faces) / max(len(rig.faces), 1),
            methods,
        )

    def _name(self, instance: MeshInstance) -> str:
        return instance.mesh.name or self._scene.skeleton.display_name(instance.node)

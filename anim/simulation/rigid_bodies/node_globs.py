"""Bodies and colliders of nodes that are chosen by name, with the shapes of their meshes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from anim.arrays import Ints
from anim.errors import AnimError, FormatError, NotFoundError, RangeError, UnsupportedError
from anim.maths import hierarchy
from anim.model import Mesh, MeshInstance, Scene
from anim.model.skeleton import nearest_at_or_above, node_mask
from anim.simulation.rigid_bodies.description import Collider, Material, Motion, PhysicsDescription, Shape
from anim.simulation.rigid_bodies.shapes import mesh_shape

SHAPES = ("hull", "box", "sphere", "mesh")


@dataclass(frozen=True, slots=True)
class ChosenNodes:
    """Nodes that become bodies, with `shape` in SHAPES, and nodes that they collide with, as meshes."""

    bodies: tuple[int, ...] = ()
    shape: str = "hull"
    colliders: tuple[int, ...] = ()
    motion: Motion = field(default_factory=Motion)
    material: Material = field(default_factory=Material)


def add_chosen(description: PhysicsDescription, scene: Scene, chosen: ChosenNodes) -> PhysicsDescription:
    """Return the description with chosen nodes: every mesh below one is a collider, of the nearest body above it.

    A node that the description has keeps its collider. Raises NotFoundError for a node without a mesh below it,
    UnsupportedError for a skinned one, FormatError for one without faces.
    """
    motions = {**dict.fromkeys(chosen.bodies, chosen.motion), **description.motions}
    colliders = dict(description.colliders)
    meshes = _MeshNodes(scene, motions)
    instances = {each.node: each for each in reversed(scene.instances)}
    shapes: dict[tuple[Mesh, str, bytes], Shape] = {}  # bodies with the same mesh share its hull
    for nodes, kind in ((chosen.bodies, chosen.shape), (chosen.colliders, "mesh")):
        for node in nodes:
            below = meshes.of(node)
            if not below and not meshes.has_any_below(node, colliders):
                raise NotFoundError(f"{scene.skeleton.label(node)} has no mesh to collide with")
            for each in below:
                if each not in colliders:
                    own = instances[each]
                    key = own.mesh, kind, own.weights.tobytes()
                    if key not in shapes or own.skin is not None:
                        shapes[key] = _shape(scene, own, kind)
                    colliders[each] = Collider(shapes[key], chosen.material)
    return replace(description, motions=motions, colliders=colliders)


def split_by_mesh(scene: Scene, nodes: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the nodes with a mesh of their own as bodies, and those without: all with one if none has.

    A pattern also matches joints, cameras, and groups whose meshes are bodies themselves.
    """
    meshes = _MeshNodes(scene, nodes)
    found = [bool(meshes.of(node)) for node in nodes]
    if not any(found):
        return nodes, ()
    with_mesh = tuple(node for node, has in zip(nodes, found, strict=True) if has)
    return with_mesh, tuple(node for node, has in zip(nodes, found, strict=True) if not has)


class _MeshNodes:
    """The nodes with meshes, by the node that they move with. motions: nodes that are bodies."""

    def __init__(self, scene: Scene, motions: Iterable[int]) -> None:
        parents = scene.skeleton.parents
        self._first, self._end = hierarchy.find_subtrees(parents)
        self._body = nearest_at_or_above(parents, node_mask(scene.skeleton, motions))
        self._nodes: dict[int, list[int]] = {}  # by body
        for instance in scene.instances:
            self._nodes.setdefault(int(self._body[instance.node]), []).append(instance.node)
        self._places = {body: np.sort(self._first[nodes]) for body, nodes in self._nodes.items()}

    def of(self, top: int) -> list[int]:
        """Return the nodes with a mesh at or below `top`, without those of another body below it."""
        body = int(self._body[top])
        if body not in self._nodes or not self._has_inside(self._places[body], top):
            return []
        return [node for node in self._nodes[body] if self._first[top] <= self._first[node] < self._end[top]]

    def has_any_below(self, top: int, nodes: Iterable[int]) -> bool:
        """Return whether any of some nodes is `top` or below it."""
        return self._has_inside(np.sort(self._first[list(nodes)]), top)

    def _has_inside(self, places: Ints, top: int) -> bool:
        at = int(np.searchsorted(places, self._first[top]))
        return at < len(places) and bool(places[at] < self._end[top])


def _shape(scene: Scene, instance: MeshInstance, kind: str) -> Shape:
    label = scene.skeleton.label(instance.node)
    if instance.skin is not None:
        raise UnsupportedError(f"{label} is skinned: a rigid body moves by its node alone")
    try:
        return mesh_shape(instance.mesh, kind, instance.weights)
    except RangeError as error:  # the mesh is a value of the file
        raise FormatError(error.problem).at(label) from None
    except AnimError as error:
        raise error.at(label) from None

"""Bodies and colliders of nodes that are chosen by name, with the shapes of their meshes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

from anim.errors import AnimError, FormatError, NotFoundError, RangeError, UnsupportedError
from anim.model import Scene
from anim.simulation.rigid_bodies.assembly import ancestors
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
    for nodes, kind in ((chosen.bodies, chosen.shape), (chosen.colliders, "mesh")):
        for node in nodes:
            below = _mesh_nodes(scene, node, motions)
            if not below and not any(node in ancestors(scene.skeleton, each) for each in colliders):
                raise NotFoundError(f"{scene.skeleton.label(node)} has no mesh to collide with")
            for each in below:
                if each not in colliders:
                    colliders[each] = Collider(_shape(scene, each, kind), chosen.material)
    return replace(description, motions=motions, colliders=colliders)


def split_by_mesh(scene: Scene, nodes: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the nodes with a mesh of their own as bodies, and those without: all with one if none has.

    A pattern also matches joints, cameras, and groups whose meshes are bodies themselves.
    """
    found = [bool(_mesh_nodes(scene, node, nodes)) for node in nodes]
    if not any(found):
        return nodes, ()
    with_mesh = tuple(node for node, has in zip(nodes, found, strict=True) if has)
    return with_mesh, tuple(node for node, has in zip(nodes, found, strict=True) if not has)


def _mesh_nodes(scene: Scene, top: int, motions: Collection[int]) -> list[int]:
    """Nodes with a mesh at or below `top`, without those of another body below it."""
    found = []
    for instance in scene.instances:
        chain = ancestors(scene.skeleton, instance.node)
        if top in chain and not set(chain[: chain.index(top)]) & set(motions):
            found.append(instance.node)
    return found


def _shape(scene: Scene, node: int, kind: str) -> Shape:
    instance = next(each for each in scene.instances if each.node == node)
    label = scene.skeleton.label(node)
    if instance.skin is not None:
        raise UnsupportedError(f"{label} is skinned: a rigid body moves by its node alone")
    try:
        return mesh_shape(instance.mesh, kind, instance.weights)
    except RangeError as error:  # the mesh is a value of the file
        raise FormatError(error.problem).at(label) from None
    except AnimError as error:
        raise error.at(label) from None

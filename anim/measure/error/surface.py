"""Surfaces on which an error is measured: vertices, or small cubes on the nodes of scenes without any."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import accumulate, groupby
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.model import MeshInstance, Scene
from anim.sampling import rest_world

SHELL = 0.01  # of the reference length: half the edge of a cube around a node without vertices, usual radius of a shell
MIN_EXTENT = 1e-6  # m; a smaller diagonal says nothing about the size of what is seen from, or hangs on, its nodes

NUM_CORNERS = 8  # of such a cube
MERGED_POINTS = 1 << 15  # of surfaces that become one: more than costs a few calls of numpy, less than takes memory


class Surface(NamedTuple):
    """Vertices with one set of joints.

    name: of the mesh or node, for reports. nodes: (J,) the joints, or the one node of a rigid mesh.
    bind: (J, 3, 4) joint_from_mesh at bind time. points: (V, 3) m, in mesh space; those of merged joints, which are
    measured only (`anim.measure.error.merged_groups`), are (V, I, 3), in the joints' spaces. targets: (M, V, 3).
    joints, weights: (V, I), into `nodes`. owner: the node with the morph weights, and their values at rest (M,).
    """

    name: str
    nodes: Ints
    bind: Floats
    points: Floats
    targets: Floats
    joints: Ints
    weights: Floats
    owner: int
    rest_weights: Floats

    @property
    def is_rigid(self) -> bool:
        """Return whether all points follow the same joint, with weight 1."""
        return (
            len(self.nodes) == 1 == self.weights.shape[1] and len(self.points) > 0 and bool((self.weights == 1).all())
        )


def has_vertices(scene: Scene) -> bool:
    """Return whether any mesh of the scene has a vertex."""
    return any(len(instance.mesh.positions) for instance in scene.instances)


def is_measured_at(scene: Scene) -> str:
    """Return the word for the points of error measures: "surface", or "nodes" without any vertex."""
    return "surface" if has_vertices(scene) else "nodes"


def surfaces(scene: Scene) -> list[Surface]:
    """Return one surface per mesh instance; without any vertex, one per node."""
    return _of_instances(scene) or list(_of_nodes(scene))


def node_cubes(scene: Scene, diagonal: float) -> Floats:
    """Return the corners (N, 8, 3) of the cubes around all nodes of a scene without vertices, in the nodes' spaces.

    diagonal: m, of the scene. All are the same: a view of one cube.
    """
    sides = (-1.0, 1.0)
    cube = SHELL * reference_length(diagonal) * np.array([[x, y, z] for x in sides for y in sides for z in sides])
    return np.broadcast_to(cube, (len(scene.skeleton), *cube.shape))


def reference_length(diagonal: float) -> float:
    """Return the length, m, whose fractions are distances around nodes that move no vertex.

    It is the scene's diagonal; a metre if that is 0, as of a single camera: its rotation is an error too.
    """
    return diagonal if diagonal > MIN_EXTENT else 1.0


def diagonal(scene: Scene) -> float:
    """Return the diagonal of the scene's bounding box in its rest pose, in metres; 0 of an empty one.

    Of the vertices, skinned and morphed; of the nodes without any vertex.
    """
    world = rest_world(scene.skeleton)
    meshes = merge_small_surfaces(_of_instances(scene))
    points = [place_points(surface, world[surface.nodes], surface.rest_weights) for surface in meshes]
    every = np.concatenate(points or [world[:, :, 3]])
    return float(np.linalg.norm(every.max(axis=0) - every.min(axis=0))) if len(every) else 0.0


def merge_small_surfaces(found: Iterable[Surface]) -> Iterator[Surface]:
    """Yield the same points in the same order, neighbors without morph targets as one surface without a name.

    Only those with equal numbers of influences: work per surface, in files of many, is work per few thousand points.
    """
    listed = list(found)
    starts = accumulate((len(each.points) for each in listed), initial=0)
    numbered = zip(listed, starts, range(len(listed)), strict=False)
    for _, run in groupby(numbered, lambda each: _mergeable(*each)):
        yield _merge([each for each, _, _ in run])


def _mergeable(surface: Surface, start: int, number: int) -> tuple[int, int]:
    """A key that neighbors share which become one surface. start: the number of points before."""
    if len(surface.rest_weights) or len(surface.points) > MERGED_POINTS:
        return -1, number
    return surface.joints.shape[1], start // MERGED_POINTS


def _merge(parts: list[Surface]) -> Surface:
    if len(parts) == 1:
        return parts[0]
    sizes = [len(each.points) for each in parts]
    firsts = np.cumsum([0, *(len(each.nodes) for each in parts[:-1])])
    return Surface(
        "",
        np.concatenate([each.nodes for each in parts]),
        np.concatenate([each.bind for each in parts]),
        np.concatenate([each.points for each in parts]),
        np.empty((0, sum(sizes), 3)),
        np.concatenate([each.joints for each in parts]) + np.repeat(firsts, sizes)[:, None],
        np.concatenate([each.weights for each in parts]),
        -1,
        np.empty(0),
    )


def place_points(surface: Surface, world: Floats, weights: Floats) -> Floats:
    """Return the points (V, 3) in world space: morphed by weights (M,), then blended linearly.

    world: matrices of the joints (J, 3, 4).
    """
    return skin_points(surface, morph_points(surface, weights[None])[0], matrix.multiply(world, surface.bind))


def morph_points(surface: Surface, weights: Floats) -> Floats:
    """Return the points (F, V, 3) in mesh space, morphed by weights (F, M)."""
    if not len(surface.targets) and len(weights) == 1:
        return surface.points[None]
    moving = np.flatnonzero(weights.any(axis=0))
    moved = weights[:, moving] @ surface.targets[moving].reshape(len(moving), surface.points.size)
    return np.asarray(surface.points + moved.reshape(len(weights), *surface.points.shape))


def skin_points(surface: Surface, points: Floats, bound: Floats) -> Floats:
    """Return points (V, 3) of mesh space in world space, blended linearly by matrices (J, 3, 4)."""
    moved = np.zeros_like(points)
    for i in range(surface.joints.shape[1]):
        chosen = bound[surface.joints[:, i]]
        moved += surface.weights[:, i, None] * (np.einsum("vij,vj->vi", chosen[..., :3], points) + chosen[..., 3])
    return moved


def _of_instances(scene: Scene) -> list[Surface]:
    """The surfaces of all instances with vertices; those without a skin share arrays of joints and weights."""
    rigid: dict[int, tuple[Floats, Ints, Floats]] = {}
    return [_of_instance(scene, each, rigid) for each in scene.instances if len(each.mesh.positions)]


def _of_instance(scene: Scene, instance: MeshInstance, rigid: dict[int, tuple[Floats, Ints, Floats]]) -> Surface:
    """rigid: bind, joints and weights of meshes without a skin, by their number of vertices; added to."""
    mesh, count = instance.mesh, len(instance.mesh.positions)
    name = mesh.name or scene.skeleton.display_name(instance.node)
    if instance.skin is not None:
        carried = (instance.skin.joints, instance.skin.inverse_bind, mesh.joints, mesh.weights)
    else:
        if count not in rigid:
            rigid[count] = _rigid(count)
        carried = (np.array([instance.node], np.int64), *rigid[count])
    nodes, bind, joints, weights = carried
    return Surface(name, nodes, bind, mesh.positions, mesh.targets, joints, weights, instance.node, instance.weights)


def _of_nodes(scene: Scene) -> Iterator[Surface]:
    bind, joints, weights = _rigid(NUM_CORNERS)
    targets, no_weights = np.empty((0, NUM_CORNERS, 3)), np.empty(0)
    for node, cube in enumerate(node_cubes(scene, diagonal(scene))):
        name = scene.skeleton.display_name(node)
        yield Surface(name, np.array([node]), bind, cube, targets, joints, weights, node, no_weights)


def _rigid(vertices: int) -> tuple[Floats, Ints, Floats]:
    """Bind (1, 3, 4), joints (V, 1) and weights (V, 1) of vertices that follow one node."""
    return np.eye(4)[None, :3], np.zeros((vertices, 1), np.int64), np.ones((vertices, 1))

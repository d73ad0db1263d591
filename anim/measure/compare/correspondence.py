"""Correspondence of two scenes: nodes, and the joints of the first one's surfaces in the second.

Other tools rename, reorder, merge and quantize. Only motion is compared: the first scene's surface, its vertices and
skin weights, is moved by the joints of each scene. Quantized vertices are in another mesh space, as are the inverse
bind matrices for them; that space is computed from the vertices if they agree one by one, else from the inverse bind
matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.compare import mesh_space, name_matching
from anim.measure.compare.deformation import are_missing, is_reduced, same_influences, same_targets
from anim.measure.error.point_groups import Binding
from anim.measure.error.surface import Surface
from anim.model import MeshInstance, Scene, Skin
from anim.sampling import rest_pose
from anim.sampling.world import local_by_node


class Correspondence(NamedTuple):
    """Correspondence of two scenes.

    nodes: (N,) for each node of the first scene its index in the second, −1 without one.
    surfaces: of the first scene, with their joints in the second, None if it is the same scene.
    by_vertex: whether all meshes agree vertex by vertex, with their joints, weights and morph targets.
    unskinned, skinned: names of meshes with a skin in the first or second scene only. reweighted: names of meshes whose
    vertices agree, but not their joints, weights or morph targets. reduced: names of meshes that lost primitives.
    lost: names of meshes that the second scene lacks. has_meshes, had_meshes: False if only one scene has vertices.
    partners: nodes of both scenes whose meshes have the same vertices in the same order.
    """

    nodes: Ints
    surfaces: Sequence[tuple[Surface, Binding | None]]
    by_vertex: bool = True
    unskinned: tuple[str, ...] = ()
    skinned: tuple[str, ...] = ()
    reweighted: tuple[str, ...] = ()
    reduced: tuple[str, ...] = ()
    has_meshes: bool = True
    had_meshes: bool = True
    lost: tuple[str, ...] = ()
    partners: tuple[tuple[int, int], ...] = ()


def match_scenes(scene: Scene, other: Scene, surfaces: list[Surface]) -> Correspondence:
    """Return the correspondence of two scenes' nodes, and joints of the first's `surfaces` in the second.

    Surfaces of a node that the second scene lacks are moved by its nearest ancestor there, with the offset at rest: if
    the first scene's clip moves the node, that is an error.
    """
    if other is scene:
        same = tuple((each.node, each.node) for each in scene.instances)
        return Correspondence(np.arange(len(scene.skeleton)), [(surface, None) for surface in surfaces], partners=same)
    pairing = _SceneMatcher(scene, other, name_matching.match_nodes(scene, other))
    instances = [instance for instance in scene.instances if len(instance.mesh.positions)]
    if not instances:
        by_nodes = [(surface, pairing.by_nodes(surface)) for surface in surfaces]
        return Correspondence(pairing.nodes, by_nodes, had_meshes=not pairing.has_meshes)
    found: list[tuple[Surface, Binding | None]] = []
    unskinned: list[str] = []
    skinned: list[str] = []
    reweighted, reduced, by_vertex = [], [], True
    partners: list[tuple[int, int]] = []
    for number, (surface, instance) in enumerate(zip(surfaces, instances, strict=True)):
        partner = pairing.partner(number, instance)
        bare = None
        if partner is None:
            opposite = pairing.opposite(number, instance)
            bare = opposite if instance.skin is not None else None
            if opposite is not None:
                (skinned if bare is None else unskinned).append(surface.name)
            if pairing.is_reduced(number, instance):
                reduced.append(surface.name)
        carried = (
            pairing.carried(surface, instance, partner) if bare is None else pairing.rigid(surface, instance, bare)
        )
        found.append((surface, carried))
        if partner is not None and not _deform_alike(instance, partner, carried):
            reweighted.append(surface.name)
        if partner is not None:
            partners.append((instance.node, partner.node))
        by_vertex = by_vertex and partner is not None
    return Correspondence(
        pairing.nodes,
        found,
        by_vertex and not reweighted,
        tuple(unskinned),
        tuple(skinned),
        tuple(reweighted),
        tuple(reduced),
        pairing.has_meshes,
        lost=tuple(surfaces[i].name for i in pairing.lost(instances)),
        partners=tuple(partners),
    )


class _SceneMatcher:
    """Two scenes with their nodes, for the search of corresponding surfaces."""

    def __init__(self, scene: Scene, other: Scene, nodes: Ints) -> None:
        self._scene, self._other, self.nodes = scene, other, nodes
        self._new = [instance for instance in other.instances if len(instance.mesh.positions)]
        self._on_node = {instance.node: instance for instance in self._new}
        old = [instance.mesh.name for instance in scene.instances if len(instance.mesh.positions)]
        self._named = name_matching.match_by_name(old, [instance.mesh.name for instance in self._new]).tolist()
        self._skins = tuple(dict.fromkeys(each.skin for each in self._new if each.skin is not None))
        self._num_faces = [sum(len(each.mesh.faces) for each in one.instances) for one in (scene, other)]
        self._below_node: dict[int, list[MeshInstance]] = {}
        for each in self._new:
            self._below_node.setdefault(int(other.skeleton.parents[each.node]), []).append(each)
        self._local = local_by_node(scene.skeleton, rest_pose(scene.skeleton))[:, 0]
        self._places: dict[int, tuple[int, Floats]] = {}  # of nodes that the other scene lacks, as they are asked for

    def partner(self, number: int, instance: MeshInstance) -> MeshInstance | None:
        """The instance of the other scene with the same vertices: same node, same name, same order."""
        skinned = instance.skin is not None
        choices = [each for each in self._choices(number, instance) if (each.skin is not None) is skinned]
        return next((each for each in choices if mesh_space.same_vertices(instance.mesh, each.mesh)), None)

    def opposite(self, number: int, instance: MeshInstance) -> MeshInstance | None:
        """A skinned instance's partner without skin, or the reverse: by vertices, or by the node's name."""
        is_skinned = instance.skin is not None
        choices = [each for each in self._choices(number, instance) if (each.skin is not None) is not is_skinned]
        found = next((each for each in choices if mesh_space.same_vertices(instance.mesh, each.mesh)), None)
        there = self._on_node.get(int(self.nodes[instance.node]))
        name = self._scene.skeleton.names[instance.node]
        if found is None and there in choices and there and name and name == self._other.skeleton.names[there.node]:
            return there
        return found

    def is_reduced(self, number: int, instance: MeshInstance) -> bool:
        """Return whether an instance lost primitives that are in no other mesh (other tools split meshes)."""
        lost = [is_reduced(instance.mesh, each.mesh) for each in self._choices(number, instance)]
        return bool(lost) and all(lost) and self._num_faces[1] < self._num_faces[0]

    def lost(self, instances: Sequence[MeshInstance]) -> list[int]:
        """Indices of instances that the other scene lacks, if exactly their vertices are missing there."""
        found = [i for i, instance in enumerate(instances) if not self._choices(i, instance)]
        return found if are_missing(instances, found, self._new) else []

    @property
    def has_meshes(self) -> bool:
        """Return whether the other scene has vertices."""
        return bool(self._new)

    def rigid(self, surface: Surface, instance: MeshInstance, bare: MeshInstance) -> Binding:
        """A skinned surface on the node of its mesh, which has no skin in the other scene."""
        points, others = instance.mesh.positions, bare.mesh.positions
        space = (
            mesh_space.from_points(points, others)
            if mesh_space.same_vertices(instance.mesh, bare.mesh)
            else mesh_space.from_boxes(points, others)
        )
        bind = np.broadcast_to(mesh_space.IDENTITY if space is None else space, surface.bind.shape)
        found = Binding(np.full(len(surface.nodes), bare.node, np.int64), bind, bare.node, surface.rest_weights)
        return found._replace(rest_weights=bare.weights) if len(bare.weights) == len(surface.rest_weights) else found

    def _choices(self, number: int, instance: MeshInstance) -> list[MeshInstance]:
        """Candidates for an instance in the other scene: on the same node, of the same name, in order."""
        choices = [self._on_node.get(int(self.nodes[instance.node]))]
        choices.append(self._new[self._named[number]] if self._named[number] >= 0 else None)
        choices.append(self._new[number] if len(self._new) == len(self._named) else None)
        return [each for each in choices if each is not None]

    def carried(self, surface: Surface, instance: MeshInstance, partner: MeshInstance | None) -> Binding:
        """Joints of an instance's surface in the other scene."""
        if instance.skin is None:
            found = self._rigid(surface, instance, partner)
        else:
            found = self._skinned(surface, instance.skin, instance, partner)
        morphing = partner or self._on_node.get(int(self.nodes[instance.node])) or self._below(instance)
        if morphing is None or len(morphing.weights) != len(surface.rest_weights):
            return found._replace(owner=int(self.nodes[instance.node]))
        return found._replace(owner=morphing.node, rest_weights=morphing.weights)

    def by_nodes(self, surface: Surface) -> Binding:
        """Joints of a surface without a partner, from the correspondence of nodes alone."""
        nodes, joints = np.unique(surface.nodes, return_inverse=True)
        places = [self._place(node) for node in nodes.tolist()]
        there = np.array([node for node, _ in places], np.int64)[joints]
        local = np.array([local for _, local in places]).reshape(-1, 3, 4)
        carried = (local != mesh_space.IDENTITY).any(axis=(1, 2))[joints]
        bind = surface.bind.copy()
        bind[carried] = matrix.multiply(local[joints[carried]], bind[carried])
        return Binding(there, bind, -1, surface.rest_weights)

    def _rigid(self, surface: Surface, instance: MeshInstance, partner: MeshInstance | None) -> Binding:
        node = int(self.nodes[instance.node])
        there = partner or self._on_node.get(node)
        if there is None or there.skin is not None:
            return self.by_nodes(surface)
        points, others = instance.mesh.positions, there.mesh.positions
        space = mesh_space.from_points(points, others) if partner is not None else mesh_space.from_boxes(points, others)
        if space is None:  # merged with others: only the nodes are known
            return self._above(surface)
        return Binding(np.array([there.node]), space[None], -1, surface.rest_weights)

    def _skinned(self, surface: Surface, skin: Skin, instance: MeshInstance, partner: MeshInstance | None) -> Binding:
        """Joints of a skinned surface: of the skin that has most of them, the others by their nodes."""
        skins = self._skins if partner is None or partner.skin is None else (partner.skin,)
        matched = [(new, self._joints(skin, new)) for new in skins]
        if not matched:
            return self.by_nodes(surface)
        new, joints = max(matched, key=lambda each: int((each[1] >= 0).sum()))
        found = joints >= 0
        guess = None if partner is None else mesh_space.from_points(instance.mesh.positions, partner.mesh.positions)
        matched_bind = new.inverse_bind[joints[found]]
        space = mesh_space.from_binds(skin.inverse_bind[found], matched_bind, guess)
        if space is not mesh_space.IDENTITY:
            matched_bind = matrix.multiply(matched_bind, space)
        carried = self.by_nodes(surface)
        carried.nodes[found] = new.joints[joints[found]]
        carried.bind[found] = matched_bind
        return carried

    def _joints(self, old: Skin, new: Skin) -> Ints:
        """For each joint of a skin (J,) its index in another skin's list, −1 without one."""
        place = {node: i for i, node in enumerate(new.joints.tolist())}
        return np.array([place.get(node, -1) for node in self.nodes[old.joints].tolist()], np.int64)

    def _above(self, surface: Surface) -> Binding:
        """Joint of a surface of one node without regard to that node's own partner."""
        node = int(surface.nodes[0])
        parent, local = self._place(int(self._scene.skeleton.parents[node]))
        bind = matrix.multiply(matrix.multiply(local, self._local[node]), surface.bind)
        return Binding(np.array([parent]), bind, -1, surface.rest_weights)

    def _place(self, node: int) -> tuple[int, Floats]:
        """The other scene's node for a node, −1 for the world, and the transform between them at rest."""
        path = []
        while node >= 0 and self.nodes[node] < 0 and node not in self._places:
            path.append(node)
            node = int(self._scene.skeleton.parents[node])
        there, local = self._places.get(node) or (int(self.nodes[node]) if node >= 0 else -1, mesh_space.IDENTITY)
        for each in reversed(path):
            local = matrix.multiply(local, self._local[each])
            self._places[each] = there, local
        return there, local

    def _below(self, instance: MeshInstance) -> MeshInstance | None:
        """The only instance on a child of an instance's partner node: other tools put meshes there."""
        node = int(self.nodes[instance.node])
        children = self._below_node.get(node, []) if node >= 0 else []
        return children[0] if len(children) == 1 else None


def _deform_alike(old: MeshInstance, new: MeshInstance, carried: Binding) -> bool:
    """Return whether two instances of the same vertices have the same joints, weights and morph targets."""
    space = mesh_space.from_points(old.mesh.positions, new.mesh.positions)
    if not same_targets(old.mesh, new.mesh, space):
        return False
    if old.skin is None or new.skin is None:
        return True
    return same_influences(old.mesh, carried.nodes, new.mesh, new.skin.joints)

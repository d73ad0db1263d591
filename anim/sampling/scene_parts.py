"""The part of a scene that clips move, for work on clips that each move few of many nodes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Clip, MeshInstance, Scene, Skeleton, Skin, Track, parse_weight_pointer

MIN_NODES = 64  # of a scene that is divided: with fewer a part saves nothing
MAX_NODE_FRACTION = 0.25  # of the nodes, in a part


class ScenePart(NamedTuple):
    """Some nodes and mesh instances of a scene, which some clips move, with all that their positions depend on.

    scene: with these only; nodes without a name are called as in reports on the whole scene. nodes: (K,) their indices
    in the whole scene, increasing.
    """

    scene: Scene
    nodes: Ints

    def into(self, clip: Clip) -> Clip:
        """Return a clip of the whole scene for the part."""
        return select_tracks(clip, self.nodes)

    def out_of(self, clip: Clip) -> Clip:
        """Return a clip of the part for the whole scene."""
        nodes = self.nodes.tolist()
        return Clip(clip.name, tuple(t if t.node is None else _on_node(t, nodes[t.node]) for t in clip.tracks))


class SceneDivider:
    """Finds the parts of one scene; what all parts need is computed once.

    scene: whose parts are asked for. max_nodes: of a part; 0 for a scene that is not divided.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        skeleton = scene.skeleton
        self.max_nodes = int(MAX_NODE_FRACTION * len(skeleton)) if len(skeleton) >= MIN_NODES else 0
        if not self.max_nodes:
            return
        self._parents = skeleton.parents.tolist()
        first, end = skeleton.subtrees()
        self._order = np.argsort(first).tolist()
        self._first, self._end = first.tolist(), end.tolist()
        self._instances: dict[int, list[int]] = {}
        for i, each in enumerate(scene.instances):
            for node in {each.node, *_joints(each)}:
                self._instances.setdefault(node, []).append(i)
        sizes = {len(each.mesh.positions): i for i, each in reversed(list(enumerate(scene.instances)))}
        sizes.pop(0, None)
        self._smallest = sizes[min(sizes)] if sizes else -1

    def part(self, clips: Sequence[Clip]) -> ScenePart | None:
        """Return the part that clips move; None if that is none or too large, or if they have pointers to weights.

        A scene with vertices has some in each part, moved or not: what is measured depends on whether it has any.
        """
        found = self._find(clips)
        if found is None:
            return None
        kept, instances = found
        nodes = np.array(sorted(kept), np.int64)
        return ScenePart(Scene(select_nodes(self.scene.skeleton, nodes), _carry(instances, nodes)), nodes)

    def part_nodes(self, clips: Sequence[Clip]) -> frozenset[int] | None:
        """Return the nodes of that part; None without one."""
        found = self._find(clips)
        return None if found is None else frozenset(found[0])

    def batches(self, clips: Sequence[Clip], max_values: int) -> Iterator[tuple[list[int], ScenePart | None]]:
        """Yield the indices of all clips, those of some with the part that they move.

        Clips without a small part come in one batch, with None. The others are together as long as the product of
        their number and that of their nodes is at most `max_values`.
        """
        nodes = [self.part_nodes([clip]) for clip in clips]
        if large := [i for i, each in enumerate(nodes) if each is None]:
            yield large, None
        some: list[int] = []
        union: frozenset[int] = frozenset()
        small = ((min(each), i, each) for i, each in enumerate(nodes) if each is not None)
        for _, i, own in sorted(small, key=lambda each: each[:2]):
            both = union | own
            if some and len(both) > min(self.max_nodes, max_values // (len(some) + 1)):
                yield some, self.part([clips[k] for k in some])
                some, both = [], own
            some.append(i)
            union = both
        if some:
            yield some, self.part([clips[k] for k in some])

    def _find(self, clips: Sequence[Clip]) -> tuple[set[int], list[MeshInstance]] | None:
        moved = self._moved_nodes(clips)
        if moved is None:
            return None
        chosen = {i for node in moved for i in self._instances.get(node, ())}
        if self._smallest >= 0 and not any(len(self.scene.instances[i].mesh.positions) for i in chosen):
            chosen.add(self._smallest)
        instances = [self.scene.instances[i] for i in sorted(chosen)]
        kept = self._with_ancestors(moved.union(*({each.node, *_joints(each)} for each in instances)))
        return (kept, instances) if moved and len(kept) <= self.max_nodes else None

    def _moved_nodes(self, clips: Iterable[Clip]) -> set[int] | None:
        """The nodes that clips move, by a track of their own or of an ancestor, and those with animated weights.

        None if there are too many for a part, or if the clips have pointers to morph weights.
        """
        found: set[int] = set()
        for track in (track for clip in clips for track in clip.tracks) if self.max_nodes else ():
            if track.node is None:
                if parse_weight_pointer(track.pointer) is not None:
                    return None
                continue
            first, end = self._first[track.node], self._end[track.node]
            if end - first > self.max_nodes or len(found) > self.max_nodes:
                return None
            found.update(self._order[first:end])
        return found if self.max_nodes else None

    def _with_ancestors(self, nodes: Iterable[int]) -> set[int]:
        found: set[int] = set()
        for node in nodes:
            while node >= 0 and node not in found:
                found.add(node)
                node = self._parents[node]
        return found


def select_nodes(skeleton: Skeleton, nodes: Ints) -> Skeleton:
    """Return the skeleton of some nodes (K,), at least one, increasing, with all of their ancestors among them."""
    parents = skeleton.parents[nodes]
    sheared = _find(skeleton.sheared, nodes)
    morphed = [skeleton.morphed[i] for i in _find(skeleton.derive(_morphed_nodes), nodes).tolist()]
    return Skeleton(
        tuple(map(skeleton.display_name, nodes.tolist())),
        np.where(parents < 0, -1, np.searchsorted(nodes, parents)),
        skeleton.translation[nodes],
        skeleton.rotation[nodes],
        skeleton.scale[nodes],
        np.searchsorted(nodes, skeleton.sheared[sheared]),
        skeleton.sheared_local[sheared],
        tuple(each._replace(node=int(np.searchsorted(nodes, each.node))) for each in morphed),
    )


def _morphed_nodes(skeleton: Skeleton) -> Floats:
    return np.array([each.node for each in skeleton.morphed], np.float64)


def _find(values: Ints | Floats, nodes: Ints) -> Ints:
    """The indices of those of values (X,) that are among nodes (K,), at least one, increasing."""
    places = np.minimum(np.searchsorted(nodes, values), len(nodes) - 1)
    return np.flatnonzero(nodes[places] == values)


def select_tracks(clip: Clip, nodes: Ints) -> Clip:
    """Return the clip with its tracks of some nodes (K,), for the skeleton of these, and its tracks without a node."""
    index: dict[int | None, int] = {node: i for i, node in enumerate(nodes.tolist())}
    chosen = (track for track in clip.tracks if track.node is None or track.node in index)
    return Clip(clip.name, tuple(t if t.node is None else _on_node(t, index[t.node]) for t in chosen))


def _joints(instance: MeshInstance) -> list[int]:
    return [] if instance.skin is None else instance.skin.joints.tolist()


def _carry(instances: Iterable[MeshInstance], nodes: Ints) -> tuple[MeshInstance, ...]:
    """The instances on a skeleton of some nodes (K,); instances with the same skin have the same one there too."""
    skins: dict[Skin, Skin] = {}
    found = []
    for each in instances:
        skin = each.skin
        if skin is not None and skin not in skins:
            skins[skin] = replace(skin, joints=np.searchsorted(nodes, skin.joints))
        moved = None if skin is None else skins[skin]
        found.append(replace(each, node=int(np.searchsorted(nodes, each.node)), skin=moved))
    return tuple(found)


def _on_node(track: Track, node: int) -> Track:
    return Track.unchecked(
        node,
        track.path,
        track.interpolation,
        track.time_axis,
        track.values,
        track.in_tangents,
        track.out_tangents,
        track.pointer,
        track.storage,
    )

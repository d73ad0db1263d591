"""Many short clips measured at once: as one clip, on copies of the scene side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.whole_scene import WholeScene
from anim.model import Clip, MeshInstance, Scene, Skeleton, Track
from anim.model.track import share_time_axes
from anim.sampling.scene_parts import SceneDivider

MIN_CLIPS = 8  # of a group; fewer are measured by themselves
MAX_NODES = 999  # of the copies: proofs of larger skeletons take smaller steps
MAX_VERTICES = 50_000  # of the copies: above it calls of numpy cost little

Pair: TypeAlias = tuple[Clip, Clip]  # before and after


class ScenePair(NamedTuple):
    """Two versions of a clip on a scene."""

    scene: Scene
    before: Clip
    after: Clip

    def fills(self, fraction: float) -> bool:
        """Return whether the scene takes more than a fraction of what is measured together."""
        return len(self.scene.skeleton) > fraction * MAX_NODES or self.scene.vertex_count > fraction * MAX_VERTICES


def largest_error_of(prover: Prover, pairs: Iterable[Pair]) -> Proof | None:
    """Return the largest error of clips, each before and after, and a bound for all; None without clips.

    As by `largest_error` for one after the other, on one scene. Short clips with the same key times are measured
    together, so that thousands don't take milliseconds each.
    """
    scene, measured, floor = prover.ruler.scene, [], 0.0
    for group in _groups(scene, pairs):
        found = largest_error(*_side_by_side(prover, group), floor=floor)
        floor = max(floor, found.error.max_error)
        measured.append(found)
    return worst_proof(measured)


def worst_proof(measured: Sequence[Proof]) -> Proof | None:
    """Return the largest of measured errors with the largest bound, None if one is unproven; None without any."""
    if not measured:
        return None
    worst = max(measured, key=lambda each: each.error.max_error)
    bounds = [each.bound for each in measured if each.bound is not None]
    return worst._replace(bound=max(bounds) if len(bounds) == len(measured) else None)


def _groups(scene: Scene, pairs: Iterable[Pair]) -> Iterator[list[ScenePair]]:
    """Yield clips that are keyed at the same times by the same interpolations, as many as are measured together.

    Clips that move few of many nodes are on the parts of the scene that they move.
    """
    divider, alike = SceneDivider(scene), dict[object, list[ScenePair]]()
    for n, pair in enumerate(pairs):
        part = divider.part(pair)
        own = ScenePair(scene, *pair) if part is None else ScenePair(part.scene, *map(part.into, pair))
        tracks = [track for clip in pair for track in clip.tracks]
        if own.fills(1 / MIN_CLIPS) or any(track.node is None for track in tracks):
            alike[n] = [own]
            continue
        axes = dict.fromkeys((track.time_axis, track.interpolation) for track in tracks)
        alike.setdefault(frozenset((axis.times.tobytes(), kind) for axis, kind in axes), []).append(own)
    for group in alike.values():
        yield from _fill(group) if len(group) >= MIN_CLIPS else ([each] for each in group)


def _fill(group: Sequence[ScenePair]) -> Iterator[list[ScenePair]]:
    """Yield as many clips as fit side by side, one group after the other."""
    some: list[ScenePair] = []
    nodes = vertices = 0
    for each in group:
        nodes, vertices = nodes + len(each.scene.skeleton), vertices + each.scene.vertex_count
        if some and (nodes > MAX_NODES or vertices > MAX_VERTICES):
            yield some
            some, nodes, vertices = [], len(each.scene.skeleton), each.scene.vertex_count
        some.append(each)
    if some:
        yield some


def _side_by_side(prover: Prover, group: Sequence[ScenePair]) -> tuple[Prover, Clip, Clip]:
    """Several clips as one, each on a copy of the scene of its own."""
    ruler = prover.ruler
    if len(group) == 1 and group[0].scene is ruler.scene:
        return prover, group[0].before, group[0].after
    scenes = [each.scene for each in group]
    offsets = np.cumsum([0, *(len(each.skeleton) for each in scenes[:-1])]).tolist()
    before, after = (_as_one(clips, offsets) for clips in zip(*((e.before, e.after) for e in group), strict=True))
    scene = _join(scenes, offsets)
    whole = WholeScene.of(scene, ruler.diagonal)
    whole = whole._replace(num_vertices=max(whole.num_vertices, ruler.whole.num_vertices))
    return Prover(ErrorMetric(scene, shell=ruler.shell, clips=(before, after), whole=whole)), before, after


def _as_one(clips: Sequence[Clip], offsets: Sequence[int]) -> Clip:
    tracks = (_moved(track, offset) for offset, clip in zip(offsets, clips, strict=True) for track in clip.tracks)
    return Clip("", tuple(share_time_axes(tracks)))


def _moved(track: Track, nodes: int) -> Track:
    return track if track.node is None else replace(track, node=track.node + nodes)


def _join(scenes: Sequence[Scene], offsets: Sequence[int]) -> Scene:
    """Scenes as one, where they are. offsets: index of the first node of each."""
    parts = [each.skeleton for each in scenes]
    both = list(zip(parts, offsets, strict=True))
    skeleton = Skeleton(
        tuple(one.display_name(node) for one in parts for node in range(len(one))),
        np.concatenate([np.where(one.parents < 0, -1, one.parents + offset) for one, offset in both]),
        np.concatenate([one.translation for one in parts]),
        np.concatenate([one.rotation for one in parts]),
        np.concatenate([one.scale for one in parts]),
        np.concatenate([one.sheared + offset for one, offset in both]),
        np.concatenate([one.sheared_local for one in parts]),
        tuple(each._replace(node=each.node + offset) for one, offset in both for each in one.morphed),
    )
    pairs = zip(scenes, offsets, strict=True)
    return Scene(skeleton, tuple(_copy(each, offset) for scene, offset in pairs for each in scene.instances))


def _copy(instance: MeshInstance, nodes: int) -> MeshInstance:
    skin = instance.skin
    moved = None if skin is None else replace(skin, joints=skin.joints + nodes)
    return replace(instance, node=instance.node + nodes, skin=moved)

"""Many short clips measured at once: as one clip, on copies of the scene side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip, MeshInstance, Scene, Skeleton, Track
from anim.model.track import share_time_axes

MIN_CLIPS = 8  # of a group; fewer are measured by themselves
MAX_NODES = 999  # of the copies: proofs of larger skeletons take smaller steps
MAX_VERTICES = 50_000  # of the copies: above it calls of numpy cost little

Pair: TypeAlias = tuple[Clip, Clip]  # before and after


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


def _groups(scene: Scene, pairs: Iterable[Pair]) -> Iterator[list[Pair]]:
    """Yield clips that are keyed at the same times by the same interpolations, as many as are measured together."""
    most = min(MAX_NODES // max(len(scene.skeleton), 1), MAX_VERTICES // max(scene.vertex_count, 1))
    alike: dict[object, list[Pair]] = {}
    for n, pair in enumerate(pairs):
        tracks = [track for clip in pair for track in clip.tracks]
        if most < MIN_CLIPS or any(track.node is None for track in tracks):
            alike[n] = [pair]
            continue
        axes = dict.fromkeys((track.time_axis, track.interpolation) for track in tracks)
        alike.setdefault(frozenset((axis.times.tobytes(), kind) for axis, kind in axes), []).append(pair)
    for group in alike.values():
        size = most if len(group) >= MIN_CLIPS else 1
        yield from (group[start : start + size] for start in range(0, len(group), size))


def _side_by_side(prover: Prover, group: Sequence[Pair]) -> tuple[Prover, Clip, Clip]:
    """Several clips as one, each on a copy of the scene of its own."""
    if len(group) == 1:
        return prover, *group[0]
    scene = prover.ruler.scene
    before, after = (_as_one(clips, len(scene.skeleton)) for clips in zip(*group, strict=True))
    return Prover(ErrorMetric(_copies(scene, len(group)), clips=(before, after))), before, after


def _as_one(clips: Sequence[Clip], num_nodes: int) -> Clip:
    tracks = (_moved(track, copy * num_nodes) for copy, clip in enumerate(clips) for track in clip.tracks)
    return Clip("", tuple(share_time_axes(tracks)))


def _moved(track: Track, nodes: int) -> Track:
    assert track.node is not None
    return replace(track, node=track.node + nodes)


def _copies(scene: Scene, count: int) -> Scene:
    """The scene `count` times, all in one place."""
    one = scene.skeleton
    offsets = np.arange(count) * len(one)
    skeleton = Skeleton(
        tuple(map(one.display_name, range(len(one)))) * count,
        np.where(one.parents < 0, -1, one.parents + offsets[:, None]).ravel(),
        np.tile(one.translation, (count, 1)),
        np.tile(one.rotation, (count, 1)),
        np.tile(one.scale, (count, 1)),
        (one.sheared + offsets[:, None]).ravel(),
        np.tile(one.sheared_local, (count, 1, 1)),
        tuple(each._replace(node=each.node + offset) for offset in offsets.tolist() for each in one.morphed),
    )
    return Scene(skeleton, tuple(_copy(each, offset) for offset in offsets.tolist() for each in scene.instances))


def _copy(instance: MeshInstance, nodes: int) -> MeshInstance:
    skin = instance.skin
    moved = None if skin is None else replace(skin, joints=skin.joints + nodes)
    return replace(instance, node=instance.node + nodes, skin=moved)

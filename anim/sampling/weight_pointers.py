"""Morph weights animated by JSON pointers, as tracks of the nodes that they move.

`/meshes/3/weights` moves every node with mesh 3, except those with weights of their own, which replace the mesh's
(glTF 2.0, node.weights); `/nodes/3/weights/1` and `/meshes/3/weights/1` set one weight beside the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats, unique_sorted
from anim.model import Clip, Interpolation, MorphedNode, Skeleton, Track, WeightPointer, parse_weight_pointer
from anim.sampling import derivatives
from anim.sampling.track import sample

Column: TypeAlias = tuple[int, int]  # index of a track and of its component; (−1, i) for the weight i at rest
Found: TypeAlias = dict[WeightPointer, int]  # index of the track of each pointer


def resolve_weight_pointers(skeleton: Skeleton, clip: Clip) -> Clip:
    """Return the clip with a track of weights for each node that pointers move, in place of the pointers' tracks.

    The clip itself without such pointers; those that move nothing stay (`ineffective_weight_pointers`). A node's own
    track precedes its own weights at rest, and these the tracks of its mesh; the track of a single weight precedes that
    of all weights of the same owner. Of two tracks of one pointer the last one counts.
    """
    sources = _sources(skeleton, clip)
    if not sources:
        return clip
    used = {track for columns in sources.values() for track, _ in columns}
    merged: dict[tuple[tuple[Column, ...], tuple[float, ...]], Track] = {}
    made = []
    for each in skeleton.morphed:
        columns = sources.get(each.node)
        if columns is not None:
            key = columns, each.weights
            merged[key] = merged.get(key) or _merge(clip.tracks, each, columns)  # once for all nodes of a mesh
            made.append(replace(merged[key], node=each.node))
    kept = (
        track
        for i, track in enumerate(clip.tracks)
        if i not in used and not (track.path == "weights" and track.node in sources)
    )
    return Clip(clip.name, (*kept, *made))


def ineffective_weight_pointers(skeleton: Skeleton, clip: Clip) -> list[str]:
    """Return the pointers of a clip to morph weights that there are not, or that those of all nodes replace.

    Of two tracks of one pointer the last one counts, so the pointer itself has an effect.
    """
    pointers = [track.pointer or "" for track in clip.tracks if track.path == "pointer" and _parse(track) is not None]
    if not pointers:
        return []
    used = {clip.tracks[i].pointer for columns in _sources(skeleton, clip).values() for i, _ in columns if i >= 0}
    return list(dict.fromkeys(each for each in pointers if each not in used))


def moved_nodes(skeleton: Skeleton, track: Track) -> list[int]:
    """Return the nodes that a track can move: its own, or those with the morph weights that it points to."""
    pointer = None if track.node is not None else _parse(track)
    if pointer is None:
        return [] if track.node is None else [track.node]
    is_node = pointer.owner == "nodes"
    return [each.node for each in skeleton.morphed if (each.node if is_node else each.mesh) == pointer.owner_index]


def _parse(track: Track) -> WeightPointer | None:
    return parse_weight_pointer(track.pointer)


def _sources(skeleton: Skeleton, clip: Clip) -> dict[int, tuple[Column, ...]]:
    """The source of each weight, by node, of the nodes that pointers move."""
    if not skeleton.morphed:
        return {}
    pointers = [(i, _parse(track)) for i, track in enumerate(clip.tracks) if track.path == "pointer"]
    found: Found = {pointer: i for i, pointer in pointers if pointer is not None}
    if not found:
        return {}
    plain = {track.node: i for i, track in enumerate(clip.tracks) if track.path == "weights"}
    sources = {each.node: tuple(_columns(each, clip, found, plain.get(each.node, -1))) for each in skeleton.morphed}
    pointed = set(found.values())
    return {node: columns for node, columns in sources.items() if pointed & {track for track, _ in columns}}


def _columns(each: MorphedNode, clip: Clip, found: Found, plain: int) -> Iterator[Column]:
    """The source of each of a node's weights. plain: index of its track of all weights, −1 for none."""
    count = len(each.weights)
    own = plain if plain >= 0 and clip.tracks[plain].values.shape[1] == count else -1
    whole = _with_width(clip, found, WeightPointer("meshes", each.mesh, None), count)
    for i in range(count):
        single = _with_width(clip, found, WeightPointer("nodes", each.node, i), 1)
        shared = _with_width(clip, found, WeightPointer("meshes", each.mesh, i), 1)
        if single >= 0:
            yield single, 0
        elif own >= 0 or each.has_own:
            yield own, i
        else:
            yield (shared, 0) if shared >= 0 else (whole, i)


def _with_width(clip: Clip, found: Found, pointer: WeightPointer, width: int) -> int:
    """Index of a pointer's track with so many values per key, −1 for none."""
    track = found.get(pointer, -1)
    return track if track >= 0 and clip.tracks[track].values.shape[1] == width else -1


def _merge(tracks: Sequence[Track], each: MorphedNode, columns: Sequence[Column]) -> Track:
    """One track of all weights (K, M): the same values at all times, up to rounding."""
    chosen = {i: tracks[i] for i in sorted({i for i, _ in columns if i >= 0})}
    moving = [track for track in chosen.values() if len(track.times) > 1] or list(chosen.values())[:1]
    kinds = {track.interpolation for track in moving}
    if len({track.time_axis for track in moving}) == 1 and len(kinds) == 1:
        axis, times = moving[0].time_axis, moving[0].times
        kind = moving[0].interpolation
    else:
        kind = _common_interpolation(kinds)
        times = _union_times(moving, kind)
        axis = None
    values = _assemble(each, columns, {i: sample(track, times) for i, track in chosen.items()})
    keys = times if axis is None else axis
    if kind is not Interpolation.CUBICSPLINE:
        return Track(each.node, "weights", kind, keys, values)
    still = each._replace(weights=(0.0,) * len(each.weights))
    arriving, leaving = (
        _assemble(still, columns, {i: derivatives.rates(t, times, before=before) for i, t in chosen.items()})
        for before in (True, False)
    )
    return Track(each.node, "weights", kind, keys, values, arriving, leaving)


def _common_interpolation(kinds: set[Interpolation]) -> Interpolation:
    if len(kinds) == 1:
        return next(iter(kinds))
    return Interpolation.CUBICSPLINE if Interpolation.CUBICSPLINE in kinds else Interpolation.LINEAR


def _union_times(tracks: Sequence[Track], kind: Interpolation) -> Floats:
    """Key times of all tracks; beside lines and splines also the last moment before each STEP key, for its jump."""
    every = [track.times for track in tracks]
    if kind is not Interpolation.STEP:
        steps = (track.times[1:] for track in tracks if track.interpolation is Interpolation.STEP)
        every += [np.nextafter(times, 0) for times in steps]
    return unique_sorted(np.concatenate(every))


def _assemble(each: MorphedNode, columns: Sequence[Column], values: dict[int, Floats]) -> Floats:
    """Values (K, M) of all columns, from those (K, C) of each track; of the weights at rest without a track."""
    count = len(next(iter(values.values())))
    rest = np.tile(each.weights, (count, 1))
    return np.stack([values[i][:, k] if i >= 0 else rest[:, k] for i, k in columns], axis=1)

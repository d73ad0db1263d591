"""Edits of documents that fixes share.

Every run of `inspect` imports this module: what only a fix needs is imported where it is used.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence
from anim.gltf.document import Document
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track

ROUNDING = 1e-4  # fraction of an angle between keys, by which it may grow when it is stored


def replace_clips(file: CheckedFile, clips: Mapping[int, Clip]) -> Document:
    """Return the document with these clips, by index; the same one if none of them has another track."""
    from anim.gltf.writing import writer

    changed = {}
    for number, new in clips.items():
        old = file.contents.clips[number]
        if len(new.tracks) != len(old.tracks) or any(map(operator.is_not, new.tracks, old.tracks)):
            changed[number] = new
    return writer.replace_clips(file.document, changed)


def edit_clips(file: CheckedFile, found: Sequence[Occurrence], edit: Callable[[Clip], Clip]) -> Document:
    """Return the document with edited clips of the occurrences."""
    numbers = sorted({each.number for each in found})
    return replace_clips(file, {number: edit(file.contents.clips[number]) for number in numbers})


def edit_tracks(file: CheckedFile, found: Sequence[Occurrence], edit: Callable[[Track], Track]) -> Document:
    """Return the document with edited tracks in the clips of the occurrences."""
    return edit_clips(file, found, lambda clip: replace(clip, tracks=tuple(map(edit, clip.tracks))))


def remove_tracks(clip: Clip, removed: Collection[int]) -> Clip:
    """Return the clip without tracks by index, of the same duration; of all of them the first stays, with one value."""
    from anim.optimization.tracks.clip_ends import single_key

    left = [track for i, track in enumerate(clip.tracks) if i not in removed]
    return keep_duration(clip, left or [single_key(clip.tracks[0])])


def remove_tracks_at(file: CheckedFile, path: str, targets: Collection[tuple[int, int]]) -> Document:
    """Return the document without tracks of a path. targets: clip and node of each."""
    new = {}
    for number in sorted({clip for clip, _ in targets}):
        clip = file.contents.clips[number]
        tracks = enumerate(clip.tracks)
        new[number] = remove_tracks(clip, [i for i, t in tracks if t.path == path and (number, t.node) in targets])
    return replace_clips(file, new)


def single_keys(clip: Clip, file: CheckedFile) -> Clip:
    """Return the clip with a single key in constant tracks, and of the same duration; splines may keep two."""
    from anim.measure.inspect.track_statistics import stats
    from anim.optimization.tracks.clip_ends import single_key
    from anim.sampling.batch import concatenate

    constant = stats(concatenate(clip.tracks), file.skeleton).constant
    several = [len(each.times) > 1 + (each.in_tangents is not None) for each in clip.tracks]
    tracks = [single_key(each) if constant[i] and several[i] else each for i, each in enumerate(clip.tracks)]
    return keep_duration(clip, tracks)


def keep_duration(clip: Clip, tracks: Sequence[Track]) -> Clip:
    """Return a clip of these tracks; the longest one is extended if they are shorter than the clip."""
    from anim.optimization.tracks.clip_ends import extend

    new = replace(clip, tracks=tuple(tracks))
    if new.start <= clip.start and new.end >= clip.end:
        return new
    longest = max(range(len(tracks)), key=lambda i: (len(tracks[i].times), tracks[i].times[-1]))
    extended = [extend(each, clip.start, clip.end) if i == longest else each for i, each in enumerate(tracks)]
    return replace(clip, tracks=tuple(extended))


def put_between(track: Track, widest: float) -> Track:
    """Return a LINEAR rotation track with keys, by slerp, between those that are further apart than `widest` rad."""
    from anim.operations.cubic_segments import with_distinct_keys

    if track.path != "rotation" or track.interpolation is not Interpolation.LINEAR or len(track.times) < 2:
        return track
    values = quaternion.normalize(track.values)
    before, after = values[:-1], values[1:]
    angles = 2 * np.arccos(np.clip(np.abs(quaternion.dot(before, after)), 0, 1))
    count = np.ceil(angles / (widest * (1 - ROUNDING))).astype(np.int64) - 1
    added = np.where(angles > widest, count, 0)
    if not added.any():
        return track
    at = np.repeat(np.arange(len(added)), added)
    u = (np.arange(len(at)) - np.repeat(np.cumsum(added) - added, added) + 1) / (added[at] + 1)
    start, length = track.times[at], track.times[at + 1] - track.times[at]
    times = (start + u * length).astype(np.float32).astype(np.float64)  # as the file stores them
    u = (times - start) / length
    between = quaternion.slerp(before[at], after[at], u)
    order = np.argsort(np.concatenate((np.arange(len(track.times)), at + u)), kind="stable")
    keys = (np.concatenate((track.times, times))[order], np.concatenate((track.values, between))[order])
    return with_distinct_keys(track, *keys, track.interpolation)


def rename_clips(document: Document, names: Mapping[int, str]) -> Document:
    """Return the document with other names of clips, by index."""
    animations = [
        {**each, "name": names[i]} if i in names else each for i, each in enumerate(document.json["animations"])
    ]
    return replace(document, json={**document.json, "animations": animations})


def rename_nodes(document: Document, names: Mapping[int, str]) -> Document:
    """Return the document with other names of nodes, by index."""
    nodes = [{**each, "name": names[i]} if i in names else each for i, each in enumerate(document.json["nodes"])]
    return replace(document, json={**document.json, "nodes": nodes})


def free_name(name: str, taken: set[str]) -> str:
    """Return a name that is not taken, with a number from 2 on if needed, and add it to those that are."""
    free = name if name not in taken else next(f"{name}_{i}" for i in count(2) if f"{name}_{i}" not in taken)
    taken.add(free)
    return free

"""Normalize rotation keys as glTF requires, except in tracks that were not unit in the file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.errors import AnimError, RangeError
from anim.gltf.document import Document
from anim.gltf.meshopt.storage import EncodedTrack
from anim.gltf.reading import reader
from anim.model import Clip, Track
from anim.model.track import BYTE_UNIT_TOLERANCE

MAX_ROTATIONS = 1 << 18  # of rotations that are looked at together


def normalize_new(document: Document, clips: Mapping[int, Clip]) -> Mapping[int, Clip]:
    """Return the clips, by index, with unit rotations; tracks that were not unit in the file are kept.

    `EncodedTrack`s are kept too. Raises RangeError for a rotation of length 0.
    """
    off = {
        i: _non_unit_tracks(clip, [n for n, t in enumerate(clip.tracks) if not isinstance(t, EncodedTrack)])
        for i, clip in clips.items()
    }
    if not any(off.values()):
        return clips
    before = _non_unit_targets(document)
    return {i: _normalize(clip, i, off[i], before.get(i, set())) for i, clip in clips.items()}


def _non_unit_targets(document: Document) -> dict[int, set[tuple[int | None, str]]]:
    """By clip, the targets of tracks with non-unit rotations in the document."""
    try:
        clips = reader.clips(document)
    except AnimError:  # unreadable animations are replaced as a whole
        return {}
    return {
        i: {clip.tracks[n].target for n in _non_unit_tracks(clip, range(len(clip.tracks)))}
        for i, clip in enumerate(clips)
    }


def _normalize(clip: Clip, number: int, off: list[int], before: set[tuple[int | None, str]]) -> Clip:
    tracks = list(clip.tracks)
    for n in off:
        lengths = _lengths(tracks[n].values)
        if not lengths.all():
            where = f"{reader.clip_label(clip.name, number)}, rotation of node {tracks[n].node}"
            raise RangeError(f"key {int(lengths.argmin())} is zero (expected a unit quaternion)", where=where)
        if tracks[n].target not in before:
            tracks[n] = _divide(tracks[n], lengths[:, None])
    return replace(clip, tracks=tuple(tracks))


def _non_unit_tracks(clip: Clip, chosen: Iterable[int]) -> list[int]:
    """The chosen tracks of a clip with non-unit rotations, many in one array: there can be thousands of short ones."""
    parts: list[list[int]] = []
    room = 0
    for n in chosen:
        if clip.tracks[n].path == "rotation":
            if room <= 0:
                parts.append([])
                room = MAX_ROTATIONS
            parts[-1].append(n)
            room -= len(clip.tracks[n].times)
    return [n for part in parts for n in _non_unit_part(clip, part)]


def _non_unit_part(clip: Clip, rotations: list[int]) -> list[int]:
    counts = [len(clip.tracks[n].times) for n in rotations]
    off = np.abs(_lengths(np.concatenate([clip.tracks[n].values for n in rotations])) - 1) > BYTE_UNIT_TOLERANCE
    if not off.any():
        return []
    has_any = np.logical_or.reduceat(off, np.cumsum([0, *counts[:-1]]))
    return [n for n, found in zip(rotations, has_any.tolist(), strict=True) if found]


def _lengths(rotations: Floats) -> Floats:
    lengths: Floats = np.sqrt(np.einsum("kc,kc->k", rotations, rotations))
    return lengths


def _divide(track: Track, lengths: Floats) -> Track:
    if track.in_tangents is None or track.out_tangents is None:
        return replace(track, values=track.values / lengths)
    before, after = track.in_tangents / lengths, track.out_tangents / lengths
    return replace(track, values=track.values / lengths, in_tangents=before, out_tangents=after)

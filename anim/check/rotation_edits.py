"""Edits of rotation keys that rules about motion mark."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.edits import replace_clips
from anim.check.finding import Occurrence
from anim.check.rotation_steps import RotationSteps, rotation_steps, steps_of
from anim.check.track_table import TrackTable
from anim.gltf.document import Document
from anim.maths import quaternion

MAX_PASSES = 30  # an edited key can mark its neighbors
Marks = Callable[[RotationSteps], Bools]  # the keys (S,) to edit
Edit = Callable[[Floats, Bools], Floats]  # keys (S, 4) and marks (S,) → the marked keys


def edit_rotations(file: CheckedFile, found: Sequence[Occurrence], marks: Marks, edit: Edit) -> Document:
    """Return the document with edited rotation keys in the clips of the occurrences, until none is marked."""
    new: dict[tuple[int, int], Floats] = {}
    for motion in rotation_steps(file):
        new |= _changed_keys(motion.table, _edited_keys(motion, marks, edit))
    return _with_keys(file, {key: keys for key, keys in new.items() if key[0] in {each.number for each in found}})


def _edited_keys(first: RotationSteps, marks: Marks, edit: Edit) -> Floats:
    """The keys (S, 4) of a table after the edits."""
    motion = first
    for _ in range(MAX_PASSES):
        marked = marks(motion)
        if not marked.any():
            break
        keys = motion.keys.copy()
        keys[marked] = quaternion.normalize(edit(motion.keys, marked))
        motion = steps_of(motion.table._replace(values=keys))
    signs = np.where(quaternion.dot(first.keys, first.table.values) < 0, -1.0, 1.0)
    same = (motion.keys == first.keys).all(axis=1)
    return np.where(same[:, None], first.table.values, motion.keys * signs[:, None])


def _changed_keys(table: TrackTable, values: Floats) -> dict[tuple[int, int], Floats]:
    """The keys (K, 4) of the tracks whose values (S, 4) differ from those of the table, by clip and node."""
    new = {}
    for clip, node, run in zip(table.clips.tolist(), table.nodes.tolist(), table.runs.tolist(), strict=True):
        keys = slice(table.starts[run], table.starts[run] + table.counts[run])
        if not np.array_equal(values[keys], table.values[keys]):
            new[clip, node] = values[keys]
    return new


def _with_keys(file: CheckedFile, new: Mapping[tuple[int, int], Floats]) -> Document:
    """The document with other keys of rotation tracks, by clip and node."""
    changed = {}
    for number in sorted({clip for clip, _ in new}):
        clip = file.contents.clips[number]
        tracks = [
            track.with_keys(track.time_axis, new[number, track.node])
            if track.path == "rotation" and track.node is not None and (number, track.node) in new
            else track
            for track in clip.tracks
        ]
        changed[number] = replace(clip, tracks=tuple(tracks))
    return replace_clips(file, changed)

"""Edits of rotation keys that rules about motion mark."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.edits import replace_clips
from anim.check.finding import Occurrence
from anim.check.rotation_steps import RotationSteps, rotation_steps, steps_of
from anim.gltf.document import Document
from anim.maths import quaternion

MAX_PASSES = 30  # an edited key can mark its neighbors
Marks = Callable[[RotationSteps], Bools]  # the keys (S,) to edit
Edit = Callable[[Floats, Bools], Floats]  # keys (S, 4) and marks (S,) → the marked keys


def edit_rotations(file: CheckedFile, found: Sequence[Occurrence], marks: Marks, edit: Edit) -> Document:
    """Return the document with edited rotation keys in the clips of the occurrences, until none is marked."""
    first = motion = rotation_steps(file)
    for _ in range(MAX_PASSES):
        marked = marks(motion)
        if not marked.any():
            break
        keys = motion.keys.copy()
        keys[marked] = quaternion.normalize(edit(motion.keys, marked))
        motion = steps_of(motion.table._replace(values=keys))
    signs = np.where(quaternion.dot(first.keys, first.table.values) < 0, -1.0, 1.0)
    same = (motion.keys == first.keys).all(axis=1)
    values = np.where(same[:, None], first.table.values, motion.keys * signs[:, None])
    return _with_values(file, {each.number for each in found}, first, values)


def _with_values(file: CheckedFile, clips: set[int], motion: RotationSteps, values: Floats) -> Document:
    """The document with other values (S, 4) of tracks in these clips."""
    table = motion.table
    new = {}
    for t in range(len(table.starts)):
        keys = slice(table.starts[t], table.starts[t] + table.counts[t])
        if int(table.clips[t]) in clips and not np.array_equal(values[keys], table.values[keys]):
            new[int(table.clips[t]), int(table.nodes[t])] = values[keys]
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

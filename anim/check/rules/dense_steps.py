"""GA114: stepped motion that was sampled as LINEAR."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.edits import replace_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.check.track_table import TrackTable
from anim.gltf.document import Document
from anim.maths import quaternion
from anim.model import Interpolation, Track

PATHS = ("rotation", "translation")
MIN_KEYS = 12
MIN_JUMPS = 2
STILL_PER_JUMP = 1e-3  # steps smaller than this fraction of the smallest jump are still


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such tracks."""
    for path in PATHS:
        yield from file.per_clip((table, mask.astype(np.int64)) for table, mask in _stepped(file, path, parameters))


def _stepped(file: CheckedFile, path: str, parameters: Parameters) -> Iterator[tuple[TrackTable, Bools]]:
    """Yield tracks of a path, and the mask (T,) of those that are stepped."""
    smallest = np.radians(parameters["angle"]) if path == "rotation" else parameters["distance"] * file.diagonal
    for table in file.tracks(path, _is_dense):
        yield table, _is_stepped(table, _steps(table), smallest)


def _is_dense(track: Track) -> bool:
    return track.interpolation is Interpolation.LINEAR and len(track.values) >= MIN_KEYS


def _is_stepped(table: TrackTable, steps: Floats, smallest: float) -> Bools:
    """Mask (T,) of tracks that are still but for isolated jumps. steps: (S,), 0 at the first key of a track."""
    jumps = steps > smallest
    slow = ~jumps & (steps > STILL_PER_JUMP * smallest)
    adjacent = np.zeros_like(jumps)
    adjacent[1:] = jumps[1:] & jumps[:-1]
    return np.asarray((table.count_marked(jumps) >= MIN_JUMPS) & (table.count_marked(slow | adjacent) == 0))


def _steps(table: TrackTable) -> Floats:
    """Distance or angle from the key before (S,)."""
    before, after = table.values[:-1], table.values[1:]
    steps = np.zeros(len(table.values))
    if table.values.shape[1] == 4:
        steps[1:] = 2 * np.arccos(np.clip(np.abs(quaternion.dot(before, after)), 0, 1))
    else:
        steps[1:] = np.sqrt(((after - before) ** 2).sum(axis=1))
    return np.asarray(np.where(table.inner_steps(), steps, 0.0))


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with STEP in these tracks: they jump at the key after the slide."""
    stepped = {
        (*target, path)
        for path in PATHS
        for table, mask in _stepped(file, path, parameters)
        for target in table.targets(mask)
    }

    def as_step(number: int, track: Track) -> Track:
        is_stepped = (number, track.node, track.path) in stepped
        return replace(track, interpolation=Interpolation.STEP) if is_stepped else track

    clips = {each.number: file.contents.clips[each.number] for each in found}
    new = {i: replace(clip, tracks=tuple(as_step(i, track) for track in clip.tracks)) for i, clip in clips.items()}
    return replace_clips(file, new)


RULE = Rule(
    "GA114",
    "dense-steps",
    Severity.WARNING,
    "LINEAR tracks are still but for jumps between two keys: STEP was lost.",
    "Exporters that sample every frame write LINEAR keys, so that jumps become slides: "
    "KhronosGroup/glTF-Blender-IO#1868, #2137.",
    find,
    counted("LINEAR track jumps between keys and is still else", "LINEAR tracks jump between keys and are still else"),
    "export stepped curves as STEP where the file is made",
    parameters={
        "angle": Parameter(2, "deg", "smallest jump of a rotation"),
        "distance": Parameter(0.005, "%", "smallest jump of a translation, of the model's size"),
    },
    fix=Fix("interpolate by STEP", fix, is_safe=False),
)

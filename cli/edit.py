"""What all commands share that turn clips into clips: read, select, change, write, and say what it cost."""

from __future__ import annotations

import operator
import time
from collections.abc import Callable
from dataclasses import dataclass

from anim.errors import AnimError
from anim.gltf import read, write
from anim.gltf.accessors import Accessors
from anim.gltf.document import Document
from anim.measure.error import MotionError, Ruler
from anim.model import Clip, Scene, Skeleton
from anim.ops.selection import Selection
from cli import report, streams

Change = Callable[[Clip, frozenset[int], Skeleton], Clip]


@dataclass(frozen=True, slots=True)
class Edited:
    """Clips of a file before and after, by number, and the worst that happened to the surface."""

    before: dict[int, Clip]
    after: dict[int, Clip]
    worst: MotionError | None
    diagonal: float


def edit(
    path: str,
    output: str,
    selection: Selection,
    change: Change,
    voice: report.Voice,
    *,
    dry_run: bool,
    measure: bool = True,
) -> None:
    """Change the selected clips of one file and write it; one line on stderr says what came of it.

    change: gets a clip, the numbers of its selected tracks and the skeleton, returns the new clip.
    measure: compare the motion of the written file with that of the input, on the surface.
    """
    began = time.perf_counter()
    if not dry_run:
        streams.check_output(output)
    with streams.source(path) as source:
        document = source.document
        accessors = Accessors(document)
        clips = read.clips(document, accessors)
        skeleton = read.skeleton(document)
        chosen = selection.chosen_clips([clip.name for clip in clips])
        new = {i: _changed(clips[i], i, skeleton, selection, change) for i in chosen}
        new = {i: clip for i, clip in new.items() if not _is_same(clip, clips[i])}
        result = write.replace_clips(document, new)
        written = read.clips(result)
        edited = Edited({i: clips[i] for i in chosen}, {i: written[i] for i in chosen}, None, 0.0)
        if measure:
            edited = _measured(edited, document, accessors, skeleton, voice)
        else:
            for i, clip in edited.before.items():
                voice.detail(f"  {read.label(clip.name, i)}: {_keys(clip)} → {_keys(edited.after[i])} keys")
        size = streams.write(result, output, source.folder, dry_run=dry_run)
    if chosen and not new:
        voice.say("note: no track was changed")
    if not dry_run:
        note_images(result, source, output, voice)
    name = source.name if output == streams.PIPE else output
    voice.say(_summary(name, source.size, size, edited, time.perf_counter() - began, dry_run=dry_run))


def _changed(clip: Clip, number: int, skeleton: Skeleton, selection: Selection, change: Change) -> Clip:
    try:
        return change(clip, selection.chosen_tracks(clip, skeleton), skeleton)
    except AnimError as error:
        raise error.at(read.label(clip.name, number)) from None


def _is_same(new: Clip, old: Clip) -> bool:
    return new is old or (len(new.tracks) == len(old.tracks) and all(map(operator.is_, new.tracks, old.tracks)))


def _measured(
    edited: Edited, document: Document, accessors: Accessors, skeleton: Skeleton, voice: report.Voice
) -> Edited:
    try:
        scene = read.scene(document, accessors)
    except AnimError as error:  # vertices that can't be read don't stop a change of keys
        voice.say(f"note: measured at nodes, not on the surface: {error}")
        scene = Scene(skeleton, ())
    ruler = Ruler(scene)
    worst: MotionError | None = None
    for i, before in edited.before.items():
        found = ruler.error(before, edited.after[i])
        counts = f"{_keys(before)} → {_keys(edited.after[i])} keys"
        voice.detail(f"  {read.label(before.name, i)}: {counts}, {_error(found, ruler.diagonal)}")
        if worst is None or found.max_error > worst.max_error:
            worst = found
    return Edited(edited.before, edited.after, worst, ruler.diagonal)


def _summary(name: str, before: int, after: int, edited: Edited, seconds: float, *, dry_run: bool) -> str:
    keys = [sum(_keys(clip) for clip in clips.values()) for clips in (edited.before, edited.after)]
    parts = [f"{name}  {report.change(before, after)}", f"{keys[0]} → {keys[1]} keys"]
    if edited.worst is not None:
        parts.append(_error(edited.worst, edited.diagonal))
    parts.append(f"{seconds:.1f} s")
    return ", ".join(parts) + (" (dry run: nothing written)" if dry_run else "")


def _error(error: MotionError, diagonal: float) -> str:
    percent = f" ({100 * error.max_error / diagonal:.2g} %)" if diagonal and error.max_error else ""
    where = f" at '{error.joint}', {error.time:.3f} s" if error.max_error and error.joint else ""
    words = f"max {report.length(error.max_error)}{percent}{where}"
    if error.max_pointer_error > 0:
        words += f", pointers max {100 * error.max_pointer_error:.2g} % of range at {error.pointer}"
    return words


def _keys(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def note_images(document: Document, source: streams.Source, output: str, voice: report.Voice) -> None:
    """Say which images an output in another folder than its input has lost."""
    outside = "" if output == streams.PIPE else streams.left_outside(document, source.folder, output)
    if outside:
        voice.say(f"{outside}; convert --embed takes them in")

"""Workflow of the commands that edit clips: read, select, change, write, and report."""

from __future__ import annotations

import operator
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from typing import NamedTuple

from anim.errors import AnimError
from anim.gltf.document import Document
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.validation.animation_storage import badly_stored
from anim.gltf.writing import writer
from anim.measure.continuous_bound.clip_groups import largest_error_of, worst_proof
from anim.measure.continuous_bound.largest_error import is_closed, largest_error
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.measure.equal_clips import first_equal, repeat_change
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.surface import SHELL, diagonal, reference_length
from anim.measure.error.whole_scene import WholeScene
from anim.measure.inspect.track_statistics import non_unit_keys
from anim.memory import MemoryBudget
from anim.model import Clip, Scene, Skeleton
from anim.operations.selection import Selection
from anim.units import plural
from cli import streams, text
from cli.io import documents, scenes
from cli.reports import image_notes
from cli.reports.error_place import describe_place, describe_pointers
from cli.reports.rotation_notes import describe_non_unit_keys
from cli.reports.size_notes import growth_note
from cli.text import DRY, format_span, format_time

Clips = Mapping[int, Clip]  # by index in the file
Tracks = Callable[[Clip], frozenset[int]]  # indices of a clip's selected tracks
Change = Callable[[Clip, frozenset[int], Callable[[], Scene]], Clip]
ChangeMany = Callable[[Clips, Tracks, Callable[[], Scene]], Clips]
BYTES_PER_BYTE = 8  # of memory for one of a changed clip's values: written, read back and measured
MAX_LISTED_CLIPS = 3  # clips listed with their durations; of more the sum


class EditResult(NamedTuple):
    """Clips of a file before and after, by index, and the largest error on the surface.

    at_nodes: whether only nodes were measured, because the surface could not be read. around: a larger error around a
    node that moves no vertex, such as a socket. stated: words for the summary.
    """

    before: dict[int, Clip]
    after: dict[int, Clip]
    worst: Proof | None
    diagonal: float
    at_nodes: bool = False
    around: Proof | None = None
    stated: str = ""


def edit_clips(
    path: str,
    output: str,
    selection: Selection,
    change: Change,
    reporter: text.Reporter,
    *,
    dry_run: bool,
    measure: bool = True,
    notes: Callable[[Clips, Clips], Iterable[str]] = lambda before, after: (),
    advise: Callable[[Clip, int], str] = lambda clip, index: "",
    state: Callable[[Clips, Clips], str] = lambda before, after: "",
) -> None:
    """Change the selected clips of one file, one by one, and write it; report the result in one line on stderr.

    change: gets a clip, the indices of its selected tracks, and a reader of the scene; returns the new clip. It gets
    the first one of clips with equal tracks, and the others the same change. For the rest see `edit_together`.
    advise: gets a clip that can't be changed, and its index, and returns the help of the error, or "".
    """
    many = partial(_change_each, change, advise)
    edit_together(path, output, selection, many, reporter, dry_run=dry_run, measure=measure, notes=notes, state=state)


def _change_each(
    change: Change, advise: Callable[[Clip, int], str], clips: Clips, tracks: Tracks, scene: Callable[[], Scene]
) -> Clips:
    numbers = list(clips)
    new: dict[int, Clip] = {}
    budget = MemoryBudget(sum(clip.num_bytes for clip in clips.values()))
    for i, n in zip(numbers, first_equal([(clip,) for clip in clips.values()]), strict=True):
        if numbers[n] in new:
            new[i] = repeat_change(clips[i], clips[numbers[n]], new[numbers[n]])
            continue
        try:
            new[i] = change(clips[i], tracks(clips[i]), scene)
            budget.add(BYTES_PER_BYTE * new[i].num_bytes)
        except AnimError as error:
            raise error.at(reader.clip_label(clips[i].name, i)).advise(advise(clips[i], i)) from None
    return new


def edit_together(
    path: str,
    output: str,
    selection: Selection,
    change: ChangeMany,
    reporter: text.Reporter,
    *,
    dry_run: bool,
    measure: bool = True,
    notes: Callable[[Clips, Clips], Iterable[str]] = lambda before, after: (),
    state: Callable[[Clips, Clips], str] = lambda before, after: "",
) -> None:
    """Change the selected clips of one file in one call and write it; report the result in one line on stderr.

    change: gets the clips, a function for the indices of their selected tracks, and a reader of the scene; returns the
    new clips.
    measure: compare the motion of the written file with that of the input, on the surface.
    notes: gets the changed clips, before and after, and returns notes for the user, a line each. state: gets the same,
    and returns words for the summary, such as a tolerance.
    """
    began = time.perf_counter()
    if not dry_run:
        documents.check_output(output)
    with documents.source(path, reporter) as source:
        document = source.document
        accessors = Accessors(document)
        clips = reader.clips(document, accessors)
        skeleton = reader.skeleton(document)
        chosen = selection.chosen_clips([clip.name for clip in clips])
        scene = cache(partial(_scene, document, accessors, skeleton))
        tracks = partial(selection.chosen_tracks, skeleton=skeleton)
        changed = change({i: clips[i] for i in chosen}, tracks, lambda: scene()[0])
        stale = badly_stored(document.json)
        new = {i: clip for i, clip in changed.items() if i in stale or not _is_same(clip, clips[i])}
        for note in notes({i: clips[i] for i in new}, new):
            reporter.info(f"note: {note}")
        result = writer.replace_sharing(document, new)
        written = reader.clips(result, limited=False)
        edited = EditResult({i: clips[i] for i in chosen}, {i: written[i] for i in chosen}, None, 0.0)
        if not new:
            pass
        elif measure:
            edited = _measured(edited, source, scene, accessors, reporter)
        else:
            for i, clip in edited.before.items():
                reporter.verbose_info(
                    f"  {reader.clip_label(clip.name, i)}: {_keys(clip)} → {_keys(edited.after[i])} keys"
                )
        size = documents.write(
            result, output, source, unchanged=source.bytes_of(result), dry_run=dry_run, reporter=reporter
        )
    if not dry_run:
        image_notes.report(result, source, output, reporter)
    name = source.name if output == documents.PIPE else output
    if not new:
        why = "no track was changed" if clips else "it has no clips"
        before = text.format_bytes(size) if size == source.size else text.format_change(source.size, size)
        reporter.info(f"{name}  {before}, unchanged: {why}{DRY if dry_run else ''}")
        return
    if words := growth_note(edited.before, edited.after, (source.size, size)):
        reporter.info(f"note: {words}")
    if edited.worst is not None:
        largest = max(filter(None, (edited.worst, edited.around)), key=_max_error)
        streams.state_error(_length(largest, edited.diagonal) + describe_pointers(edited.worst.error))
    edited = edited._replace(stated=state({i: clips[i] for i in new}, new))
    reporter.info(_summary(name, source.size, size, edited, time.perf_counter() - began, dry_run=dry_run))


def check_clips(path: str, selection: Selection, reporter: text.Reporter) -> None:
    """Raise NotFoundError for a selected clip that a file lacks, which is only then read."""
    if selection.clips:
        with documents.source(path, reporter) as source:
            selection.chosen_clips(reader.names(source.document))


def _scene(document: Document, accessors: Accessors, skeleton: Skeleton) -> tuple[Scene, AnimError | None]:
    """The scene; without meshes, and the reason, if their vertices can't be read."""
    try:
        return reader.scene(document, accessors, skeleton, repeats=False), None
    except AnimError as error:  # unreadable vertices don't prevent a change of keys
        return Scene(skeleton, ()), error


def _is_same(new: Clip, old: Clip) -> bool:
    return new is old or (len(new.tracks) == len(old.tracks) and all(map(operator.is_, new.tracks, old.tracks)))


def _measured(
    edited: EditResult,
    source: Source,
    read: Callable[[], tuple[Scene, AnimError | None]],
    accessors: Accessors,
    reporter: text.Reporter,
) -> EditResult:
    scene, error = read()
    if error is None:
        scenes.warn_of_scene(scene, source.document, source.name, reporter, accessors=accessors)
    else:
        scenes.warn_of_nodes(error, "surface", reporter)
    clips = *edited.before.values(), *edited.after.values()
    whole = WholeScene.of(scene, diagonal(scene))
    shell = SHELL * reference_length(whole.diagonal)
    prover = Prover(ErrorMetric(scene, shell=shell, clips=clips, whole=whole))
    pairs = [(before, edited.after[i]) for i, before in edited.before.items()]
    first = first_equal(pairs)
    _warn_of_non_unit_keys(edited, first, reporter)
    distinct = sorted(set(first))
    if reporter.verbose:
        found = {n: largest_error(prover, *pairs[n]) for n in distinct}
        for (i, before), n in zip(edited.before.items(), first, strict=True):
            counts = f"{_keys(before)} → {_keys(edited.after[i])} keys"
            reporter.verbose_info(
                f"  {reader.clip_label(before.name, i)}: {counts}, {_error(found[n], prover.ruler.diagonal)}"
            )
        worst = worst_proof(list(found.values()))
    else:
        worst = largest_error_of(prover, [pairs[n] for n in distinct])
    around = worst if worst is not None and worst.error.is_around_node else None
    if around is not None:
        around = around._replace(error=around.error._replace(max_pointer_error=0.0))  # stated by the other
        worst = largest_error_of(Prover(ErrorMetric(scene, clips=clips)), [pairs[n] for n in distinct])
    return EditResult(edited.before, edited.after, worst, prover.ruler.diagonal, error is not None, around)


def _warn_of_non_unit_keys(edited: EditResult, first: Sequence[int], reporter: text.Reporter) -> None:
    """Warn of rotations of changed tracks that are not unit quaternions: the error holds for players that normalize.

    first: for each clip the first one that is equal before and after.
    """
    counts: list[tuple[str, int, int]] = []
    for n, (i, before) in enumerate(edited.before.items()):
        count = counts[first[n]][2] if first[n] < n else _changed_non_unit_keys(before, edited.after[i])
        counts.append((before.name, i, count))
    if words := describe_non_unit_keys(counts):
        reporter.warn(f"{words}; in players that don't normalize rotations the error may be larger than stated")


def _changed_non_unit_keys(before: Clip, after: Clip) -> int:
    new = {track.target: track for track in after.tracks}
    keys = zip(non_unit_keys(before.tracks), before.tracks, strict=True)
    return sum(count for count, track in keys if count and new.get(track.target) != track)


def _summary(name: str, before: int, after: int, edited: EditResult, seconds: float, *, dry_run: bool) -> str:
    keys = [sum(_keys(clip) for clip in clips.values()) for clips in (edited.before, edited.after)]
    parts = [f"{name}  {text.format_change(before, after)}", f"{keys[0]} → {keys[1]} keys"]
    parts += filter(None, [clip_lengths(edited.before, edited.after), edited.stated])
    if edited.worst is not None:
        parts.append(_error(edited.worst, edited.diagonal) + (" (nodes only)" if edited.at_nodes else ""))
    if edited.around is not None:
        parts.append(_error(edited.around, edited.diagonal))
    parts.append(text.format_duration(seconds))
    return ", ".join(parts) + (DRY if dry_run else "")


def _error(found: Proof, diagonal: float) -> str:
    """The largest error as text; "at least" if errors between the sampled times are not bounded."""
    error = found.error
    where = f" {describe_place(error)}, {error.time:.3f} s" if error.max_error and error.joint else ""
    return _length(found, diagonal) + where + describe_pointers(error)


def _length(found: Proof, diagonal: float) -> str:
    least = "" if is_closed(found, diagonal) else "at least "
    return f"max {least}{text.format_length(_max_error(found))}{text.format_fraction(_max_error(found), diagonal)}"


def _max_error(found: Proof) -> float:
    return found.error.max_error


def _keys(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def clip_lengths(before: Mapping[int, Clip], after: Mapping[int, Clip]) -> str:
    """Return the duration of every clip that changed it: "'walk' 1 s → 4 s"; of many the sum; else "".

    before, after: clips of a file by index. Of a clip that starts after 0 s the time span is given: "0.5–1.5 s".
    """
    ends = {i: [(clip.start, clip.end) for clip in (before[i], after[i])] for i in before}
    spans = {i: [format_span(*each) for each in pair] for i, pair in ends.items() if pair[0] != pair[1]}
    changed = {i: f"{was} → {now}" for i, (was, now) in spans.items() if was != now}
    if len(changed) <= MAX_LISTED_CLIPS:
        return ", ".join(f"{reader.quote_clip(before[i].name, i)} {words}" for i, words in changed.items())
    sums = (sum(clips[i].end for i in changed) for clips in (before, after))
    return f"{plural(len(changed), 'clip')} {' → '.join(map(format_time, sums))} in all"

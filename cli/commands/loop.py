"""`gltf-anim loop`: loop report of clips, and closing of loops."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated

import typer

from anim.errors import AnimError
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.measure.equal_clips import first_equal, repeat_change
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.loop_analysis import Loop, analyze_loops, best_ranges
from anim.measure.loops.loop_kind import LoopKind
from anim.measure.loops.recommendations import recommend
from anim.measure.loops.skin_motion import SkinMotion
from anim.model import Clip, Scene
from anim.operations.close_loop import close_loop
from anim.operations.selection import Selection
from anim.units import list_some, plural
from cli.errors import UsageError
from cli.io import documents, scenes
from cli.options import common
from cli.options.common import Format
from cli.reports import loop_report
from cli.reports.loop_report import LoopReport, joint_names
from cli.text import Reporter, format_length
from cli.workflows import many_files
from cli.workflows.edit_clips import Clips, Tracks, edit_together

HELP = "--blend S closes the loop over the last S seconds; --clip selects clips"
MAX_LISTED_PROBLEMS = 3  # clips that can't be closed in a message; with more it would be cut


def command(
    input: common.Input = "-",
    output: Annotated[
        str | None,
        typer.Argument(
            metavar="OUT",
            help="A .glb or .gltf file for the closed clips, '-' for stdout; without it, a report.",
            show_default=False,
        ),
    ] = None,
    *,
    blend: Annotated[
        float | None,
        typer.Option("--blend", metavar="S", help="Close the loop over the last S seconds of the clip."),
    ] = None,
    find: Annotated[bool, typer.Option("--find", help="List the time ranges that loop best.")] = False,
    shortest: Annotated[
        float | None,
        typer.Option(
            "--shortest", metavar="S", help="For --find: minimum duration in seconds (default: half of the clip)."
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(
            "--fps",
            metavar="N",
            help='Frames per second of the clips, for "frame step" and a missing frame (default: by their keys).',
        ),
    ] = None,
    format: common.Report = Format.TEXT,
    clip: common.Clips = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Report whether clips loop, and close them.

    Without OUT and --blend, each clip is reported as closed; closed except some joints, which are named; open by one
    frame (the last frame is missing); not a loop; or a single pose. "loop gap" and "velocity gap" are the differences
    between its end and its start, measured on the skin, without root motion. Nodes that move no vertex, such as IK
    controls, are ignored unless no mesh has vertices. For comparison, "frame step" is the largest motion from one frame
    to the next, and "velocity step" the largest change of velocity at a key inside the clip: a much smaller gap is
    hardly visible. "seconds" are those of the first and the last key, "at" is the node with the largest gap, or the
    joints that are open, and "root motion" is the distance between both ends of the path of the root.

    "at fps" is the frame rate of "frame step" and of the frame that may be missing. It is derived from the keys, and is
    30 if these are not regular: optimize, resample and other edits change it. --fps states the clips' own rate, so that
    figures before and after an edit compare.

    With OUT, a clip that is open by one frame gets the missing frame, in which root motion continues. --blend closes
    any gap of value and velocity but those of the path of a root that travels, which stays as it is, its height too;
    if only some joints are open, it changes only these. --find lists the time ranges that loop best, for trim, and
    names the clips in which no range loops better than the whole clip.
    """
    selection = Selection(clip or ())
    reporter = Reporter(quiet, verbose)
    if output is None and blend is None:
        _report(input, selection, reporter, find=find, shortest=shortest, fps=fps, format=format)
        return
    if find:
        raise UsageError("--find only reports", help="cut the range with trim --from … --to …")
    many_files.refuse_folder(input, help='a recipe closes loops of many files: steps = ["loop"], then gltf-anim run')
    documents.check_output(output or documents.PIPE, dry_run=dry_run)
    closing_of = _Closing(blend, input, fps)
    edit_together(
        input,
        output or documents.PIPE,
        selection,
        closing_of,
        reporter,
        dry_run=dry_run,
        notes=closing_of.notes,
    )


class _Closing:
    """Closes clips, all analyzed together. blend: s, None to add a missing frame only. path: of the input.

    fps: of the clips, None for that of their keys. Clips that can't be closed are collected, so that one error names
    them before anything is written.
    """

    def __init__(self, blend: float | None, path: str, fps: float | None) -> None:
        self._blend, self._fps = blend, fps
        self._path = "stdin" if path == documents.PIPE else path
        self._problems: list[str] = []
        self._poses: list[str] = []

    def __call__(self, clips: Clips, tracks: Tracks, scene: Callable[[], Scene]) -> Clips:
        self._poses = [reader.clip_label(each.name, i) for i, each in clips.items() if each.end <= each.start]
        moving = {i: each for i, each in clips.items() if each.end > each.start}
        if not moving:
            return clips
        numbers, every, skin = list(moving), list(moving.values()), SkinMotion(scene())
        first = first_equal([(each,) for each in every])
        distinct = sorted(set(first))
        analyzed = dict(zip(distinct, _analyzed(skin, [every[n] for n in distinct], self._fps), strict=True))
        new: dict[int, Clip] = dict(clips)
        for i, n in zip(numbers, first, strict=True):
            found, root = analyzed[n]
            if problem := _problem(found, self._blend):
                self._problems.append(f"{reader.clip_label(clips[i].name, i)} {problem}")
            elif numbers[n] < i:
                new[i] = repeat_change(clips[i], every[n], new[numbers[n]])
            else:
                new[i] = self._close(clips[i], i, found, root, tracks(clips[i]))
        return new

    def _close(self, clip: Clip, number: int, found: Loop, root: int, tracks: frozenset[int]) -> Clip:
        try:
            return close_loop(clip, found, root=root, blend=self._blend, tracks=tracks)
        except AnimError as error:
            raise error.at(reader.clip_label(clip.name, number)) from None

    def notes(self, before: Mapping[int, Clip], after: Mapping[int, Clip]) -> Iterator[str]:
        """Yield notes on unchanged clips. Raises UsageError that names clips that can't be closed."""
        if self._problems:
            more = len(self._problems) - MAX_LISTED_PROBLEMS
            listed = self._problems[:MAX_LISTED_PROBLEMS] + ([f"and {plural(more, 'clip')} more"] if more > 0 else [])
            raise UsageError(f"{self._path}: {'; '.join(listed)}", help=HELP)
        if self._poses:
            yield f"a single pose, without a loop to close: {list_some(self._poses)}"


def _analyzed(skin: SkinMotion, clips: Sequence[Clip], fps: float | None) -> list[tuple[Loop, int]]:
    """The analysis of each clip, and its root, −1 for none."""
    roots = [root_motion_node(skin.skeleton, each) for each in clips]
    return list(zip(analyze_loops(skin, clips, roots, fps=fps), roots, strict=True))


def _problem(found: Loop, blend: float | None) -> str:
    """Reason for which a clip can't be closed, "" if it can. blend: s, None to add a missing frame only."""
    if blend is not None or found.kind in (LoopKind.OPEN_BY_ONE_FRAME, LoopKind.CLOSED):
        return ""
    if found.kind is LoopKind.CLOSED_EXCEPT:
        joints = joint_names(found, quote=True)
        return f"is closed except at {joints}: its end is {format_length(found.seam)} from its start"
    return f"is not a loop: its end is {format_length(found.seam)} from its start at '{found.node}'"


def _report(
    path: str,
    selection: Selection,
    reporter: Reporter,
    *,
    find: bool,
    shortest: float | None,
    fps: float | None,
    format: Format,
) -> None:
    with documents.source(path, reporter) as source:
        clips = reader.clips(source.document)
        chosen = selection.chosen_clips(reader.names(source.document))
        skin = _skin(source, reporter)
        first = first_equal([(clips[i],) for i in chosen])
        distinct = sorted(set(first))
        analyzed = dict(
            zip(distinct, _loops(skin, [clips[chosen[n]] for n in distinct], find, shortest, fps), strict=True)
        )
        loops = [analyzed[n] for n in first]
    names = [reader.clip_name(clips[i].name, i) for i in chosen]
    rows = [(name, each) for name, found in zip(names, loops, strict=True) for each in found]
    parts = list(zip(chosen, loops, strict=True)) if find else []
    judged = [] if find else [(i, each) for i, (each,) in zip(chosen, loops, strict=True)]
    notes = list(_no_better(clips, parts)) if clips else ["no clips"]
    report = LoopReport(rows, list(recommend(judged, fps=fps)), notes, skin.is_skin)
    if format is Format.JSON:
        documents.write_text(loop_report.as_json(report, warnings=reporter.warnings))
    elif not reporter.quiet:
        documents.write_text(loop_report.text(report))


def _loops(
    skin: SkinMotion, clips: Sequence[Clip], find: bool, shortest: float | None, fps: float | None
) -> list[list[Loop]]:
    """The analysis of each clip as a whole, or of its best ranges."""
    if not find:
        return [[found] for found, _ in _analyzed(skin, clips, fps)]
    roots = (root_motion_node(skin.skeleton, each) for each in clips)
    return [
        best_ranges(skin, each, root=i, shortest=shortest or 0.0, fps=fps) for each, i in zip(clips, roots, strict=True)
    ]


def _no_better(clips: Sequence[Clip], found: list[tuple[int, list[Loop]]]) -> Iterator[str]:
    """Yield a line per reason for the clips without a better part for --find. found: with clip indices."""
    reasons: dict[str, list[tuple[str, int]]] = {}
    for number, parts in found:
        if reason := _why_none(clips[number], parts):
            reasons.setdefault(reason, []).append((clips[number].name, number))
    yield from (f"{reader.clip_labels(those)}: {reason}" for reason, those in reasons.items())


def _why_none(clip: Clip, parts: list[Loop]) -> str:
    """Reason for which no part of a clip is worth trimming, "" if one is. parts: the best first."""
    if clip.end <= clip.start:
        return "a single pose, without a range to find"
    if not parts:
        return "no time range is as long as --shortest"
    if all(each.kind is LoopKind.NOT_A_LOOP for each in parts):
        return "no time range loops"
    best = parts[0]
    is_whole = max(abs(best.start - clip.start), abs(best.end - clip.end)) < 0.5 / best.fps
    return "no time range loops better than the whole clip" if is_whole else ""


def _skin(source: Source, reporter: Reporter) -> SkinMotion:
    """Motion on which seams are measured: nodes if vertices can't be read."""
    try:
        return SkinMotion(scenes.read_scene(source.document, source.name, reporter, repeats=False))
    except AnimError as error:
        scenes.warn_of_nodes(error, "skin", reporter)
        return SkinMotion(Scene(reader.skeleton(source.document), ()))

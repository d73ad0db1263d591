"""`gltf-anim loop`: does a clip loop, and how to make it."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from anim.gltf import read
from anim.measure.loop import Loop, LoopKind, best_ranges
from anim.measure.loop import loop as judged
from anim.measure.travel import traveling_root
from anim.model import Clip, Skeleton
from anim.ops import loop as closing
from anim.ops.selection import Selection
from cli import options, streams, tables
from cli.edit import edit
from cli.errors import UsageError
from cli.options import Format
from cli.report import Voice, length, speed

SCHEMA = 1


def loop(
    input: options.Input = "-",
    output: Annotated[
        str | None,
        typer.Argument(metavar="OUT", help="Where the closed loop goes; without it: report.", show_default=False),
    ] = None,
    *,
    blend: Annotated[
        float | None,
        typer.Option("--blend", metavar="S", help="Bend the last S seconds to end as it starts."),
    ] = None,
    find: Annotated[bool, typer.Option("--find", help="Report the parts that loop best.")] = False,
    shortest: Annotated[
        float | None, typer.Option("--shortest", metavar="S", help="For --find; half of the clip by default.")
    ] = None,
    format: options.Report = Format.TEXT,
    clip: options.Clips = None,
    dry_run: options.DryRun = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> None:
    """Say what kind of loop a clip is, and close it.

    Without OUT and --blend: a report per clip: closed, open by one frame (its last frame is missing) or not a loop, and
    the seam in pose and in speed, with the way of a traveling root taken off. With OUT: an open loop gets its missing
    frame; --blend closes any seam in value and speed over the last seconds. --find looks for the best part: trim it.
    """
    selection = Selection(clip or ())
    if output is None and blend is None:
        _report(input, selection, find=find, shortest=shortest, format=format)
        return
    if find:
        raise UsageError("--find only reports", help="trim --from … --to … the part that it names")
    edit(
        input,
        output or streams.PIPE,
        selection,
        lambda each, tracks, skeleton: _closed(each, tracks, skeleton, blend),
        Voice(quiet, verbose),
        dry_run=dry_run,
    )


def _closed(clip: Clip, tracks: frozenset[int], skeleton: Skeleton, blend: float | None) -> Clip:
    root = traveling_root(skeleton, clip)
    found = judged(skeleton, clip, root=root)
    if found.kind is LoopKind.OPEN_BY_ONE_FRAME:
        clip = closing.with_last_frame(clip, fps=found.fps, tracks=tracks)
    elif found.kind is LoopKind.NOT_A_LOOP and blend is None:
        problem = f"is not a loop: its end is {length(found.seam)} from its start at '{found.node}'"
        raise UsageError(problem, help="--blend S closes it over its last S seconds")
    if blend is None:
        return clip
    carried = {i for i, track in enumerate(clip.tracks) if track.node == root and track.path == "translation"}
    return closing.loop(clip, blend=blend, tracks=tracks - carried)


def _report(path: str, selection: Selection, *, find: bool, shortest: float | None, format: Format) -> None:
    with streams.source(path) as source:
        clips, skeleton = read.clips(source.document), read.skeleton(source.document)
        rows: list[tuple[str, Loop]] = []
        for i in selection.chosen_clips(read.names(source.document)):
            root = traveling_root(skeleton, clips[i])
            name = clips[i].name or f"#{i}"
            if find:
                rows += [(name, r) for r in best_ranges(skeleton, clips[i], root=root, shortest=shortest or 0.0)]
            else:
                rows.append((name, judged(skeleton, clips[i], root=root)))
    streams.write_text(_json(rows) if format is Format.JSON else _text(rows))


def _text(rows: list[tuple[str, Loop]]) -> str:
    header = ["clip", "seconds", "kind", "seam", "in speed", "at", "travel"]
    cells: list[list[tables.Cell]] = [
        [
            name,
            f"{each.start:.4g}–{each.end:.4g}",
            str(each.kind),
            length(each.seam),
            speed(each.speed_seam),
            each.node,
            length(each.travel) if each.travel else "",
        ]
        for name, each in rows
    ]
    return tables.text(header, cells, left=3, indent="")


def _json(rows: list[tuple[str, Loop]]) -> str:
    units = {"start": "start_s", "end": "end_s", "seam": "seam_m", "speed_seam": "speed_seam_m_per_s"}
    units |= {"frame": "frame_motion_m", "travel": "travel_m", "fps": "frame_rate_fps"}
    loops = [{"clip": name, **{units.get(k, k): v for k, v in asdict(each).items()}} for name, each in rows]
    return json.dumps({"schema": SCHEMA, "loops": loops}, allow_nan=False, ensure_ascii=False, indent=1) + "\n"

"""`gltf-anim retime`: time of clips scaled, reversed, shifted, warped."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated

import typer

from anim.curves.easing.function import Easing
from anim.curves.easing.table import parse
from anim.model import Clip
from anim.operations.retime import retime as retimed
from anim.operations.selection import Selection
from anim.operations.time_warp import ANGLE_TOLERANCE_RAD, TOLERANCE, warp
from cli.errors import UsageError
from cli.options import common
from cli.reports.fit_notes import describe_easing
from cli.text import Reporter
from cli.workflows import many_files
from cli.workflows.edit_clips import Clips, check_clips, edit_clips


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    more: common.More = None,
    *,
    out: common.Out = None,
    speed: Annotated[
        float | None, typer.Option("--speed", metavar="N", help="Speed factor; 0.25 is four times slower.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option("--duration", metavar="S", help="New duration in seconds, from first to last key.")
    ] = None,
    reverse: Annotated[bool, typer.Option("--reverse", help="Reverse the clip.")] = False,
    ping_pong: Annotated[bool, typer.Option("--ping-pong", help="Append the reversed clip: twice as long.")] = False,
    warp_ease: Annotated[
        str | None, typer.Option("--warp", metavar="EASE", help="Easing of time over the whole clip.")
    ] = None,
    offset: Annotated[float, typer.Option("--offset", metavar="S", help="Delay in seconds.")] = 0.0,
    clip: common.Clips = None,
    node: common.Nodes = None,
    path: common.Paths = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> int:
    """Change the timing of clips: speed, duration, direction, delay.

    Times are the clip's own seconds, not frames. Values stay, and tangents are scaled by the chain rule: all changes
    except --warp are exact, but for the rounding of times to float32. They are applied in the order --warp, --speed or
    --duration, --reverse, --ping-pong, --offset.
    """
    selection, reporter = Selection(clip or (), node or (), path or ()), Reporter(quiet, verbose)
    if speed is None and duration is None and not (reverse or ping_pong or offset or warp_ease):
        check_clips(input, selection, reporter)
        raise UsageError("nothing to do", help="give --speed, --duration, --reverse, --ping-pong, --warp or --offset")
    easing = parse(warp_ease) if warp_ease is not None else None

    def change(each: Clip, tracks: frozenset[int], _: object) -> Clip:
        if easing is not None and each.end > each.start:
            each = warp(each, easing=easing, tracks=tracks)
        return retimed(
            each,
            speed=speed,
            duration=duration,
            reverse=reverse,
            ping_pong=ping_pong,
            offset=offset,
            tracks=tracks,
        )

    def edit(input: str, output: str) -> None:
        edit_clips(input, output, selection, change, reporter, dry_run=dry_run, measure=False, state=_stated(easing))

    return many_files.edit_named(input, output, more or (), out, edit, reporter, dry_run=dry_run)


def _stated(easing: Easing | None) -> Callable[[Clips, Clips], str]:
    """The words of the summary on the tolerances of --warp."""
    if easing is None:
        return lambda before, after: ""
    return partial(
        describe_easing,
        is_cubic=easing.exact is not None,
        tolerance=TOLERANCE,
        angle_tolerance=ANGLE_TOLERANCE_RAD,
        range_of="track",
    )

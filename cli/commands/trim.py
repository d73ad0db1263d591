"""`gltf-anim trim`: a part of a clip with exact ends."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer

from anim.gltf.reading import reader
from anim.operations.selection import Selection
from anim.operations.trim import trim as trimmed
from cli.errors import UsageError
from cli.options import common
from cli.text import Reporter
from cli.workflows import many_files
from cli.workflows.edit_clips import Clips, check_clips, edit_clips

MAX_LISTED_TIMES = 4  # times in a note


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    more: common.More = None,
    *,
    out: common.Out = None,
    start: common.From = None,
    end: common.To = None,
    rebase: Annotated[bool, typer.Option("--rebase", help="Move the start of each clip to 0 s.")] = False,
    clip: common.Clips = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> int:
    """Keep one time range of clips, from --from to --to seconds.

    Keys inside the range stay unchanged; new keys at both ends have the exact value and tangent of the motion there.
    The range keeps its times, and players show its first pose until it starts; --rebase moves the start of each clip to
    0 s. A note lists clips that are moved by different times. --rebase alone cuts nothing.
    """
    selection, reporter = Selection(clip or ()), Reporter(quiet, verbose)
    if start is None and end is None and not rebase:
        check_clips(input, selection, reporter)
        raise UsageError("nothing to do", help="give --from, --to or both, in seconds, or --rebase")

    def edit(input: str, output: str) -> None:
        edit_clips(
            input,
            output,
            selection,
            lambda each, tracks, _: trimmed(each, start=start, end=end, rebase=rebase, tracks=tracks),
            reporter,
            dry_run=dry_run,
            measure=False,
            notes=lambda before, _: _moved_apart(before, start or 0.0) if rebase else (),
        )

    return many_files.edit_named(input, output, more or (), out, edit, reporter, dry_run=dry_run)


def _moved_apart(before: Clips, start: float) -> Iterator[str]:
    """Yield a note on the clips that --rebase moves by different times. start: s, of the kept part."""
    by_time: dict[float, list[tuple[str, int]]] = {}
    for number, clip in before.items():
        by_time.setdefault(round(max(clip.start, start), 6), []).append((clip.name, number))
    if len(by_time) > 1:
        ways = [f"{reader.clip_labels(clips)} by {seconds:.4g} s" for seconds, clips in by_time.items()]
        shown = "; ".join(ways[:MAX_LISTED_TIMES]) + (" …" if len(ways) > MAX_LISTED_TIMES else "")
        yield f"--rebase moves clips that belong together apart: {shown}"

"""`gltf-anim trim`: a part of a clip with exact ends."""

from __future__ import annotations

from typing import Annotated

import typer

from anim.operations.selection import Selection
from anim.operations.trim import trim as trimmed
from cli.errors import UsageError
from cli.options import common
from cli.text import Reporter
from cli.workflows.edit_clips import edit_clips


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    *,
    start: common.From = None,
    end: common.To = None,
    rebase: Annotated[bool, typer.Option("--rebase", help="Move what is kept to start at 0 s.")] = False,
    clip: common.Clips = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Keep the part of a clip from --from to --to seconds.

    Keys in between stay as they are; new keys at both ends have exactly the value and tangent that the motion has
    there. Without --rebase the part stays at its seconds: players hold its first pose until then. --rebase alone cuts
    nothing and moves clips that start late to 0 s.
    """
    if start is None and end is None and not rebase:
        raise UsageError("nothing to do", help="give --from, --to or both, in seconds, or --rebase")
    edit_clips(
        input,
        output,
        Selection(clip or ()),
        lambda each, tracks, _: trimmed(each, start=start, end=end, rebase=rebase, tracks=tracks),
        Reporter(quiet, verbose),
        dry_run=dry_run,
        measure=False,
    )

"""`gltf-anim resample`: keys of clips on a uniform frame grid."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from anim.operations.resample import INTERPOLATIONS, KEEP, resample
from anim.operations.selection import Selection
from cli.errors import UsageError
from cli.options import common
from cli.text import Reporter
from cli.workflows import many_files
from cli.workflows.edit_clips import edit_clips

Interpolation = StrEnum("Interpolation", [(name, name) for name in INTERPOLATIONS])  # type: ignore[misc]
AS_IT_IS = Interpolation(KEEP)


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    more: common.More = None,
    *,
    out: common.Out = None,
    fps: Annotated[
        float, typer.Option("--fps", metavar="N", help="Frames per second; any number above 0.", show_default=False)
    ],
    interpolation: Annotated[
        Interpolation, typer.Option("--interpolation", help="Interpolation of the new keys.")
    ] = AS_IT_IS,
    snap: Annotated[bool, typer.Option("--snap", help="Move the keys of STEP tracks to the grid too.")] = False,
    clip: common.Clips = None,
    node: common.Nodes = None,
    path: common.Paths = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> int:
    """Resample clips to a regular grid of frames.

    Frame k is at the clip's start + k / fps; start and end stay exact. STEP tracks keep the times of their jumps, and
    constant tracks keep their keys. The last line reports the largest error of any vertex, measured on the written
    file, and a larger one around a node that moves no vertex, such as a socket.
    """
    if not fps > 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    reporter, selection = Reporter(quiet, verbose), Selection(clip or (), node or (), path or ())

    def edit(input: str, output: str) -> None:
        edit_clips(
            input,
            output,
            selection,
            lambda each, tracks, _: resample(
                each, fps=fps, interpolation=interpolation.value, snap=snap, tracks=tracks
            ),
            reporter,
            dry_run=dry_run,
        )

    return many_files.edit_named(input, output, more or (), out, edit, reporter, dry_run=dry_run)

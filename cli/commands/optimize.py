"""`gltf-anim optimize`: smaller animations within an error bound, verified on the written file."""

from __future__ import annotations

import time
from enum import StrEnum
from typing import Annotated

import typer

from anim.model import Scene
from anim.optimization.options import (
    DEFAULT_MAX_ERROR,
    EFFORTS,
    PLAYERS,
    Drop,
    Objective,
    Packing,
    Policy,
    Reference,
    Request,
)
from cli.io import documents
from cli.options import common
from cli.reports import image_notes, optimize_report
from cli.text import Reporter
from cli.workflows import many_files, optimize_job, optimize_outputs
from cli.workflows.rate_curve import write_curve


class Meshopt(StrEnum):
    """Compression extension."""

    EXT = "ext"
    KHR = "khr"


class Player(StrEnum):
    """Players for which the error bound holds."""

    ANY = "any"
    SPEC = "spec"


Effort = StrEnum("Effort", [(name, name) for name in EFFORTS])  # type: ignore[misc]
BALANCED, FAST = Effort("balanced"), Effort("fast")  # without --effort; of curves, which are many searches


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    more: common.More = None,
    *,
    out: common.Out = None,
    max_error: Annotated[
        str | None,
        typer.Option(
            "--max-error",
            metavar="LENGTH",
            help="Maximum error of any vertex: 0.5mm, 2cm, 0 (lossless), or a part of the model's size; "
            "0.01% by default. Alone, the result is the smallest file within it.",
        ),
    ] = None,
    max_bytes: Annotated[
        str | None,
        typer.Option(
            "--max-bytes",
            metavar="SIZE",
            help="Maximum file size, like 800kB: the result has the smallest error found that fits, not the fewest "
            "bytes. Exit 6 if that error is above --max-error, or without it above 10 % of the model's size.",
        ),
    ] = None,
    meshopt: Annotated[
        Meshopt | None,
        typer.Option("--meshopt", help="Compress by EXT_ or KHR_meshopt_compression too.", show_default=False),
    ] = None,
    drop: Annotated[
        Drop,
        typer.Option(
            "--drop",
            help="Channels equal to the rest pose that are dropped: rest: in each clip; unused: if in all "
            "clips; never: none.",
        ),
    ] = Drop.UNUSED,
    rebase_rest: Annotated[
        bool, typer.Option("--rebase-rest", help="Move the rest pose to the value at which most clips are constant.")
    ] = False,
    drop_invisible: Annotated[
        bool, typer.Option("--drop-invisible", help="Drop channels of nodes that move no vertex.")
    ] = False,
    keep_node: Annotated[
        list[str] | None,
        typer.Option(
            "--keep-node", metavar="GLOB", help="Keep the motion of nodes with this name exact; may be repeated."
        ),
    ] = None,
    reference: Annotated[
        Reference,
        typer.Option("--reference", help="Measure errors against the motion at all times, or at its keys only."),
    ] = Reference.CURVE,
    shell: Annotated[
        str,
        typer.Option(
            "--shell", metavar="LENGTH", help="Distance from nodes without vertices at which their error is measured."
        ),
    ] = "1%",
    max_pointer_error: Annotated[
        str,
        typer.Option(
            "--max-pointer-error",
            metavar="FRACTION",
            help="Maximum error of tracks that move no node and weights that move no vertex, as a part of their range.",
        ),
    ] = "0.01%",
    max_angle: Annotated[
        str | None,
        typer.Option("--max-angle", metavar="ANGLE", help="Maximum rotation error of any node, like 0.5deg."),
    ] = None,
    max_speed_error: Annotated[
        str | None,
        typer.Option(
            "--max-speed-error",
            metavar="LENGTH",
            help="Maximum speed error of any vertex, per second: 5mm (against jitter).",
        ),
    ] = None,
    player: Annotated[
        Player,
        typer.Option("--player", help="Players in which the bound holds: any, or those that slerp as glTF specifies."),
    ] = Player.ANY,
    objective: Annotated[
        Objective, typer.Option("--objective", help="Size to minimize: of the file, or of the file after gzip.")
    ] = Objective.FILE,
    effort: Annotated[
        Effort | None,
        typer.Option(
            "--effort",
            help="Search effort: more is smaller and slower.",
            show_default="balanced; with --curve fast",
        ),
    ] = None,
    workers: Annotated[
        int, typer.Option("--jobs", "-j", metavar="N", min=0, help="Number of processes; 0: one per core.")
    ] = 0,
    report: Annotated[
        str | None, typer.Option("--report", metavar="FILE", help="Write all measurements as JSON; '-' for stdout.")
    ] = None,
    html: common.Html = None,
    curve_file: Annotated[
        str | None,
        typer.Option(
            "--curve",
            metavar="FILE",
            help="Write the size of animations against error as .csv, .png or .svg, and no glTF; with --effort "
            "balanced the sizes that optimize reaches without an effort.",
        ),
    ] = None,
    clip: common.Clips = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> int:
    """Make animations smaller, within an error that no vertex exceeds.

    The bound holds for every skinned and morphed vertex at all times, in players that slerp and in players that
    interpolate quaternions by component. It is measured on the written bytes. Exit 6, with nothing written, if
    --max-bytes can't be met or the measurement fails.

    Channels without effect are dropped, constant tracks become one key, equal data is shared, keys and time axes are
    chosen together, and rotations become int16. A clip without a lossy result within all bounds is stored without loss.
    Clips keep their exact start and end time, closed loops stay closed to the bit, and STEP stays STEP.

    The same command on its own output changes nothing. With another bound it starts from that output, and errors add
    up.
    """
    reporter = Reporter(quiet, verbose)
    max_count = None if max_bytes is None else optimize_job.count_of_bytes(max_bytes)
    outputs = optimize_outputs.OptimizeOutputs(report, html, curve_file, dry_run)
    outputs.check_options(out=out, max_bytes=max_bytes)
    lengths = {
        "max_error": DEFAULT_MAX_ERROR if max_error is None else max_error,
        "shell": shell,
        "max_pointer_error": max_pointer_error,
        "max_angle": max_angle,
        "max_speed_error": max_speed_error,
    }

    def request(scene: Scene) -> Request:
        bounds = optimize_job.bounds(scene, lengths)
        optimize_job.warn_without_units(lengths, reporter.warn)
        nodes = optimize_job.nodes_to_keep(keep_node or (), scene)
        return Request(
            bounds,
            Policy(drop, reference, rebase_rest, drop_invisible, nodes),
            Packing.CORE if meshopt is None else Packing(meshopt.value),
            objective,
            str(effort or (BALANCED if curve_file is None else FAST)),
            PLAYERS if player is Player.ANY else ("spec",),
            optimize_job.raw_options(bounds, lengths),
        )

    def edit(input: str, output: str) -> None:
        began = time.perf_counter()
        outputs.check_paths(output)
        with documents.source(input, reporter) as source:
            optimizer = optimize_job.make_optimizer(
                source,
                output,
                clip=clip or (),
                workers=workers,
                detailed=report is not None or verbose,
                reporter=reporter,
            )
            wanted = request(optimizer.scene)
            if rebase_rest:
                optimize_job.note_rest_pose(optimizer.document, source.name, reporter)
            if curve_file is not None:
                write_curve(optimizer, wanted, curve_file, source.name, reporter, dry_run=dry_run)
                return
            ceiling = None if max_error is None else wanted.bounds.max_error
            wanted, found = optimize_job.optimize_within(optimizer, wanted, max_count, ceiling)
            optimize_report.check(found, optimizer.clips, wanted, optimizer.scale)
            image_notes.warn_of_pipe(source.document, source.folder, output, reporter)  # the report lists warnings
            about = optimize_outputs.describe(optimizer, wanted, found, source, output, began, max_count)
            with (
                optimize_outputs.write_report(about, reporter, report, dry_run=dry_run),
                optimize_outputs.write_comparison(about, reporter, html, input, dry_run=dry_run),
            ):
                documents.write(about.after, output, source, dry_run=dry_run, reporter=reporter)
        optimize_outputs.report_result(about, reporter, dry_run=dry_run)
        if not dry_run:
            image_notes.report(about.after, source, output, reporter)

    return many_files.edit_named(input, output, more or (), out, edit, reporter, dry_run=dry_run)

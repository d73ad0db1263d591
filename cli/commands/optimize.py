"""`gltf-anim optimize`: smaller animations within an error bound, verified on the written file."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path, PurePath
from typing import Annotated

import typer

from anim.gltf.io import container
from anim.measure.error.surface import is_measured_at
from anim.model import Scene
from anim.optimization.optimize import Optimized
from anim.optimization.options import EFFORTS, PLAYERS, Drop, Objective, Packing, Policy, Reference, Request
from cli.errors import UsageError
from cli.io import documents
from cli.options import common
from cli.reports import optimize_json, optimize_report
from cli.text import Reporter
from cli.workflows import many_files, optimize_job
from cli.workflows.edit_clips import note_images
from cli.workflows.optimize_job import OptimizeJob
from cli.workflows.rate_curve import check_curve_file, write_curve


class Meshopt(StrEnum):
    """Compression extension."""

    EXT = "ext"
    KHR = "khr"


class Player(StrEnum):
    """Players for which the error bound holds."""

    ANY = "any"
    SPEC = "spec"


Effort = StrEnum("Effort", [(name, name) for name in EFFORTS])  # type: ignore[misc]
BALANCED = Effort("balanced")


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
            "0.01% by default.",
        ),
    ] = None,
    max_bytes: Annotated[
        str | None,
        typer.Option(
            "--max-bytes",
            metavar="N",
            help="Maximum file size, like 800kB: the smallest error found that fits, up to --max-error if given.",
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
            help="Maximum error of tracks that move no node, as a fraction of their range.",
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
    effort: Annotated[Effort, typer.Option("--effort", help="Search effort: more is smaller and slower.")] = BALANCED,
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
            help="Write the size of animations against error as .csv, .png or .svg, and no glTF.",
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
    outputs = _Outputs(report, html, curve_file, dry_run)
    outputs.check_options(out=out, max_bytes=max_bytes)
    lengths = {
        "max_error": optimize_job.DEFAULT_MAX_ERROR if max_error is None else max_error,
        "shell": shell,
        "max_pointer_error": max_pointer_error,
        "max_angle": max_angle,
        "max_speed_error": max_speed_error,
    }

    def request(scene: Scene) -> Request:
        bounds = optimize_job.bounds(scene, lengths)
        for words in optimize_job.notes(lengths):
            reporter.warn(words)
        nodes = optimize_job.nodes_to_keep(keep_node or (), scene)
        return Request(
            bounds,
            Policy(drop, reference, rebase_rest, drop_invisible, nodes),
            Packing.CORE if meshopt is None else Packing(meshopt.value),
            objective,
            str(effort),
            PLAYERS if player is Player.ANY else ("spec",),
            optimize_job.raw_options(bounds, lengths),
        )

    def edit(input: str, output: str) -> None:
        began = time.perf_counter()
        outputs.check_paths(input, output)
        with documents.source(input, reporter) as source:
            work = optimize_job.optimize_job(
                source,
                output,
                clip=clip or (),
                workers=workers,
                detailed=report is not None or verbose,
                reporter=reporter,
            )
            wanted = request(work.scene)
            if curve_file is not None:
                write_curve(work, wanted, curve_file, reporter, dry_run=dry_run)
                return
            if max_count is None:
                found = work.run(wanted)
            else:
                ceiling = None if max_error is None else wanted.bounds.max_error
                wanted, found = work.fitted(wanted, max_count, ceiling=ceiling)
            optimize_report.check(found, work.clips, wanted, work.scale)
            about = _about(work, wanted, found, began)
            with _report(about, reporter, report, dry_run=dry_run):
                documents.write(about.after, output, source, dry_run=dry_run, reporter=reporter)
        _report_result(about, reporter, dry_run=dry_run)
        if not dry_run:
            if html is not None:
                _write_comparison(html, input, about, reporter)
            note_images(about.after, source, output, reporter)

    return many_files.edit_named(input, output, more or (), out, edit, reporter, dry_run=dry_run)


@dataclass(frozen=True, slots=True)
class _Outputs:
    """Files beside the model, None for those not asked for."""

    report: str | None
    html: str | None
    curve: str | None
    dry_run: bool

    def check_options(self, *, out: str | None, max_bytes: str | None) -> None:
        """Raise UsageError for options that exclude each other."""
        if self.curve is not None and (max_bytes is not None or self.report is not None):
            raise UsageError("--curve goes with neither --max-bytes nor --report")
        if out is not None and (self.report is not None or self.curve is not None):
            raise UsageError(f"--{'curve' if self.report is None else 'report'} is about one file: leave out --out")
        if self.html is not None:
            from cli.io.page_output import check_page  # imports readers of all formats, as in the function below

            check_page(self.html, "--html")
            if out is not None or self.curve is not None:
                raise UsageError(f"--html goes with neither --{'out' if self.curve is None else 'curve'}")

    def check_paths(self, input: str, output: str) -> None:
        """Raise before any work for outputs that can't be written or are another file of the command."""
        if self.curve is not None:
            check_curve_file(self.curve)
        elif not self.dry_run:
            documents.check_output(output)
        if self.report is not None and self.report != documents.PIPE:
            _check_report(self.report, input, output)
        if self.report == output == documents.PIPE and self.curve is None and not self.dry_run:
            raise UsageError("--report and OUT can't both be stdout")


def _about(work: OptimizeJob, request: Request, found: Optimized, began: float) -> optimize_report.OptimizeReport:
    """Return the report on an optimization."""
    source, result = work.source, work.smaller(found)
    name = source.name if work.output == documents.PIPE else work.output
    size, measured_at = work.size(result), is_measured_at(work.scene)
    seconds = time.perf_counter() - began
    return optimize_report.OptimizeReport(
        name, source.document, result, work.clips, found, request, work.scale, source.size, size, seconds, measured_at
    )


@contextmanager
def _report(
    about: optimize_report.OptimizeReport, reporter: Reporter, path: str | None, *, dry_run: bool
) -> Iterator[None]:
    """Write the report around the block that writes the model: if one of them fails, neither file changes.

    On stdout the report is written first, so that the model stays unchanged if the report can't be written.
    """
    if path is None or (dry_run and path != documents.PIPE):
        yield
        return
    warnings = [*reporter.warnings, *optimize_report.warnings(about)]
    with documents.commit_text_after(optimize_json.as_json(about, warnings=warnings), path):
        yield


def _report_result(about: optimize_report.OptimizeReport, reporter: Reporter, *, dry_run: bool) -> None:
    for line in optimize_report.lines(about, dry_run=dry_run):
        reporter.info(line)
    for words in optimize_report.warnings(about):
        reporter.warn(words)
    for line in optimize_report.details(about) if reporter.verbose else ():
        reporter.verbose_info(line)


def _check_report(report: str, input: str, output: str) -> None:
    """Raise UsageError for a report path that is a model's."""
    documents.check_file(report)
    if PurePath(report).suffix.lower() in (*container.SUFFIXES, ".bin") or Path(report).resolve() in {
        Path(other).resolve() for other in (input, output) if other != documents.PIPE
    }:
        raise UsageError(f"{report}: --report would take the place of a model (expected a .json file of its own)")


def _write_comparison(html: str, input: str, about: optimize_report.OptimizeReport, reporter: Reporter) -> None:
    """Write the page that compares the model before and after."""
    from cli.io.page_output import page_file, write_page
    from cli.reports.page_panels import size_panels
    from cli.workflows.page_comparison import compare_files, worst_view

    before = page_file(input, about.before, about.size_before)
    after = replace(before, document=about.after, name=PurePath(about.name).name, size=about.size_after)
    content = compare_files(before, after, reporter)
    view = worst_view(before, content)
    write_page(html, before, after, reporter, content=content, panels=size_panels(about), view=view)

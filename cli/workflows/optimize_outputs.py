"""Outputs of `optimize` beside the model: report, page of both versions, and the result on the terminal."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import PurePath

from anim.gltf.io import container
from anim.gltf.io.source import Source
from anim.measure.error.surface import is_measured_at
from anim.optimization.file_optimizer import FileOptimizer
from anim.optimization.optimize import Optimized
from anim.optimization.options import Request
from cli import streams
from cli.errors import UsageError
from cli.io import documents
from cli.reports import optimize_json, optimize_report
from cli.text import Reporter
from cli.workflows.rate_curve import check_curve_file


@dataclass(frozen=True, slots=True)
class OptimizeOutputs:
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

    def check_paths(self, output: str) -> None:
        """Raise before any work for outputs that can't be written, or a report with the name of a model."""
        if self.curve is not None:
            check_curve_file(self.curve)
        elif not self.dry_run:
            documents.check_output(output)
        if self.report is not None and self.report != documents.PIPE:
            documents.check_file(self.report)
            if PurePath(self.report).suffix.lower() in (*container.SUFFIXES, ".bin"):
                raise UsageError(f"{self.report}: --report would take the place of a model (expected a .json file)")
        if self.report == output == documents.PIPE and self.curve is None and not self.dry_run:
            raise UsageError("--report and OUT can't both be stdout")


def describe(
    optimizer: FileOptimizer,
    request: Request,
    found: Optimized,
    source: Source,
    output: str,
    began: float,
    max_bytes: int | None,
) -> optimize_report.OptimizeReport:
    """Return the report on an optimization. began: s, when, by `time.perf_counter`. max_bytes: None without a limit."""
    result, size = optimizer.choose_document(found)
    return optimize_report.OptimizeReport(
        source.name if output == documents.PIPE else output,
        source.document,
        result,
        optimizer.clips,
        found,
        request,
        optimizer.scale,
        source.size,
        size,
        time.perf_counter() - began,
        is_measured_at(optimizer.scene),
        max_bytes,
    )


@contextmanager
def write_report(
    about: optimize_report.OptimizeReport, reporter: Reporter, path: str | None, *, dry_run: bool
) -> Iterator[None]:
    """Write the report around the block that writes the model: if one of them fails, neither file changes.

    On stdout the report is written first, so that the model stays unchanged if the report can't be written, and also
    with `dry_run`, which else only makes it.
    """
    if path is None:
        yield
        return
    warnings = [*reporter.warnings, *optimize_report.warnings(about)]
    made = optimize_json.as_json(about, warnings=warnings)
    with nullcontext() if dry_run and path != documents.PIPE else documents.commit_text_after(made, path):
        yield


def report_result(about: optimize_report.OptimizeReport, reporter: Reporter, *, dry_run: bool) -> None:
    streams.state_error(optimize_report.largest_error(about))
    for line in () if reporter.quiet else optimize_report.lines(about, dry_run=dry_run):
        reporter.info(line)
    for words in optimize_report.warnings(about):
        reporter.warn(words)
    for line in optimize_report.details(about) if reporter.verbose else ():
        reporter.verbose_info(line)


@contextmanager
def write_comparison(
    about: optimize_report.OptimizeReport, reporter: Reporter, html: str | None, input: str, *, dry_run: bool
) -> Iterator[None]:
    """Write the page that compares the model before and after around the block that writes the model."""
    if html is None:
        yield
        return
    from anim.show.page.page import page
    from cli.io.page_output import commit_page_after, page_file
    from cli.reports.page_panels import size_panels
    from cli.workflows.page_comparison import compare_files, worst_view

    before = page_file(input, about.before, about.size_before)
    after = replace(before, document=about.after, name=PurePath(about.name).name, size=about.size_after)
    content = compare_files(before, after, reporter)
    content = replace(content, panels=(*size_panels(about), *content.panels))
    made = page(before, after, view=worst_view(before, content), content=content)
    with commit_page_after(html, made, reporter, dry_run=dry_run):
        yield

"""Reports of simulations: one JSON document, or a picture."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import PurePath

from anim.show.plots.figure import FORMATS
from anim.show.plots.simulation_plot import simulation_plot
from anim.simulation.report import SimulationReport
from cli.errors import UsageError
from cli.io import documents
from cli.reports import json_report


def check_report(path: str | None) -> str:
    """Return the format of a report by its extension, "" for None. Raises UsageError unless it can be written."""
    if path is None:
        return ""
    kind = PurePath(path).suffix.lower()[1:]
    if kind not in ("json", *FORMATS):
        expected = " or ".join([", ".join(f".{each}" for each in ("json", FORMATS[0])), f".{FORMATS[1]}"])
        raise UsageError(f"--report {path}: unsupported report format (expected {expected})")
    documents.check_file(path)
    return kind


def write_report(report: SimulationReport, path: str) -> None:
    """Write a report as JSON, or as its picture, in the format of the path's extension."""
    documents.write_text(_render(report, path), path)


@contextmanager
def commit_report_after(report: SimulationReport, path: str | None, *, dry_run: bool) -> Iterator[None]:
    """Write a report around the block that writes the output: if one of them fails, neither file changes.

    dry_run: only make the report, so that its errors are known.
    """
    made = "" if path is None else _render(report, path)
    with nullcontext() if path is None or dry_run else documents.commit_text_after(made, path):
        yield


def _render(report: SimulationReport, path: str) -> str | bytes:
    """The content of the file. Raises FormatError for numbers without JSON, UnsupportedError without matplotlib."""
    kind = PurePath(path).suffix.lower()[1:]
    if kind == "json":
        return json_report.dump(report.to_json(), indent=2)
    return simulation_plot(report, kind=kind)

"""Reports of simulations: one JSON document, or a picture."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np

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
    kind = PurePath(path).suffix.lower()[1:]
    if kind == "json":
        documents.write_text(json_report.dump(report.to_json(), indent=2), path)
        return
    documents.write_bytes([np.frombuffer(simulation_plot(report, kind=kind), np.uint8)], path)

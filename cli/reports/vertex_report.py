"""Report of `diff` by vertex: of a bake and its source, or of two caches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from anim.measure.compare.vertex_distance import VertexDistance
from anim.units import plural
from cli import tables
from cli.reports import json_report
from cli.text import format_change, format_length

SCHEMA = 1
HEADER = ("clip", "mesh", "vertex", "time s", "max error", "% of size", "p99", "mean")


@dataclass(frozen=True, slots=True)
class VertexReport:
    """Comparison of two files by vertex. names, sizes: of the files. mesh, vertex: position of the largest error."""

    names: tuple[str, str]
    sizes: tuple[int, int]
    clip: str
    found: VertexDistance
    mesh: str
    vertex: int
    fps: float

    @property
    def percent(self) -> float:
        """Largest error in percent of the diagonal."""
        return 100 * self.found.max_error / self.found.diagonal if self.found.diagonal else 0.0


def text(report: VertexReport) -> str:
    """Return a row, and a summary."""
    found = report.found
    vertex = str(report.vertex) if found.vertex >= 0 else ""
    lengths = [format_length(each) for each in (found.max_error, found.p99, found.mean)]
    row: list[tables.Cell] = [report.clip, report.mesh, vertex, f"{found.time:.3f}", lengths[0]]
    table = tables.text([*HEADER], [[*row, f"{report.percent:.2g}", *lengths[1:]]], left=2, indent="")
    names, sizes = " → ".join(report.names), format_change(*report.sizes)
    return f"{table}\n{plural(found.frames, 'time')} compared by vertex, max {lengths[0]}\n{names}: {sizes}\n"


def as_json(report: VertexReport, *, warnings: Sequence[str] = ()) -> str:
    """Return the report as a JSON document, units in the keys."""
    found = report.found
    error = {"max_error_m": found.max_error, "max_error_percent": report.percent}
    where = {"time_s": found.time, "mesh": report.mesh, "vertex": report.vertex if found.vertex >= 0 else None}
    clip = {"clip": report.clip, **error, **where, "times": found.frames, "p99_m": found.p99, "mean_m": found.mean}
    content = {
        "schema": SCHEMA,
        "files": [{"file": name, "bytes": size} for name, size in zip(report.names, report.sizes, strict=True)],
        "grid_fps": report.fps,
        "diagonal_m": found.diagonal,
        "measured_at": "vertices",
        **error,
        "clips": [clip],
        "warnings": list(warnings),
    }
    return json_report.dump(content)

"""Report of `loop`: a table, or a JSON document."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import NamedTuple

from anim.measure.loops.loop_analysis import Loop
from anim.measure.loops.loop_kind import LoopKind
from anim.units import list_some
from cli import tables
from cli.reports import json_report
from cli.text import format_length, format_speed

SCHEMA = 1
MAX_LISTED_JOINTS = 3  # joints that a table or a message lists
UNITS = {"start": "start_s", "end": "end_s", "seam": "seam_m", "speed_seam": "speed_seam_m_per_s"}
UNITS |= {"frame": "frame_motion_m", "travel": "travel_m", "fps": "frame_rate_fps", "joints": "open_joints"}


class LoopReport(NamedTuple):
    """Analyses by names of clips, with lines of advice and notes. on_skin: measured at vertices, not nodes."""

    rows: Sequence[tuple[str, Loop]]
    advice: Sequence[str]
    notes: Sequence[str]
    on_skin: bool


def text(report: LoopReport) -> str:
    """Return a row per clip or time range, then advice and notes."""
    lines = "".join(f"  {line}\n" for line in (*report.advice, *report.notes))
    return "\n".join(filter(None, (_table(report) if report.rows else "", lines)))


def as_json(report: LoopReport, *, warnings: Sequence[str]) -> str:
    """Return the report as a JSON document, units in the keys. warnings: on the file."""
    content = {
        "schema": SCHEMA,
        "measured_on": "skin" if report.on_skin else "nodes",
        "loops": [_facts(name, each) for name, each in report.rows],
        "advice": list(report.advice),
        "notes": list(report.notes),
        "warnings": list(warnings),
    }
    return json_report.dump(content)


def joint_names(found: Loop, *, quote: bool = False) -> str:
    """Return the names of the joints that stay open, the largest loop gap first."""
    names = [f"'{each.joint}'" if quote else each.joint for each in found.joints]
    return list_some(names, MAX_LISTED_JOINTS)


def _table(report: LoopReport) -> str:
    header = [
        "clip",
        "seconds",
        "kind",
        "loop gap" if report.on_skin else "loop gap (nodes)",
        "frame step",
        "at fps",
        "velocity gap",
        "velocity step",
        "at",
        "root motion",
    ]
    cells: list[list[tables.Cell]] = [
        [
            name,
            f"{each.start:.4g}–{each.end:.4g}",
            str(each.kind),
            format_length(each.seam),
            format_length(each.inside.largest),
            f"{each.fps:.4g}" if each.end > each.start else "",
            format_speed(each.speed_seam),
            format_speed(each.inside.speed),
            joint_names(each) if each.kind is LoopKind.CLOSED_EXCEPT else each.node,
            format_length(each.travel) if each.travel else "",
        ]
        for name, each in report.rows
    ]
    return tables.text(header, cells, left=3, indent="")


def _facts(name: str, found: Loop) -> dict[str, object]:
    facts = asdict(found) | {"joints": [{"joint": one.joint, "gap_m": one.gap} for one in found.joints]}
    facts["largest_frame_motion_m"] = found.inside.largest
    facts["typical_frame_motion_m"] = found.inside.typical
    facts["largest_speed_change_m_per_s"] = found.inside.speed
    del facts["inside"]
    return {"clip": name, **{UNITS.get(key, key): value for key, value in facts.items()}}

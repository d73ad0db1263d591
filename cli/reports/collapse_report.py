"""Report of `collapse`: a table with recommendations, or a JSON document."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from anim.skinning.analysis.collapse import LOW_INDEX, MeshCollapse
from anim.skinning.analysis.collapsed_clips import MIN_VOLUME_FRACTION, is_collapsed
from anim.skinning.analysis.method_scores import BULGE_RATIO, MethodScore
from anim.skinning.analysis.recommendations import CollapseFinding, recommend
from anim.units import plural
from cli import tables
from cli.reports import json_report

SCHEMA = 1


@dataclass(frozen=True, slots=True)
class CollapseReport:
    """The analyzed file, the options, and the findings.

    name: of the file. meshes: number of skinned ones. clamped: whether methods other than lbs had the bulge clamp.
    warnings: on the file, for the report.
    """

    name: str
    meshes: int
    methods: tuple[str, ...]
    clamped: bool
    fps: float
    found: Sequence[CollapseFinding]
    warnings: Sequence[str] = ()

    @property
    def clips(self) -> int:
        """Number of analyzed clips."""
        return len({each.number for each in self.found})


def worst_of_clips(found: Sequence[CollapseFinding]) -> list[CollapseFinding]:
    """Return the worst mesh of each clip, in the order of the clips."""
    worst: dict[int, CollapseFinding] = {}
    for each in found:
        if each.number not in worst or each.mesh.worst.index < worst[each.number].mesh.worst.index:
            worst[each.number] = each
    return list(worst.values())


def text(seen: CollapseReport, *, every: bool) -> str:
    """Return a row for the worst mesh of each clip, or for every mesh, and recommendations."""
    shown = seen.found if every else worst_of_clips(seen.found)
    header = ["clip", "mesh", "min index", f"below {LOW_INDEX}", "inverted", "at", "joints", "angle"]
    header += [f"min volume {each}" for each in seen.methods] + [f"max bulge {each}" for each in seen.methods]
    table = tables.text(header, [_row(each) for each in shown], left=2) + "\n" if shown else ""
    lines = "".join(f"  {line}\n" for line in recommend(seen.found, clamped=seen.clamped))
    return f"{_head(seen, every=every)}\n\n{table}{lines}"


def as_json(seen: CollapseReport) -> str:
    """Return the report as a JSON document, units in the keys."""
    clips: dict[int, dict[str, Any]] = {}
    for each in seen.found:
        clips.setdefault(each.number, {"clip": each.clip, "meshes": []})["meshes"].append(_mesh(each.mesh))
    content = {
        "schema": SCHEMA,
        "file": seen.name,
        "fps": seen.fps,
        "methods": list(seen.methods),
        "bulge_clamp": seen.clamped,
        "low_index": LOW_INDEX,
        "low_volume": MIN_VOLUME_FRACTION,
        "bulge_ratio": BULGE_RATIO,
        "skinned_meshes": seen.meshes,
        "clips": list(clips.values()),
        "advice": list(recommend(seen.found, clamped=seen.clamped)),
        "warnings": list(seen.warnings),
    }
    return json_report.dump(content)


def _head(seen: CollapseReport, *, every: bool) -> str:
    meshes = f"{seen.meshes} skinned {'mesh' if seen.meshes == 1 else 'meshes'}"
    parts = [f"{seen.name}: {plural(seen.clips, 'clip')}, {meshes}"]
    if seen.clamped:
        parts.append(f"{', '.join(each for each in seen.methods if each != 'lbs')} with --bulge-clamp")
    if not every and seen.meshes > 1 and seen.clips:
        parts.append("the worst mesh of each clip (-v: all)")
    return "; ".join(parts)


def _row(found: CollapseFinding) -> list[tables.Cell]:
    mesh = found.mesh
    worst = mesh.worst
    two = worst.joint != worst.other
    cells: list[tables.Cell] = [
        found.clip,
        mesh.mesh,
        f"{worst.index:.2f}",
        _percent(mesh.low),
        _percent(mesh.inverted),
        f"{worst.time:.2f} s" if worst.joint else None,
        f"{worst.joint} ~ {worst.other}" if two else worst.joint or None,
        f"{math.degrees(worst.angle):.0f}° {'twist' if worst.twist else 'bend'}" if two else None,
    ]
    cells += [None if each.volume is None else f"{100 * each.volume.min():.0f} %" for each in mesh.methods]
    return [*cells, *(f"{each.bulge:.2f}×" if each.bulge > 1 else None for each in mesh.methods)]


def _percent(share: float) -> str | None:
    return f"{100 * share:{'.0f' if share > 0.1 else '.2g'}} %" if share else None


def _mesh(mesh: MeshCollapse) -> dict[str, Any]:
    worst = mesh.worst
    return {
        "mesh": mesh.mesh,
        "node": mesh.node,
        "vertices": mesh.vertices,
        "pinches": is_collapsed(mesh),
        "index": worst.index,
        "vertex": worst.vertex,
        "time_s": worst.time,
        "joint": worst.joint,
        "other_joint": worst.other,
        "angle_deg": math.degrees(worst.angle),
        "twist": worst.twist,
        "share_below_low": mesh.low,
        "share_inverted": mesh.inverted,
        "share_of_faces_closed": mesh.closed,
        "methods": [_method_row(each, mesh) for each in mesh.methods],
    }


def _method_row(fared: MethodScore, mesh: MeshCollapse) -> dict[str, Any]:
    about: dict[str, Any] = {"method": fared.method}
    if fared.volume is not None:
        about |= {
            "volume_min": float(fared.volume.min()),
            "volume_min_time_s": float(mesh.times[fared.volume.argmin()]),
            "volume_max": float(fared.volume.max()),
        }
    return about | {
        "bulge_max": fared.bulge,
        "bulge_vertex": fared.vertex,
        "bulge_joint": fared.joint,
        "bulge_time_s": fared.time,
        "share_bulging": fared.bulging,
        "max_off_lbs_m": fared.max_distance,
        "max_off_lbs_time_s": fared.max_distance_time,
        "unusable": fared.unusable,
    }

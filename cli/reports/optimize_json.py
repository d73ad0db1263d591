"""JSON report of `optimize`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.inspect.storage_cost import storage_costs
from anim.measure.inspect.stored_bytes import stored_bytes
from anim.optimization.search.plan import Solution
from cli.reports import json_report, optimize_bound
from cli.reports.optimize_report import OptimizeReport, count_keys

SCHEMA = 1


def as_json(about: OptimizeReport, *, warnings: Sequence[str] = ()) -> str:
    """Return the report as a JSON document, schema 1. warnings: issued so far."""
    request = about.request
    content = {
        "schema": SCHEMA,
        "output": about.name,
        "unchanged": about.unchanged,
        "unchanged_because": about.unchanged_because,
        "seconds": round(about.seconds, 3),
        "diagonal_m": about.scale,
        "measured_at": about.measured_at,
        "optimized_before": about.optimized_before,
        "bounds": {
            "max_error_m": request.bounds.max_error,
            "shell_m": request.bounds.shell,
            "max_pointer_error": request.bounds.max_pointer_error,
            "max_angle_deg": None if request.bounds.max_angle is None else math.degrees(request.bounds.max_angle),
            "max_speed_error_m_per_s": request.bounds.max_speed_error,
        },
        "policy": {
            "drop": str(request.policy.drop),
            "reference": str(request.policy.reference),
            "rebase_rest": request.policy.rebase_rest,
            "drop_invisible": request.policy.drop_invisible,
            "kept_nodes": sorted(request.policy.keep),
            "packing": str(request.packing),
            "objective": str(request.objective),
            "effort": request.effort,
            "players": list(request.players),
        },
        "bytes": {
            "before": _bytes(about.size_before, about.before),
            "after": _bytes(about.size_after, about.after),
        },
        "moved_rest": [_target(about, node, path) for node, path in about.found.moved],
        "clips": [] if about.unchanged else [_clip(about, i, each) for i, each in about.found.solutions.items()],
        "warnings": list(warnings),
    }
    return json_report.dump(content, indent=2)


def _bytes(file: int, document: Document) -> dict[str, int]:
    whole = storage_costs(document)[1]
    return {"file": file, "data": whole.data, "stored": stored_bytes(document), "json": whole.json}


def _target(about: OptimizeReport, node: int | None, path: str, pointer: str | None = None) -> dict[str, Any]:
    if node is None:
        return {"pointer": pointer, "path": path}
    names = reader.skeleton(about.before).names
    return {"node": node, "name": names[node] if node < len(names) else "", "path": path}


def _clip(about: OptimizeReport, number: int, solution: Solution) -> dict[str, Any]:
    source, verdict = about.clips[number], about.found.verdicts[number]
    error, rest = verdict.error, verdict.statistics
    assert rest is not None  # a report asks for details
    return {
        "number": number,
        "name": source.name,
        "end_s": source.end,
        "keys_before": count_keys(source),
        "keys_after": count_keys(solution.clip),
        "tracks_before": len(source.tracks),
        "tracks_after": len(solution.clip.tracks),
        "max_error_m": error.max_error,
        "max_error_percent": 100 * error.max_error / about.scale if about.scale else 0.0,
        "at": {
            "mesh": error.place,
            "joint": error.joint,
            "vertex": error.vertex,
            "time_s": error.time,
            "player": verdict.player,
        },
        "certified_error_m": verdict.certified,
        "not_certified_because": optimize_bound.why_not(verdict, about.request),
        "p99_m": rest.p99,
        "mean_m": rest.mean,
        "max_angle_deg": math.degrees(rest.angle.size),
        "max_speed_error_m_per_s": rest.speed.size,
        "max_weight_error": rest.weight.size,
        "max_pointer_error": error.max_pointer_error,
        "times_checked": error.times,
        "without_loss": number in about.found.without_loss,
        "dropped": [
            _target(about, track.node, track.path, track.pointer)
            for track in (source.tracks[k] for k in solution.dropped)
        ],
    }

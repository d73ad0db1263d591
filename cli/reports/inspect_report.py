"""Report of `inspect`: a text page, and rows of tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, TypeVar

from anim.check.finding import Finding, Occurrence
from anim.gltf.reading.reader import clip_name
from anim.measure.inspect.report import ClipReport, Facts, SkinReport, TrackReport
from anim.units import plural
from cli import tables
from cli.tables import Cell
from cli.text import format_bytes, format_length, format_span, format_speed

if TYPE_CHECKING:
    from anim.measure.continuity.continuity import TrackContinuity

PATHS = ("translation", "rotation", "scale", "weights", "pointer")
MIN_ROOT_DISTANCE_M = 1e-4  # smaller displacements of the root show no speed
MARKS = {"error": "error  ", "warning": "warning", "info": "info   "}
T = TypeVar("T")
Smoothness: TypeAlias = "tuple[tuple[TrackContinuity, ...], ...]"  # per clip and track


class Inspected(NamedTuple):
    """A file's name, size, contents and findings. occurrences: of each finding, if they are known."""

    name: str
    file_bytes: int
    facts: Facts
    findings: tuple[Finding, ...]
    occurrences: tuple[Sequence[Occurrence], ...] = ()


def page(inspected: Inspected, smooth: Smoothness = (), *, tracks: bool) -> str:
    """Return the page of one file: headline, clips, skins, findings. smooth: tracks of each clip, or ()."""
    facts = inspected.facts
    if facts.faults and not inspected.file_bytes:
        return tables.escape_control(f"{inspected.name}: nothing can be read") + "\n" + _findings(inspected.findings)
    parts = [_headline(inspected.name, inspected.file_bytes, facts)]
    if facts.clips:
        parts.append(_clips(facts.clips))
    if tracks:
        parts += [_tracks(clip) for clip in facts.clips]
    if smooth:
        from cli.reports import continuity_report

        parts += [continuity_report.table(*each) for each in zip(facts.clips, smooth, strict=False)]
    if facts.skins:
        parts.append(_skins(facts.skins))
    parts.append(_findings(inspected.findings))
    return "\n".join(parts)


def clip_rows(files: Sequence[Inspected]) -> tuple[list[str], list[list[Cell]]]:
    """Return header and rows of one table: a row per clip of every file."""
    plain = [each.name for each in fields(ClipReport) if each.name not in ("tracks", "interpolations", "track_list")]
    header = ["file", *plain, *(f"{path}_tracks" for path in PATHS), "interpolations"]
    rows = [
        [
            each.name,
            *(getattr(clip, key) for key in plain),
            *(clip.tracks.get(path, 0) for path in PATHS),
            " ".join(sorted(clip.interpolations)),
        ]
        for each in files
        for clip in each.facts.clips
    ]
    return header, rows


def track_rows(files: Sequence[Inspected]) -> tuple[list[str], list[list[Cell]]]:
    """Return header and rows of one table: a row per track of every clip of every file."""
    header = ["file", "clip", *TrackReport._fields]
    rows: list[list[Cell]] = [
        [each.name, clip_name(clip.name, clip.index), *track]
        for each in files
        for clip in each.facts.clips
        for track in clip.track_list
    ]
    return header, rows


def _headline(name: str, file_bytes: int, facts: Facts) -> str:
    cost = facts.animation_stored_bytes + facts.animation_json_bytes
    counts = [plural(facts.nodes, "node"), plural(facts.meshes, "mesh").replace("meshs", "meshes")]
    if facts.vertices:
        counts.append(f"{facts.vertices} vertices")
    counts += [plural(len(facts.skins), "skin"), plural(len(facts.clips), "clip")]
    if facts.unreadable_clips:
        counts[-1] += f" and {facts.unreadable_clips} unreadable"
    share = f" ({100 * cost / file_bytes:.0f} % of the file)" if file_bytes else ""
    decoded = facts.animation_data_bytes
    unpacked = f" ({format_bytes(decoded)} decoded)" if any("meshopt" in each for each in facts.extensions_used) else ""
    keys, described = format_bytes(facts.animation_stored_bytes), format_bytes(facts.animation_json_bytes)
    parts = f"{keys} of keys{unpacked} + {described} of JSON"
    lines = [f"{name}  {format_bytes(file_bytes)}: {', '.join(counts)}"]
    if cost:
        lines.append(f"  animation: {parts}{share}")
    if facts.generator:
        lines.append(f"  generator: {facts.generator}")
    if facts.extensions_used:
        lines.append(f"  extensions: {', '.join(facts.extensions_used)}")
    return "\n".join(map(tables.escape_control, lines)) + "\n"


def _clips(clips: Sequence[ClipReport]) -> str:
    on_skin = all(clip.seam_measured_on == "skin" for clip in clips)
    spans = [(clip.start_s, clip.end_s) for clip in clips]
    speeds = [clip.root_speed_m_per_s if clip.root_distance_m > MIN_ROOT_DISTANCE_M else None for clip in clips]
    columns: dict[str, list[Cell]] = {
        "clip": [clip_name(clip.name, clip.index) for clip in clips],
        "seconds": _each(lambda span: format_span(*span).removesuffix(" s"), spans),
        "fps": [frame_rate(clip) for clip in clips],
        "T/R/S/W/P": _each("/".join, [tuple([str(clip.tracks.get(path, 0)) for path in PATHS]) for clip in clips]),
        "keys": [clip.keys for clip in clips],
        "interp": ["+".join([name[0] for name in sorted(clip.interpolations)]) for clip in clips],
        "bytes": _each(format_bytes, [clip.stored_bytes + clip.json_bytes for clip in clips]),
        "share": _each("{:.1f} %".format, [100 * clip.share for clip in clips]),
        "constant": _each(_count, [clip.constant_tracks for clip in clips]),
        "no-op": _each(_count, [clip.no_effect_tracks for clip in clips]),
        "redundant": _each(_count, [clip.redundant_keys for clip in clips]),
        "loop gap" if on_skin else "loop gap (nodes)": _each(format_length, [clip.seam_m for clip in clips]),
        "velocity gap": _each(format_speed, [clip.seam_speed_m_per_s for clip in clips]),
        "root speed": _each(lambda speed: "" if speed is None else format_speed(speed), speeds),
    }
    return tables.text(list(columns), list(zip(*columns.values(), strict=True)))


def _each(format: Callable[[T], str], values: Sequence[T]) -> list[Cell]:
    """The values as text, each distinct one formatted once: clips are many and much alike."""
    shown = {value: format(value) for value in set(values)}
    return [shown[value] for value in values]


def _count(count: int) -> str:
    return str(count or "")


def frame_rate(clip: ClipReport) -> str:
    """Return the estimated frame rate, "~" before one that few keys have; "" if there is none."""
    if clip.frame_rate_fps is None or clip.frame_rate_regular is None:
        return ""
    mark = "" if clip.frame_rate_regular >= 0.98 else "~"
    return f"{mark}{clip.frame_rate_fps:.4g}"


def _tracks(clip: ClipReport) -> str:
    header = [
        tables.escape_control(f"tracks of {clip_name(clip.name, clip.index)}"),
        "path",
        "interp",
        "keys",
        "seconds",
    ]
    header += ["constant", "no-op", "redundant", "non-unit", "sign flips", "max step"]
    rows: list[list[Cell]] = [
        [
            track.target,
            track.path,
            track.interpolation.lower(),
            track.keys,
            f"{track.start_s:.4g}–{track.end_s:.4g}",
            track.constant,
            track.no_effect,
            str(track.redundant_keys or ""),
            str(track.non_unit_keys or ""),
            str(track.sign_flips or ""),
            f"{math.degrees(track.widest_step_rad):.1f}°" if track.widest_step_rad else "",
        ]
        for track in clip.track_list
    ]
    return tables.text(header, rows, left=3)


def _skins(skins: Sequence[SkinReport]) -> str:
    header = ["skin", "joints", "unused", "vertices", "influences (mean, max)", "weight sums ≠ 1"]
    rows: list[list[Cell]] = []
    for skin in skins:
        influences = f"{skin.mean_influences:.2f}, {skin.most_influences}" if skin.mean_influences is not None else ""
        off = str(skin.off_sums or "")
        rows.append([skin.name or f"#{skin.index}", skin.joints, skin.unused_joints, skin.vertices, influences, off])
    return tables.text(header, rows)


def _findings(findings: Sequence[Finding]) -> str:
    if not findings:
        return "  healthy: nothing found\n"
    lines = [f"  {MARKS[f.severity]}  {f.name}: {f.where}: {f.problem}; {f.advice}" for f in findings]
    return "\n".join(map(tables.escape_control, lines)) + "\n"

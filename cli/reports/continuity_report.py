"""Continuity of tracks at their keys for `inspect --continuity`: text table, CSV rows, JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from anim.gltf.reading.reader import clip_name
from anim.measure.continuity.continuity import ContinuityClass, LoopGap, MaxJump, TrackContinuity
from anim.measure.inspect.report import ClipReport
from anim.units import format_number, plural
from cli import tables
from cli.reports.inspect_report import Inspected, Smoothness
from cli.tables import Cell
from cli.text import format_instant, format_length


def table(clip: ClipReport, tracks: Sequence[TrackContinuity]) -> str:
    """Return the table of a clip's moving tracks, and a note on the others."""
    header = [
        tables.escape_control(f"continuity of {clip_name(clip.name, clip.index)}"),
        "path",
        "interp",
        "interior keys",
        "jump",
    ]
    header += ["C0", "G1", "C1", "C2", "value jump", "speed jump", "acceleration jump", "loop gap"]
    moving = [track for track in tracks if not track.still]
    rows: list[list[Cell]] = [
        [
            track.target,
            track.path,
            track.interpolation.lower(),
            track.interior_keys,
            *(str(count or "") for count in (track.jumps, track.c0, track.g1, track.c1, track.c2)),
            *(
                f"{_amount(largest.size, track.unit, per)} at {format_instant(largest.time_s)}" if largest else ""
                for largest, per in (
                    (track.largest_value_jump, ""),
                    (track.largest_speed_jump, "/s"),
                    (track.largest_acceleration_jump, "/s²"),
                )
            ),
            _seam(track),
        ]
        for track in moving
    ]
    still = len(tracks) - len(moving)
    note = f"  {plural(still, 'track')} never move{'s' if still == 1 else ''}\n" if still else ""
    return (tables.text(header, rows, left=3) if rows else "") + note


def rows(files: Sequence[Inspected], smooth: Sequence[Smoothness]) -> tuple[list[str], list[list[Cell]]]:
    """Return header and rows of one table: a row per track of every clip, with its keys by smoothness."""
    header = ["file", "clip", *cells(None)]
    lines: list[list[Cell]] = [
        [inspected.name, clip_name(clip.name, clip.index), *cells(track).values()]
        for inspected, of_clips in zip(files, smooth, strict=True)
        for clip, tracks in zip(inspected.facts.clips, of_clips, strict=True)
        for track in tracks
    ]
    return header, lines


def cells(track: TrackContinuity | None) -> dict[str, Cell]:
    """Return one row of the CSV table by column; for None, the columns."""
    plain = ("target", "path", "interpolation", "unit", "still", "interior_keys", "jumps", "c0", "g1", "c1", "c2")
    found: dict[str, Cell] = {name: getattr(track, name, None) for name in plain}
    for name in ("value", "speed", "acceleration"):
        largest: MaxJump | None = getattr(track, f"largest_{name}_jump", None)
        found[f"largest_{name}_jump"] = largest.size if largest else None
        found[f"largest_{name}_jump_at_s"] = largest.time_s if largest else None
    seam = track.seam if track else None
    found["seam"] = str(seam.grade) if seam else None
    for name in ("value_jump", "speed_jump", "acceleration_jump"):
        found[f"seam_{name}"] = getattr(seam, name, None)
    return found


def json(track: TrackContinuity) -> dict[str, Any]:
    """Return a track's continuity as JSON values, with every interior key."""
    about = {name: getattr(track, name) for name in track.__dataclass_fields__ if name != "keys"}
    about |= {name: asdict(value) for name, value in about.items() if isinstance(value, MaxJump | LoopGap)}
    keys = track.keys
    about["keys"] = {
        "times_s": keys.times.tolist(),
        "grades": [str(grade) for grade in keys.grades],
        "value_jumps": keys.value.tolist(),
        "speed_jumps": keys.speed.tolist(),
        "acceleration_jumps": keys.acceleration.tolist(),
    }
    return about


def _seam(track: TrackContinuity) -> str:
    """Continuity at the loop seam as text: "C2", "C0, 0.3 m/s", "jump, 2 cm"."""
    seam = track.seam
    if seam is None or seam.grade is ContinuityClass.C2:
        return "C2" if seam else ""
    if seam.grade is ContinuityClass.JUMP:
        return f"jump, {_amount(seam.value_jump, track.unit, '')}"
    if seam.grade is ContinuityClass.C1:
        return f"C1, {_amount(seam.acceleration_jump, track.unit, '/s²')}"
    return f"{seam.grade}, {_amount(seam.speed_jump, track.unit, '/s')}"


def _amount(size: float, unit: str, per: str) -> str:
    """A jump with its unit, two digits: "0.46 m/s", "12 °/s", "3.1 /s²"."""
    if unit == "m":
        return f"{format_number(size, 2)} m{per}" if per else format_length(size)
    if unit == "rad":
        degrees = format_number(math.degrees(size), 2)
        return f"{degrees} °{per}" if per else f"{degrees}°"
    return f"{format_number(size, 2)} {per}".rstrip()

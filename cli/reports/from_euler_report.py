"""Report of a conversion from Euler tracks: text, or a JSON document."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from math import degrees
from typing import Any

import numpy as np

from anim.exchange.euler.from_euler import ImportedMotion
from anim.exchange.euler.gimbal import NEAR_LOCK_RAD, GimbalStats
from anim.exchange.euler.leading_pose import find_leading_pose
from anim.exchange.euler.motion import EulerMotion
from anim.exchange.retarget.apply import CharacterClip
from anim.exchange.retarget.rest_alignment import Measure
from anim.model import Skeleton
from anim.units import list_some, plural
from cli import tables, text
from cli.reports import json_report

SCHEMA = 1
WORDS = {
    Measure.JOINTS: "the path is scaled by the distances of the matched joints at rest",
    Measure.EXTENT: "the path is scaled by the sizes of both figures at rest",
}
NEAR_DEG = round(degrees(NEAR_LOCK_RAD))


@dataclass(frozen=True, slots=True)
class ConversionReport:
    """A motion, its conversion, and its character.

    scale_words: origin of meters_per_unit; is_guess: whether that is uncertain. clip_index: of the clip in the
    character's file, None without one.
    """

    format: str
    motion: EulerMotion
    converted: ImportedMotion
    meters_per_unit: float
    scale_words: str
    gimbal: tuple[GimbalStats, ...]
    onto: CharacterClip | None = None
    character: Skeleton | None = None
    is_guess: bool = False
    clip_index: int | None = None


def warnings(made: ConversionReport) -> Iterator[str]:
    """Yield warnings on guesses and corrections, which change the meaning of times, lengths and poses."""
    yield from made.motion.notes
    if made.is_guess:
        yield f"scale: {made.scale_words}"
    yield from _leading_pose(made)
    if made.onto is not None and made.onto.num_bound:
        verb = "rests" if made.onto.num_bound == 1 else "rest"
        moved = f"{plural(made.onto.num_bound, 'joint')} of the character {verb} elsewhere than its skin was bound"
        yield f"{moved}: that pose is taken for the rest"
    if made.onto is not None:
        yield from _guesses(made.onto)
        yield from _lying(*made.onto.up_axes)


def lines(made: ConversionReport, *, verbose: bool) -> Iterator[str]:
    """Yield the lines of the text report; tables if verbose."""
    if made.scale_words and not made.is_guess:
        yield f"scale: {made.scale_words}"
    if made.format != "bvh":
        yield from _angles_line(made.motion)
    if made.gimbal:
        yield _gimbal_line(made.gimbal)
        if verbose:
            yield from _gimbal_table(made.gimbal)
    if made.onto is not None and made.character is not None:
        yield from _onto_lines(made, made.onto, made.character, verbose=verbose)


def counts(made: ConversionReport) -> str:
    """Return "31 joints, 22.9 s in up to 2752 keys a track"."""
    tracks = made.converted.clip.tracks
    most = max((len(track.times) for track in tracks), default=0)
    joints = len(made.converted.skeleton) - len(made.converted.ends)
    clip = made.converted.clip
    long = text.format_time(clip.end - clip.start)
    return f"{plural(joints, 'joint')}, {plural(most, 'key')} at most, {long} long"


def as_json(made: ConversionReport, *, warnings: Sequence[str]) -> str:
    """Return the report as a JSON document: schema, units in the keys. warnings: issued so far."""
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "format": made.format,
        "clip": made.converted.clip.name,
        "duration_s": made.converted.clip.end - made.converted.clip.start,
        "joints": len(made.converted.skeleton) - len(made.converted.ends),
        "keys": sum(len(track.times) for track in made.converted.clip.tracks),
        "meters_per_unit": made.meters_per_unit,
        "warnings": list(warnings),
        "gimbal": [asdict(row) for row in made.gimbal],
    }
    if made.onto is not None and made.character is not None:
        names, others = made.converted.skeleton.names, made.character.names
        content["onto"] = {
            "pairs": {names[a]: others[b] for a, b in made.onto.matching.pairs.items()},
            "unmatched": [names[a] for a in made.onto.matching.unmatched],
            "path_scale": made.onto.scale,
            "lowered_m": list(made.onto.lowered),
            "joints_at_bind_pose": made.onto.num_bound,
        }
    return json_report.dump(content)


def _leading_pose(made: ConversionReport) -> Iterator[str]:
    """Words on a first frame apart from the motion, of a recording; adaptive keys aren't frames."""
    converted = made.converted
    found = None if converted.tolerance is not None else find_leading_pose(converted.clip)
    if found is not None:
        joints = plural(found.num_joints, "joint")
        jump = f"{joints} jump to the next one, '{converted.skeleton.names[found.node]}' by {degrees(found.angle):.0f}°"
        chosen = "" if made.clip_index is None else f" --clip '#{made.clip_index}'"  # others may have its name
        advice = f"`trim --from {np.float32(found.end)!s} --rebase{chosen}` removes it from the clip"
        yield f"the first frame is a pose apart from the motion: {jump} ({advice})"


def listed(names: list[str]) -> str:
    """Return some names for a line: "'a', 'b' and 3 more"."""
    return list_some([f"'{name}'" for name in names])


def _angles_line(motion: EulerMotion) -> Iterator[str]:
    """Line with the range of angles, which reveals degrees read as radians and the reverse."""
    curves = [curve for node in motion.nodes for curve in node.rotation if curve is not None]
    if curves:
        low, high = min(curve.values.min() for curve in curves), max(curve.values.max() for curve in curves)
        yield f"angles: {degrees(low):.4g}° to {degrees(high):.4g}°"


def _gimbal_line(rows: tuple[GimbalStats, ...]) -> str:
    near = [row for row in rows if row.nearest_deg < NEAR_DEG]
    worst = min(rows, key=lambda row: row.nearest_deg)
    words = f"gimbal: {len(near)} of {plural(len(rows), 'joint')} within {NEAR_DEG}° of lock; nearest "
    words += f"'{worst.node}', {round(worst.nearest_deg, 2):.2g}° at {text.format_instant(worst.at_s)}"
    if worst.best_order != worst.order:
        words += f" ({worst.order}; {worst.best_order} would keep {worst.best_nearest_deg:.2g}°)"
    return words


def _gimbal_table(rows: tuple[GimbalStats, ...]) -> list[str]:
    header = (
        "joint",
        "order",
        "nearest",
        "at",
        f"time < {NEAR_DEG}°",
        "condition",
        "locked axes",
        "best order",
        "margin",
    )
    cells: list[tuple[tables.Cell, ...]] = [
        (
            row.node,
            row.order,
            f"{row.nearest_deg:.1f}°",
            f"{row.at_s:.2f} s",
            f"{row.near_s:.2f} s" if row.near_s else None,
            f"{row.worst_condition:.1f}",
            row.aligned,
            row.best_order,
            f"{row.best_nearest_deg:.1f}°",
        )
        for row in rows
    ]
    return tables.text(header, cells).splitlines()


def _onto_lines(made: ConversionReport, onto: CharacterClip, character: Skeleton, *, verbose: bool) -> Iterator[str]:
    names = made.converted.skeleton.names
    left = [names[node] for node in onto.matching.unmatched]
    total = len(left) + len(onto.matching.pairs)
    rest = f"; not: {listed(left)}" if left else ""
    yield f"onto: {len(onto.matching.pairs)} of {plural(total, 'joint')} matched{rest}"
    if made.motion.nested:
        low, high = (text.format_length(abs(each)) for each in onto.lowered)
        ways = ["down" if each >= 0 else "up" for each in onto.lowered]
        moved = f", hips {low} {ways[0]} to {high} {ways[1]} for the floor" if any(onto.lowered) else ""
        yield f"onto: path × {onto.scale:.3g}{moved}"
    if verbose:
        yield from (f"  {names[a]} → {character.names[b]}" for a, b in onto.matching.pairs.items())


def _lying(motion: str, character: str) -> Iterator[str]:
    """Note on a rest pose that is lying while the other one is standing; "" for an unknown up axis."""
    if not motion or not character or motion == character or "Y" not in (motion, character):
        return
    where = f"at rest the motion's figure stands along {motion}, the character along {character}"
    hint = "; is the motion Z-up? (--up z)" if motion == "Z" else ""
    if motion == "Y":
        hint = f"; is its file {character}-up? (export it with Y up, as glTF asks)"
    yield f"{where}: it will lie{hint}"


def _guesses(onto: CharacterClip) -> Iterator[str]:
    """Notes on missing data for root path and ground contact, if the proportions differ."""
    if onto.without and onto.measure not in (None, Measure.BUILD):
        made = [WORDS[onto.measure]] if onto.measure in WORDS else []
        made += ["soles are not put on the floor (as with --floor keep)"] if "feet" in onto.without else []
        made = made or ["the topmost matched joint carries the path"]
        yield f"not matched: {', '.join(onto.without)}; {', and '.join(made)}"

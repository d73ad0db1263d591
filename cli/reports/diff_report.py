"""Report of `diff`: a table, or a JSON document."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

from anim.gltf.reading.reader import clip_name, quote_clip
from anim.measure.compare.diff import END_TOLERANCE_S, ClipDiff, Diff
from anim.measure.error.statistics import Peak
from anim.measure.inspect.storage_cost import StorageCost
from anim.units import format_number, list_some, plural
from cli import tables
from cli.reports import json_report
from cli.reports.error_place import describe_place
from cli.text import format_change, format_length, format_speed

SCHEMA = 1
IN_BOTH = "has the same name in both files"
MAX_LISTED_NAMES = 5  # listed names that only one file has
HEADER = (
    *("clip", "joint", "vertex", "time s", "max error", "% of size", "p99", "mean"),
    *("angle", "speed", "weights", "pointers", "end s"),
)


class File(NamedTuple):
    """One of the two files: its name, its bytes, the stored bytes of its animations, and its clip names."""

    name: str
    size: int
    cost: StorageCost
    clips: tuple[str, ...]


class DiffReport(NamedTuple):
    """Comparison of two files, and its settings.

    nodes_by_name: number of nodes of the old file with a node of the same name in the new one. have_node_names:
    whether nodes of the old file have names, and of the new one. player: of both files, or two, "spec,nlerp".
    fps: frames per second of the grid. shell: m. measured_at: "surface" or, for an old file without vertices, "nodes".
    max_vertex_error: m, of vertices alone, where the largest error is around a node that moves none; else None.
    """

    old: File
    new: File
    diff: Diff
    nodes_by_name: int
    have_node_names: tuple[bool, bool]
    player: str
    fps: float
    shell: float
    measured_at: str
    max_vertex_error: float | None = None

    @property
    def clips_by_name(self) -> int:
        """Number of compared clips with the same name in both files."""
        return sum(bool(each.name) and each.name == each.new_name for each in self.diff.clips)

    @property
    def are_strangers(self) -> bool:
        """Return whether both files have names and none in common: probably two different things."""
        clips = self.old.clips, self.new.clips
        are_named = all(has_names or any(names) for has_names, names in zip(self.have_node_names, clips, strict=True))
        return are_named and self._are_clips_in_order and self._are_nodes_in_order

    @property
    def warning(self) -> str:
        """The warning that clips or nodes are compared in their order, though there are names; "" for none."""
        clips, nodes = self._are_clips_in_order, self._are_nodes_in_order
        if clips and nodes:
            doubt = "; are they two versions of one thing?" if self.are_strangers else ""
            return f"no clip and no node {IN_BOTH}: both are compared in their order{doubt}"
        if nodes:
            return f"no node {IN_BOTH}: nodes are compared in their order"
        has_choice = max(len(self.old.clips), len(self.new.clips)) > 1
        return f"no clip {IN_BOTH}: clips are compared in their order" if clips and has_choice else ""

    @property
    def _are_clips_in_order(self) -> bool:
        names = {*self.old.clips}, {*self.new.clips}
        return bool(self.diff.clips) and any(names[0] | names[1]) and not any(names[0] & names[1])

    @property
    def _are_nodes_in_order(self) -> bool:
        return bool(self.diff.clips) and any(self.have_node_names) and not self.nodes_by_name


def text(found: DiffReport) -> str:
    """Return a row per clip, the worst first, then the contents of only one file, and a summary line."""
    clips = found.diff.clips
    rows = [_row(each, found.diff.diagonal) for each in clips]
    table = tables.text([*HEADER, "tracks"], rows, left=2, indent="") + "\n" if rows else ""
    return table + "".join(f"{line}\n" for line in (*_alone(found), *_summary(found)))


def as_json(found: DiffReport, *, warnings: Sequence[str] = ()) -> str:
    """Return the report as a JSON document, units in the keys. warnings: on the files."""
    diff = found.diff
    content = {
        "schema": SCHEMA,
        "files": [_file(found.old), _file(found.new)],
        "player": found.player,
        "grid_fps": found.fps,
        "shell_m": found.shell,
        "diagonal_m": diff.diagonal,
        "measured_at": found.measured_at,
        "meshes_agree_by_vertex": diff.by_vertex,
        "clips_matched_by_name": found.clips_by_name,
        "nodes_matched_by_name": found.nodes_by_name,
        "max_error_m": diff.clips[0].error.max_error if diff.clips else 0.0,
        "max_error_percent": _percent(diff.clips[0].error.max_error, diff.diagonal) if diff.clips else 0.0,
        "clips": [partial(_clip, each, diff.diagonal) for each in diff.clips],
        "missing_clips": [clip_name(found.old.clips[i], i) for i in diff.missing_clips],
        "added_clips": [clip_name(found.new.clips[i], i) for i in diff.added_clips],
        "missing_nodes": list(diff.missing_nodes),
        "added_nodes": list(diff.added_nodes),
        "warnings": list(warnings),
    }
    return json_report.dump(content)


def worst(found: DiffReport) -> str:
    """Return the largest distance and its position: "4.3 mm (0.21 %) in 'Run' at 'tail3', 0.458 s"."""
    each = found.diff.clips[0]
    error = each.error
    if not error.max_error:
        return "0 mm"
    vertex = f", vertex {error.vertex}" if error.vertex >= 0 else ""
    percent = f" ({_share(_percent(error.max_error, found.diff.diagonal))} %)" if found.diff.diagonal else ""
    clip = quote_clip(each.name, each.old)
    return f"{format_length(error.max_error)}{percent} in {clip} {describe_place(error)}{vertex}, {error.time:.3f} s"


def without_length(found: DiffReport) -> str:
    """Return the first difference that is no distance, "" if none: "pointers 83 % of range at /… in 'Run'"."""
    for each in found.diff.clips:
        error, weight = each.error, each.statistics.weight
        clip = quote_clip(each.name, each.old)
        if error.max_pointer_error:
            return f"pointers {_share(100 * error.max_pointer_error)} % of range at {error.pointer} in {clip}"
        if weight.size:
            return f"morph weights {_share(weight.size)} at '{weight.joint}' in {clip}"
        if each.unmeasured:
            return f"{each.unmeasured[0]} is not measured in {clip}"
    return ""


def _row(each: ClipDiff, diagonal: float) -> list[tables.Cell]:
    error, found = each.error, each.statistics
    moved = bool(error.max_error)
    ends = f"{each.end_old:.4g} → {each.end_new:.4g}" if abs(each.end_old - each.end_new) > END_TOLERANCE_S else ""
    changed = [f"−{len(each.missing)}"] * bool(each.missing) + [f"+{len(each.added)}"] * bool(each.added)
    return [
        clip_name(each.name, each.old)
        + (f" → {clip_name(each.new_name, each.new)}" if each.new_name != each.name else ""),
        f"around {error.place}" if error.is_around_node else error.joint,
        str(error.vertex) if error.vertex >= 0 else "",
        f"{error.time:.3f}" if moved else "",
        format_length(error.max_error),
        _share(_percent(error.max_error, diagonal)) if moved and diagonal else "",
        format_length(found.p99) if moved else "",
        format_length(found.mean) if moved else "",
        f"{_share(math.degrees(found.angle.size))}°" if found.angle.size else "",
        format_speed(found.speed.size) if found.speed.size else "",
        _share(found.weight.size) if found.weight.size else "",
        f"{_share(100 * error.max_pointer_error)} %" if error.max_pointer_error else "",
        ends,
        " ".join(changed),
    ]


def _alone(found: DiffReport) -> list[str]:
    """Lines on clips, tracks and nodes of only one of the files."""
    diff, lines = found.diff, []
    for names, which in (
        ([quote_clip(found.old.clips[i], i) for i in diff.missing_clips], f"clip only in {found.old.name}"),
        ([quote_clip(found.new.clips[i], i) for i in diff.added_clips], f"clip only in {found.new.name}"),
        ([f"'{name}'" for name in diff.missing_nodes], f"node only in {found.old.name}"),
        ([f"'{name}'" for name in diff.added_nodes], f"node only in {found.new.name}"),
    ):
        if names:
            noun, rest = which.split(" ", 1)
            listed = list_some([tables.escape_control(name) for name in names], MAX_LISTED_NAMES)
            lines.append(f"{plural(len(names), noun)} {rest}: {listed}")
    if not diff.by_vertex:
        lines.append("meshes differ: the first file's vertices, carried by the second one's joints")
    return lines


def _summary(found: DiffReport) -> list[str]:
    old, new = found.old, found.new
    count = plural(len(found.diff.clips), "clip")
    motion = f"{count} compared, max {worst(found)}" if found.diff.clips else "no clips to compare"
    if found.max_vertex_error is not None:
        motion += f"; vertices: max {format_length(found.max_vertex_error)} (--shell 0)"
    if "," in found.player:
        return [motion, f"{old.name}, as shown by {found.player.replace(',', ' and ')}"]
    cost = f"animation {format_change(old.cost.total, new.cost.total)}"
    return [
        motion,
        f"{old.name} → {new.name}: {format_change(old.size, new.size)}, {cost}, including JSON {_json_part(found)}",
    ]


def _json_part(found: DiffReport) -> str:
    return format_change(found.old.cost.json, found.new.cost.json)


def _file(file: File) -> dict[str, Any]:
    cost = {"animation_data_bytes": file.cost.data, "animation_json_bytes": file.cost.json}
    return {"file": file.name, "bytes": file.size, **cost, "clips": len(file.clips)}


def _clip(each: ClipDiff, diagonal: float) -> dict[str, Any]:
    error, found = each.error, each.statistics
    return {
        "clip": clip_name(each.name, each.old),
        "other_clip": clip_name(each.new_name, each.new),
        "max_error_m": error.max_error,
        "max_error_percent": _percent(error.max_error, diagonal),
        "certified_error_m": each.certified,
        "time_s": error.time,
        "mesh": error.place,
        "joint": error.joint,
        "vertex": error.vertex if error.vertex >= 0 else None,
        "times": error.times,
        "p99_m": found.p99,
        "mean_m": found.mean,
        "max_angle_deg": math.degrees(found.angle.size),
        "angle_node": found.angle.joint,
        "angle_time_s": found.angle.time,
        "max_speed_error_m_per_s": found.speed.size,
        **_where(found.speed, "speed"),
        "max_weight_error": found.weight.size,
        "weight_node": found.weight.joint,
        "weight_target": found.weight.vertex if found.weight.vertex >= 0 else None,
        "weight_time_s": found.weight.time,
        "max_pointer_error": error.max_pointer_error,
        "pointer": error.pointer,
        "end_s": each.end_old,
        "other_end_s": each.end_new,
        "missing_tracks": _tracks(each.missing),
        "added_tracks": _tracks(each.added),
    }


def _where(peak: Peak, what: str) -> dict[str, Any]:
    vertex = peak.vertex if peak.vertex >= 0 else None
    return {f"{what}_joint": peak.joint, f"{what}_vertex": vertex, f"{what}_time_s": peak.time}


def _tracks(targets: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    return [{"target": target, "path": path} for target, path in targets]


def _percent(size: float, diagonal: float) -> float:
    return 100 * size / diagonal if diagonal else 0.0


def _share(value: float) -> str:
    """A number with two digits, three above 100, without exponent."""
    if 0 < value < 1e-4:
        return "<0.0001"
    return format_number(value, 3 if value >= 100 else 2)

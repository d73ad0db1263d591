"""CSV curves ↔ EulerMotion, in two forms distinguished by the header.

Frames: a row per time, a column per channel; an empty cell is no key of that channel.

    # order=ZXY frame=intrinsic unit=deg
    #node,hips,,0,0.93,0
    #node,spine,hips,0,0.12,0
    time,hips.tx,hips.ty,hips.tz,hips.rz,hips.rx,hips.ry,spine.rz
    0,0,0.93,0,0,0,0,5
    0.0333,0,0.93,0.04,1,0,0,

Keys: a row per key.

    node,channel,time,value,interpolation,in_tangent,out_tangent,in_weight,out_weight
    hips,rx,0,0,linear,,,,
    hips,rx,1,720,cubic,0,90,,0.5

Channels are tx ty tz (metres, or the file's unit by `# meters_per_unit=0.01`), rx ry rz, sx sy sz; with a repeated
axis in the order (ZXZ) angles are r1 r2 r3. Times are seconds; if the first is negative, all are shifted to begin at 0.
Tangents are per second, at both ends of every cubic segment; weights are the handle lengths as fractions of the time to
the next key, a third if empty. Lines that begin with # state the convention, or, if known, the hierarchy and the rest
pose: `#node,NAME,PARENT,tx,ty,tz[,angle,angle,angle[,sx,sy,sz]]`. Without interpolation curves are linear; in the
frames form `# interpolation=step` makes all of them steps.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, freeze
from anim.errors import FormatError
from anim.exchange.euler.baked_keys import move_times, shift_to_zero
from anim.exchange.euler.convention import PartialConvention, merge_strict, parse_convention, require_complete
from anim.exchange.euler.curve import MODES, Curve, Mode, uniform_modes
from anim.exchange.euler.motion import Convention, EulerMotion
from anim.exchange.formats.csv_keys import KeyRow, curve_from_rows
from anim.exchange.formats.csv_writer import EXTRA_COLUMNS, KEY_COLUMNS, write
from anim.exchange.formats.node_builder import KINDS, MAX_UNIT_M, NodeBuilder, build_nodes, check_nodes
from anim.exchange.formats.text import (
    DIGIT_SEPARATOR,
    MAX_NUMBER,
    check_times,
    decode_text,
    error_at,
    parse_cell,
    parse_number,
)
from anim.model import TimeAxis

__all__ = ["read", "write"]
LINE = re.compile(r"[^\n]*\n|[^\n]+")  # io.StringIO takes four bytes a character


@dataclass(slots=True)
class _File:
    """Content of a CSV before its values: comments with their lines, nodes, the header; and the rows.

    rows: line, and cells or, in the frames form, their numbers (C,) if all of them are.
    """

    words: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    nodes: list[tuple[int, list[str]]] = field(default_factory=list)
    header: list[str] = field(default_factory=list)
    header_line: int = 1
    rows: list[tuple[int, list[str] | Floats]] = field(default_factory=list)

    @property
    def has_frames(self) -> bool:
        """True for a row per time, false for a row per key."""
        return self.header[:1] == ["time"]

    @property
    def text_rows(self) -> list[tuple[int, list[str]]]:
        """Rows that are not numbers alone."""
        return [(line, cells) for line, cells in self.rows if isinstance(cells, list)]

    def hear(self, line: int, comment: str) -> None:
        """Parse the words "key=value" of a comment."""
        found = {key.casefold(): value for key, value in re.findall(r"(\w+)\s*=\s*(\S+)", comment)}
        self.words |= found
        self.lines |= dict.fromkeys(found, line)

    def meters_per_unit(self) -> float:
        """Return the unit of length in the comments, default 1. Raises FormatError with the line."""
        if "meters_per_unit" not in self.words:
            return 1.0
        line = self.lines["meters_per_unit"]
        unit = parse_cell(self.words["meters_per_unit"], line, "meters_per_unit")
        if not 0 < unit < MAX_UNIT_M:
            raise error_at(line, f"meters_per_unit is {unit:g} (expected a number above 0)")
        return unit


def read(data: bytes, options: PartialConvention) -> EulerMotion:
    """Return the motion in CSV curves, see above; lengths in metres, angles in radians.

    options: the convention of the command line. Raises FormatError with the line.
    """
    file = _parse(data)
    convention = require_complete(merge_strict(parse_convention(file.words, "the # lines"), options))
    drafts = _NodeBuilders(convention)
    for line, cells in file.nodes:
        drafts.describe(line, cells)
    later, notes = shift_to_zero(_times(file))
    if file.has_frames:
        _read_frames(file, drafts, later)
    elif set(KEY_COLUMNS) <= set(file.header):
        _read_keys(file, drafts, later)
    else:
        header = ",".join(file.header)
        hint = "; columns are separated by commas" if len(file.header) == 1 and re.search(r"[;\t]", header) else ""
        expected = f"expected time,NAME.rx,… or {','.join(KEY_COLUMNS)}{hint}"
        raise error_at(file.header_line, f"the header is {header[:60]!r} ({expected})")
    nodes, nested = build_nodes([*drafts.by_name.values()], file.meters_per_unit())
    return EulerMotion(nodes, nested=nested, notes=notes)


class _NodeBuilders:
    """Nodes by name, created on first use."""

    def __init__(self, convention: Convention) -> None:
        self.by_name: dict[str, NodeBuilder] = {}
        self._convention = convention

    def named(self, name: str) -> NodeBuilder:
        if name not in self.by_name:
            self.by_name[name] = NodeBuilder(name, self._convention)
        return self.by_name[name]

    def describe(self, line: int, cells: list[str]) -> None:
        if len(cells) not in (5, 8, 11) or not cells[0]:
            raise error_at(line, "expected #node,NAME,PARENT,tx,ty,tz[,angle,angle,angle[,sx,sy,sz]]")
        if cells[0] in self.by_name:
            raise error_at(line, f"a second #node line for '{cells[0]}'")
        draft = self.named(cells[0])
        draft.parent = cells[1] or None
        numbers = np.array([parse_cell(cell, line, "a rest") for cell in cells[2:]])
        draft.translation = numbers[:3]
        if len(numbers) > 3:
            draft.angles = numbers[3:6]
        if len(numbers) > 6:
            draft.scale = numbers[6:]

    def channel(self, name: str, channel: str, line: int) -> tuple[NodeBuilder, tuple[str, int]]:
        if not name or len(channel) != 2 or channel[0] not in KINDS:
            raise error_at(line, f"unknown channel '{channel}' of '{name}' (expected tx … tz, rx … rz, sx … sz)")
        draft = self.named(name)
        try:
            return draft, draft.place(KINDS[channel[0]], channel[1])
        except FormatError as error:
            raise error_at(line, error.problem) from None


def _parse(data: bytes) -> _File:
    file = _File()
    rows = csv.reader((found[0] for found in LINE.finditer(decode_text(data))), strict=True)
    try:
        for cells in rows:
            numbers = _numbers(cells) if file.has_frames and len(cells) == len(file.header) else None
            if numbers is not None:
                file.rows.append((rows.line_num, numbers))
                continue
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            if re.fullmatch(r"#\s*node", cells[0]):
                file.nodes.append((rows.line_num, cells[1:]))
            elif cells[0].startswith("#"):
                file.hear(rows.line_num, " ".join(cells))
            elif not file.header:
                file.header, file.header_line = cells, rows.line_num
                if len(set(cells)) != len(cells):
                    raise error_at(
                        rows.line_num,
                        f"column '{next(name for name, count in Counter(cells).items() if count > 1)}' twice",
                    )
            else:
                if len(cells) != len(file.header):
                    raise error_at(
                        rows.line_num, f"{len(cells)} columns (expected {len(file.header)}, as in the header)"
                    )
                file.rows.append((rows.line_num, cells))
    except csv.Error as error:
        raise error_at(rows.line_num, f"broken CSV ({error})") from None
    if not file.header or not file.rows:
        raise FormatError("has no rows of keys" if file.header else "is empty (expected a CSV of curves)")
    return file


def _numbers(cells: list[str]) -> Floats | None:
    """The numbers of a row; None if not all cells are numbers, as `text.parse_number` has it."""
    try:
        numbers = np.array([*map(float, cells)])
    except ValueError:
        return None
    is_valid = np.abs(numbers).max() <= MAX_NUMBER  # False for NaN
    return numbers if is_valid and DIGIT_SEPARATOR not in "".join(cells) else None


def _times(file: _File) -> Iterator[float]:
    """All numeric key times."""
    if "time" in file.header:
        column = file.header.index("time")
        for _, cells in file.rows:
            time = parse_number(cells[column]) if isinstance(cells, list) else float(cells[column])
            if time is not None:
                yield time


def _read_frames(file: _File, drafts: _NodeBuilders, later: float) -> None:
    mode = MODES.get(file.words.get("interpolation", "linear"), Mode.CUBIC)
    if mode is Mode.CUBIC:
        raise FormatError(f"interpolation is '{file.words['interpolation']}' (frames have no tangents: step or linear)")
    faults = _faults(file)
    if 0 in faults:
        parse_cell(*faults[0], "time")
    columns = np.array([_row_numbers(cells) for _, cells in file.rows]).T.copy()
    times = columns[0]
    check_times(times, [line for line, _ in file.rows])
    times = move_times(times, later)
    axes: dict[bytes, tuple[TimeAxis, NDArray[np.uint8]]] = {}  # and modes, by keys that are there
    is_there = ~np.isnan(columns)
    is_full = is_there.all(axis=1).tolist()
    for column, title in enumerate(file.header[1:], 1):
        name, _, channel = title.rpartition(".")
        draft, slot = drafts.channel(name, channel, file.header_line)
        if column in faults:
            parse_cell(*faults[column], title)
        there = is_there[column]
        content = b"" if is_full[column] else there.tobytes()
        if content not in axes:
            if not there.any():
                continue
            axes[content] = TimeAxis(times[there]), freeze(uniform_modes(int(there.sum()), mode))
        values = columns[column] if is_full[column] else columns[column][there]
        axis, modes = axes[content]
        draft.add(slot, Curve(axis, freeze(values * draft.unit(slot)), modes))


def _faults(file: _File) -> dict[int, tuple[str, int]]:
    """The first cell that should be a number and is none, and its line, by column; cells may be empty but for times."""
    found: dict[int, tuple[str, int]] = {}
    for line, cells in file.text_rows:
        for column, cell in enumerate(cells):
            if column not in found and (cell or column == 0) and parse_number(cell) is None:
                found[column] = cell, line
    return found


def _row_numbers(cells: list[str] | Floats) -> Floats:
    """The numbers (C,) of a row, NaN for others."""
    if not isinstance(cells, list):
        return cells
    found = map(parse_number, cells)
    return np.array([np.nan if number is None else number for number in found])


def _read_keys(file: _File, drafts: _NodeBuilders, later: float) -> None:
    unknown = set(file.header) - {*KEY_COLUMNS, *EXTRA_COLUMNS}
    if unknown:
        raise FormatError(f"unknown column '{min(unknown)}' (expected {', '.join((*KEY_COLUMNS, *EXTRA_COLUMNS))})")
    found: dict[tuple[str, tuple[str, int]], list[KeyRow]] = {}
    for line, cells in file.text_rows:
        row = dict(zip(file.header, cells, strict=True))
        draft, slot = drafts.channel(row["node"], row["channel"], line)
        found.setdefault((draft.name, slot), []).append((line, row))
    for (name, slot), rows in found.items():
        check_nodes(drafts.named(name), slot, partial(curve_from_rows, rows, later))

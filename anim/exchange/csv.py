"""CSV curves ↔ EulerMotion, in two forms that the header tells apart.

Frames: a row per time, a column per channel; an empty cell is no key of that channel.

    # order=ZXY frame=intrinsic unit=deg
    #node,hips,,0,0.93,0
    #node,spine,hips,0,0.12,0
    time,hips.tx,hips.ty,hips.tz,hips.rz,hips.rx,hips.ry,spine.rz
    0,0,0.93,0,0,0,0,5
    0.0333,0,0.93,0.04,1,0,0,

Keys: a row per key.

    node,channel,time,value,interpolation,in_tangent,out_tangent
    hips,rx,0,0,linear,,
    hips,rx,1,720,cubic,0,90

Channels are tx ty tz (metres, or the file's unit by `# meters_per_unit=0.01`), rx ry rz, sx sy sz; where an axis comes
twice in the order (ZXZ) angles are r1 r2 r3. Times are seconds, tangents per second. Lines that begin with # state the
convention, or `#node,NAME,PARENT,tx,ty,tz[,angle,angle,angle[,sx,sy,sz]]`: hierarchy and rest, if they are known.
Without interpolation curves are linear; in the frames form `# interpolation=step` makes all of them steps.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError
from anim.exchange.convention import Stated, agreed, complete, stated
from anim.exchange.csv_write import EXTRA_COLUMNS, KEY_COLUMNS, write
from anim.exchange.curve import Curve, Mode, uniform_modes
from anim.exchange.draft import KINDS, Draft, checked, finished
from anim.exchange.json import MODES
from anim.exchange.lines import number, wrong
from anim.exchange.motion import Convention, EulerMotion

__all__ = ["read", "write"]


@dataclass(slots=True)
class _File:
    """What a CSV says before its numbers: words of the comments, nodes, the header, and rows with their lines."""

    words: dict[str, str] = field(default_factory=dict)
    nodes: list[tuple[int, list[str]]] = field(default_factory=list)
    header: list[str] = field(default_factory=list)
    header_line: int = 1
    rows: list[tuple[int, list[str]]] = field(default_factory=list)


def read(data: bytes, options: Stated) -> EulerMotion:
    """Return the motion in CSV curves, see above; lengths in metres, angles in radians.

    options: what the command line says about the convention. Raises FormatError with the line.
    """
    file = _parsed(data)
    convention = complete(agreed(stated(file.words, "the # lines"), options))
    drafts = _Drafts(convention)
    for line, cells in file.nodes:
        drafts.describe(line, cells)
    if tuple(file.header[:1]) == ("time",):
        _read_frames(file, drafts)
    elif set(KEY_COLUMNS) <= set(file.header):
        _read_keys(file, drafts)
    else:
        raise FormatError(
            f"the header is '{','.join(file.header)[:60]}' (expected time,NAME.rx,… or {','.join(KEY_COLUMNS)})"
        )
    unit = _number(file.words.get("meters_per_unit", "1"), 1, "meters_per_unit")
    nodes, nested = finished([*drafts.by_name.values()], unit)
    return EulerMotion(nodes, nested=nested)


class _Drafts:
    """Nodes by name, made where they first appear."""

    def __init__(self, convention: Convention) -> None:
        self.by_name: dict[str, Draft] = {}
        self._convention = convention

    def named(self, name: str) -> Draft:
        if name not in self.by_name:
            self.by_name[name] = Draft(name, self._convention)
        return self.by_name[name]

    def describe(self, line: int, cells: list[str]) -> None:
        if len(cells) not in (5, 8, 11) or not cells[0]:
            raise wrong(line, "expected #node,NAME,PARENT,tx,ty,tz[,angle,angle,angle[,sx,sy,sz]]")
        if cells[0] in self.by_name:
            raise wrong(line, f"a second #node line for '{cells[0]}'")
        draft = self.named(cells[0])
        draft.parent = cells[1] or None
        numbers = np.array([_number(cell, line, "a rest") for cell in cells[2:]])
        draft.translation = numbers[:3]
        if len(numbers) > 3:
            draft.angles = numbers[3:6]
        if len(numbers) > 6:
            draft.scale = numbers[6:]

    def channel(self, name: str, channel: str, line: int) -> tuple[Draft, tuple[str, int]]:
        if not name or len(channel) != 2 or channel[0] not in KINDS:
            raise wrong(line, f"unknown channel '{channel}' of '{name}' (expected tx … tz, rx … rz, sx … sz)")
        draft = self.named(name)
        try:
            return draft, draft.place(KINDS[channel[0]], channel[1])
        except FormatError as error:
            raise wrong(line, error.problem) from None


def _parsed(data: bytes) -> _File:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    file = _File()
    rows = csv.reader(io.StringIO(text.replace("\r\n", "\n").replace("\r", "\n")), strict=True)
    try:
        for cells in rows:
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            if cells[0] == "#node":
                file.nodes.append((rows.line_num, cells[1:]))
            elif cells[0].startswith("#"):
                words = " ".join(cells).lstrip("#").split()
                file.words |= {key: value for key, _, value in (word.partition("=") for word in words) if value}
            elif not file.header:
                file.header, file.header_line = cells, rows.line_num
                if len(set(cells)) != len(cells):
                    raise wrong(rows.line_num, f"column '{next(c for c in cells if cells.count(c) > 1)}' twice")
            else:
                if len(cells) != len(file.header):
                    raise wrong(rows.line_num, f"{len(cells)} columns (expected {len(file.header)}, as in the header)")
                file.rows.append((rows.line_num, cells))
    except csv.Error as error:
        raise wrong(rows.line_num, f"broken CSV ({error})") from None
    if not file.header or not file.rows:
        raise FormatError("has no rows of keys" if file.header else "is empty (expected a CSV of curves)")
    return file


def _read_frames(file: _File, drafts: _Drafts) -> None:
    mode = MODES.get(file.words.get("interpolation", "linear"), Mode.CUBIC)
    if mode is Mode.CUBIC:
        raise FormatError(f"interpolation is '{file.words['interpolation']}' (frames have no tangents: step or linear)")
    times = np.array([_number(cells[0], line, "time") for line, cells in file.rows])
    _check_times(times, [line for line, _ in file.rows])
    for column, title in enumerate(file.header[1:], 1):
        name, _, channel = title.rpartition(".")
        draft, slot = drafts.channel(name, channel, file.header_line)
        there = [i for i, (_, cells) in enumerate(file.rows) if cells[column]]
        if not there:
            continue
        values = np.array([_number(file.rows[i][1][column], file.rows[i][0], title) for i in there])
        own = times if len(there) == len(times) else times[there]
        draft.add(slot, Curve(own, values, uniform_modes(len(own), mode)))


def _read_keys(file: _File, drafts: _Drafts) -> None:
    unknown = set(file.header) - {*KEY_COLUMNS, *EXTRA_COLUMNS}
    if unknown:
        raise FormatError(f"unknown column '{min(unknown)}' (expected {', '.join((*KEY_COLUMNS, *EXTRA_COLUMNS))})")
    found: dict[tuple[str, tuple[str, int]], list[tuple[int, dict[str, str]]]] = {}
    for line, cells in file.rows:
        row = dict(zip(file.header, cells, strict=True))
        draft, slot = drafts.channel(row["node"], row["channel"], line)
        found.setdefault((draft.name, slot), []).append((line, row))
    for (name, slot), rows in found.items():
        checked(drafts.named(name), slot, lambda rows=rows: _keyed(rows))


def _keyed(rows: list[tuple[int, dict[str, str]]]) -> Curve:
    lines = [line for line, _ in rows]
    times = np.array([_number(row["time"], line, "time") for line, row in rows])
    _check_times(times, lines)
    values = np.array([_number(row["value"], line, "value") for line, row in rows])
    modes = np.zeros(len(rows), np.uint8)
    for i, (line, row) in enumerate(rows):
        word = row.get("interpolation") or "linear"
        if word not in MODES:
            raise wrong(line, f"interpolation is '{word}' (expected {', '.join(MODES)})")
        modes[i] = MODES[word]
    if not (modes == Mode.CUBIC).any():
        return Curve(times, values, modes)
    tangents: list[Floats] = []
    for key in ("in_tangent", "out_tangent"):
        tangents.append(np.array([_number(row.get(key) or "0", line, key) for line, row in rows]))
    return Curve(times, values, modes, *tangents)


def _check_times(times: Floats, lines: list[int]) -> None:
    if times[0] < 0:
        raise wrong(lines[0], f"time is {times[0]:g} (expected 0 s or later)")
    steps = np.diff(times)
    if (steps <= 0).any():
        k = int(np.argmax(steps <= 0)) + 1
        raise wrong(lines[k], f"time {times[k]:g} s after {times[k - 1]:g} s (expected increasing times)")


def _number(text: str, line: int, what: str) -> float:
    value = number(text)
    if value is None:
        raise wrong(line, f"{what} is '{text[:40]}' (expected a finite number)")
    return value

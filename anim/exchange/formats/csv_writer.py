"""EulerMotion → CSV: frames if every curve is linear, else keys. Both forms: see `csv_reader`."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.errors import UnsupportedError
from anim.exchange.euler.convention import axis_names
from anim.exchange.euler.curve import HANDLES, Curve, Mode
from anim.exchange.euler.motion import NO_PIVOTS, Convention, EulerMotion, EulerNode
from anim.model.time_axis import merge_times

KEY_COLUMNS = ("node", "channel", "time", "value")
EXTRA_COLUMNS = ("interpolation", "in_tangent", "out_tangent", "in_weight", "out_weight")
DECIMALS = 9  # decimals
MAX_BLOCK_ROWS = 1 << 14
MIN_ROUNDED_VALUES = 64  # fewer are rounded one by one
MAX_SCALED = 1e11  # of values times 10^9: the product is exact to 1e-5
MIN_FROM_HALF = 1e-3  # of such a product: nearer to the middle between two integers, decimal digits decide


class _Column(NamedTuple):
    """A curve of a node: its channel, and the factor from its unit to the one that is written."""

    node: str
    channel: str
    curve: Curve
    factor: float = 1.0


def write(motion: EulerMotion, convention: Convention) -> bytes:
    """Return the motion as CSV; the convention is that of its nodes, with the output unit.

    Raises UnsupportedError for a node with another order, or with pivots.
    """
    if any(node.order != convention.order for node in motion.nodes):
        raise UnsupportedError("a CSV has one order for all nodes", help="write .json or .bvh")
    if any(node.pivots is not NO_PIVOTS for node in motion.nodes):
        raise UnsupportedError("a CSV has no pivots", help="write .json")
    data = io.BytesIO()  # a string would take four bytes per character
    out = io.TextIOWrapper(data, "utf-8", errors="backslashreplace", newline="")  # a lone surrogate, valid in JSON
    out.write(f"# order={convention.order} frame={convention.frame} unit={convention.unit}\n")
    rows = csv.writer(out, lineterminator="\n")
    radians = convention.unit.radians
    rest = np.array([(node.translation, node.angles / radians, node.scale) for node in motion.nodes])
    for node, values in zip(motion.nodes, rest.reshape(-1, 9), strict=True):
        parent = motion.nodes[node.parent].name if node.parent >= 0 else ""
        rows.writerow(["#node", node.name, parent, *map(_text, values.tolist())])
    columns = [column for node in motion.nodes for column in _columns(node, 1 / radians)]
    straight = not columns or bool((np.concatenate([column.curve.modes for column in columns]) == Mode.LINEAR).all())
    (_write_frames if straight else _write_keys)(rows, columns)
    out.flush()
    return data.getvalue()


def _columns(node: EulerNode, per_radian: float) -> Iterator[_Column]:
    for axis, curve in sorted(node.moves.items()):
        yield _Column(node.name, f"t{'xyz'[axis]}", curve)
    for axis_name, turn in zip(axis_names(node.order), node.rotation, strict=True):
        if turn is not None:
            yield _Column(node.name, f"r{axis_name}", turn, per_radian)
    for axis, curve in sorted(node.scales.items()):
        yield _Column(node.name, f"s{'xyz'[axis]}", curve)


def _write_frames(rows: Any, columns: list[_Column]) -> None:
    rows.writerow(["time", *(f"{column.node}.{column.channel}" for column in columns)])
    axes = dict.fromkeys(column.curve.time_axis for column in columns)
    times = merge_times(axes)
    for first in range(0, len(times), MAX_BLOCK_ROWS):  # texts of all rows take ten times the memory of their values
        some = times[first : first + MAX_BLOCK_ROWS]
        cells = [[text] + [""] * len(columns) for text in _texts(some)]
        ends = {axis: np.searchsorted(axis.times, (some[0], np.nextafter(some[-1], np.inf))) for axis in axes}
        places = {axis: np.searchsorted(some, axis.times[slice(*ends[axis])]).tolist() for axis in axes}
        for number, (_, _, curve, factor) in enumerate(columns, 1):
            axis = curve.time_axis
            for place, text in zip(places[axis], _texts(curve.values[slice(*ends[axis])] * factor), strict=True):
                cells[place][number] = text
        rows.writerows(cells)


def _write_keys(rows: Any, columns: list[_Column]) -> None:
    words = [mode.name.lower() for mode in Mode]
    would_be_comments = any(column.node.startswith("#") for column in columns)
    first, second = (1, 0) if would_be_comments else (0, 1)
    rows.writerow([KEY_COLUMNS[first], KEY_COLUMNS[second], *KEY_COLUMNS[2:], *EXTRA_COLUMNS])
    for *named, given, factor in columns:
        curve = given.scaled(factor)
        handles = [getattr(curve, name) for name in HANDLES]
        extra = [[""] * len(curve.times) if h is None else [*map(_text, h.tolist())] for h in handles]
        keys = zip(curve.times.tolist(), curve.values.tolist(), curve.modes.tolist(), *extra, strict=True)
        for time, value, mode, *cells in keys:
            rows.writerow([named[first], named[second], _text(time), _text(value), words[mode], *cells])


def _texts(values: Floats) -> list[str]:
    """The same as `_text` of each value (K,), which takes longer for many."""
    if len(values) < MIN_ROUNDED_VALUES:
        return [*map(_text, values.tolist())]
    firsts = np.flatnonzero(np.append(True, values[1:] != values[:-1]))
    different = values[firsts]
    scaled = np.clip(different, -MAX_SCALED, MAX_SCALED) * 10**DECIMALS
    rounded = np.rint(scaled) / 10**DECIMALS  # the nearest number to a decimal one, unless that is the wrong neighbor
    is_clear = (np.abs(scaled) < MAX_SCALED) & (np.abs(scaled - np.floor(scaled) - 0.5) > MIN_FROM_HALF)
    unclear = np.flatnonzero(~is_clear)
    rounded[unclear] = [round(value, DECIMALS) for value in different[unclear].tolist()]
    texts = [f"{value:.12g}" for value in (rounded + 0.0).tolist()]
    if len(texts) == len(values):
        return texts
    counts = np.diff(np.append(firsts, len(values))).tolist()
    return [text for text, count in zip(texts, counts, strict=True) for _ in range(count)]


def _text(value: float) -> str:
    return f"{round(value, DECIMALS) + 0.0:.12g}"

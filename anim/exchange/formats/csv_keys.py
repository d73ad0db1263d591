"""Rows of a CSV with a row per key → a curve: times, values, interpolation, tangents and their weights."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.baked_keys import move_times
from anim.exchange.euler.curve import DEFAULT_WEIGHT, MODES, Curve, Mode
from anim.exchange.formats.text import check_times, error_at, parse_cell
from anim.model import TimeAxis

KeyRow = tuple[int, dict[str, str]]  # line, cells by column


def curve_from_rows(rows: list[KeyRow], later: float, unit: float) -> Curve:
    """Return the curve of one channel's rows, shifted by `later` seconds, its values multiplied by `unit`."""
    lines = [line for line, _ in rows]
    times = np.array([parse_cell(row["time"], line, "time") for line, row in rows])
    check_times(times, lines)
    axis = TimeAxis(move_times(times, later))
    values = np.array([parse_cell(row["value"], line, "value") for line, row in rows]) * unit
    modes = np.zeros(len(rows), np.uint8)
    for i, (line, row) in enumerate(rows):
        word = row.get("interpolation") or "linear"
        if word not in MODES:
            raise error_at(line, f"interpolation is '{word}' (expected {', '.join(MODES)})")
        modes[i] = MODES[word]
    if not (modes == Mode.CUBIC).any():
        return Curve(axis, values, modes)
    _check_tangents(rows, modes.tolist())
    arriving, leaving = (_handles(rows, key, 0.0) * unit for key in ("in_tangent", "out_tangent"))
    return Curve(axis, values, modes, arriving, leaving, _weights(rows, "in_weight"), _weights(rows, "out_weight"))


def _check_tangents(rows: list[KeyRow], modes: list[int]) -> None:
    """Check the tangents at both ends of each cubic segment."""
    for mode, *ends in zip(modes, rows, rows[1:], strict=False):
        for (line, row), key in zip(ends, ("out_tangent", "in_tangent"), strict=True):
            if mode == Mode.CUBIC and not row.get(key):
                raise error_at(line, f"a cubic piece lacks its {key} (expected the change of the value per second)")


def _handles(rows: list[KeyRow], key: str, otherwise: float) -> Floats:
    return np.array([parse_cell(row[key], line, key) if row.get(key) else otherwise for line, row in rows])


def _weights(rows: list[KeyRow], key: str) -> Floats | None:
    if not any(row.get(key) for _, row in rows):
        return None
    weights = _handles(rows, key, DEFAULT_WEIGHT)
    for (line, _), weight in zip(rows, weights.tolist(), strict=True):
        if not 0 <= weight <= 1:
            raise error_at(line, f"{key} is {weight:g} (expected a share of the time between two keys, 0 … 1)")
    return weights

"""Euler convention (one of 24) and angle unit: stated by the file or the options, never guessed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from anim.errors import DataRangeError, FormatError, RangeError
from anim.exchange.euler.motion import Convention, Unit
from anim.maths.euler import ORDERS, AxesConvention, check_order


@dataclass(frozen=True, slots=True)
class PartialConvention:
    """Stated parts of a convention, None for the others."""

    order: str | None = None
    frame: AxesConvention | None = None
    unit: Unit | None = None


UNSPECIFIED = PartialConvention()
NAMES = {"order": "rotation order", "frame": "axes convention", "unit": "angle unit"}


def parse_convention(values: dict[str, Any], where: str) -> PartialConvention:
    """Return the convention of a file's "order", "frame" and "unit", in any case.

    Raises FormatError for unknown words.
    """
    order = values.get("order")
    frame, unit = (word.casefold() if isinstance(word, str) else word for word in map(values.get, ("frame", "unit")))
    if order is not None and str(order).upper() not in ORDERS:
        raise FormatError(f"order is '{order}' (expected one of {', '.join(ORDERS)})", where=where)
    if frame is not None and frame not in list(AxesConvention):
        raise FormatError(f"frame is '{frame}' (expected {' or '.join(AxesConvention)})", where=where)
    if unit is not None and unit not in list(Unit):
        raise FormatError(f"unit is '{unit}' (expected {' or '.join(Unit)})", where=where)
    return PartialConvention(
        None if order is None else str(order).upper(),
        None if frame is None else AxesConvention(frame),
        None if unit is None else Unit(unit),
    )


def merge_strict(file: PartialConvention, options: PartialConvention) -> PartialConvention:
    """Return the parts of file and options together. Raises DataRangeError for contradicting parts."""
    if options.order is not None:
        options = PartialConvention(check_order(options.order), options.frame, options.unit)
    for name in ("order", "frame", "unit"):
        here, there = getattr(file, name), getattr(options, name)
        if here is not None and there is not None and here != there:
            raise DataRangeError(f"{NAMES[name]} is {here} in the file (got {there})")
    return fill_from(file, options)


def require_complete(said: PartialConvention) -> Convention:
    """Return the complete convention. Raises RangeError for a missing part."""
    if said.order is not None and said.frame is not None and said.unit is not None:
        return Convention(said.order, said.frame, said.unit)
    missing = next(name for name in ("order", "frame", "unit") if getattr(said, name) is None)
    raise RangeError(
        f"{NAMES[missing]} not specified",
        help="`order`, `axes` and `unit` are required; XYZ in FBX and Maya is order XYZ with extrinsic axes",
    )


def fill_from(first: PartialConvention, otherwise: PartialConvention) -> PartialConvention:
    """Return `first`, with missing parts from `otherwise`."""
    return PartialConvention(
        first.order if first.order is not None else otherwise.order,
        first.frame if first.frame is not None else otherwise.frame,
        first.unit if first.unit is not None else otherwise.unit,
    )


def axis_index(axis: str, order: str) -> int | None:
    """Return the index of an axis in an order: "x" … "z" by axis, "1" … "3" by index; None if ambiguous.

    axis_index("y", "ZXY") → 2
    axis_index("z", "ZXZ") → None
    """
    if axis in "123":
        return int(axis) - 1
    letter = axis.upper()
    return order.index(letter) if order.count(letter) == 1 else None


def axis_names(order: str) -> tuple[str, str, str]:
    """Return the names of an order's three angles: the axes, or indices if an axis is repeated."""
    names = tuple(order.lower()) if len(set(order)) == 3 else ("1", "2", "3")
    return names[0], names[1], names[2]

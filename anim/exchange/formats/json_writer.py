"""EulerMotion → JSON curves. Schema: see `json_reader`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError
from anim.exchange.euler.convention import axis_names
from anim.exchange.euler.curve import HANDLES, Curve, Mode
from anim.exchange.euler.motion import NO_PIVOTS, OFFSETS, Convention, EulerMotion, EulerNode
from anim.model import TimeAxis

SCHEMA = "euler-curves/1"
PIVOT_ROTATIONS = ("pre_rotation", "post_rotation")
DECIMALS = 10  # far below float32, without the noise of binary fractions

Item = tuple[str, str]  # a key, and the text of its value


def write(motion: EulerMotion, convention: Convention) -> bytes:
    """Return the motion as a JSON of curves, in the unit and the default order of the convention.

    Lists of numbers are on one line. Raises FormatError for a number that JSON cannot represent.
    """
    try:
        return _Text(motion, convention, ensure_ascii=False).whole().encode()
    except UnicodeEncodeError:  # a lone surrogate, which can be written only as an escape
        return _Text(motion, convention, ensure_ascii=True).whole().encode()


class _Text:
    """The text of a motion: Python's own encoder takes five times as long for lines with indent."""

    def __init__(self, motion: EulerMotion, convention: Convention, *, ensure_ascii: bool) -> None:
        self._motion, self._convention = motion, convention
        self._quote: Callable[[str], str] = json.JSONEncoder(ensure_ascii=ensure_ascii).encode
        self._times: dict[TimeAxis, str] = {}

    def whole(self) -> str:
        convention = self._convention
        texts = (SCHEMA, convention.order, str(convention.frame), str(convention.unit))
        items = zip(("schema", "order", "frame", "unit"), map(self._quote, texts), strict=True)
        nodes = ",".join(f"\n  {node}" for node in self._nodes())
        return _object((*items, ("nodes", f"[{nodes}\n ]" if nodes else "[]")), 0) + "\n"

    def _nodes(self) -> Iterator[str]:
        nodes = self._motion.nodes
        angles = [node.angles / self._convention.unit.radians for node in nodes]
        rest = ([node.translation for node in nodes], angles, [node.scale for node in nodes])
        for node, *vectors in zip(nodes, *(_rounded(np.array(each)) for each in rest), strict=True):
            yield _object(self._node(node, map(_numbers, vectors)), 2)

    def _node(self, node: EulerNode, rest: Iterable[str]) -> Iterator[Item]:
        yield "name", self._quote(node.name)
        if node.order != self._convention.order:
            yield "order", self._quote(node.order)
        if node.parent >= 0:
            yield "parent", self._quote(self._motion.nodes[node.parent].name)
        yield from zip(("translation", "rotation", "scale"), rest, strict=True)
        if node.pivots is not NO_PIVOTS:
            for name in (*PIVOT_ROTATIONS, *OFFSETS):
                yield name, _numbers(_rounded(getattr(node.pivots, name)))
        if curves := [(name, _object(self._curve(curve), 4)) for name, curve in self._curves(node)]:
            yield "curves", _object(curves, 3)

    def _curves(self, node: EulerNode) -> Iterator[tuple[str, Curve]]:
        for axis, curve in sorted(node.moves.items()):
            yield f"translation.{'xyz'[axis]}", curve
        for axis_name, turn in zip(axis_names(node.order), node.rotation, strict=True):
            if turn is not None:
                yield f"rotation.{axis_name}", turn.scaled(1 / self._convention.unit.radians)
        for axis, curve in sorted(node.scales.items()):
            yield f"scale.{'xyz'[axis]}", curve

    def _curve(self, curve: Curve) -> Iterator[Item]:
        axis = curve.time_axis
        if axis not in self._times:
            self._times[axis] = _numbers(_rounded(axis.times))
        yield "times", self._times[axis]
        yield "values", _numbers(_rounded(curve.values))
        if (curve.modes != Mode.LINEAR).any():
            words = [self._quote(Mode(mode).name.lower()) for mode in curve.modes.tolist()]
            yield "interpolation", words[0] if len(set(words)) == 1 else f"[{', '.join(words)}]"
        for name in HANDLES:
            handle = getattr(curve, name)
            if handle is not None:
                yield name, _numbers(_rounded(handle))


def _object(items: Iterable[Item], depth: int) -> str:
    """An object at a depth, with a line for each item and a space of indent per level."""
    line = "\n" + " " * depth
    return "{" + ",".join([f'{line} "{key}": {value}' for key, value in items]) + line + "}"


def _rounded(values: Floats) -> list[float]:
    rounded: list[float] = (np.round(values, DECIMALS) + 0.0).tolist()
    return rounded


def _numbers(values: Iterable[float]) -> str:
    text = f"[{', '.join(map(repr, values))}]"
    if "n" in text:  # inf or nan
        raise FormatError("a number can't be written as JSON (out of range float values are not JSON compliant)")
    return text

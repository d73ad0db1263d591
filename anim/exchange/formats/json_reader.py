"""JSON curves ↔ EulerMotion: every axis of every node with its own keys, as in FBX and Maya.

    {
      "schema": "euler-curves/1",
      "order": "XYZ", "frame": "extrinsic", "unit": "deg",     convention of angles; a node may override it
      "meters_per_unit": 0.01,                                 of translations, offsets and pivots; default 1
      "nodes": [
        {
          "name": "arm",
          "parent": "body",                                    none for a root
          "translation": [0, 12, 0],                           at rest; so "rotation" (angles, in the order's
          "rotation": [0, 0, 90], "scale": [1, 1, 1],          sequence) and "scale"
          "pre_rotation": [0, 0, 45],                          three angles, extrinsic XYZ as in FBX, or [x, y, z, w]
          "post_rotation": [0, 0, 0],
          "rotation_offset": [0, 0, 0], "rotation_pivot": [0, 0, 0],
          "scaling_offset": [0, 0, 0], "scaling_pivot": [0, 0, 0],
          "curves": {
            "rotation.x": {"times": [0, 1], "values": [0, 720]},
            "rotation.y": {"times": [0, 0.5, 2], "values": [0, 30, 0], "interpolation": "cubic",
                           "in_tangents": [0, 0, 0], "out_tangents": [60, 0, 0]},
            "translation.z": {"times": [0, 1], "values": [0, 5], "interpolation": ["step", "linear"]}
          }
        }
      ]
    }

Times are seconds; if the first is negative, all are shifted to begin at 0. Interpolation is step, linear (default) or
cubic, for the curve or after each key; tangents are per second in the value's own unit. in_weights and out_weights are
handle lengths as fractions of the time to the next key (Maya's and FBX's weighted tangents, Blender's handles), default
a third. With a repeated axis in the order (ZXZ), angles are rotation.1, .2, .3. Other keys are errors.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, freeze
from anim.errors import FormatError
from anim.exchange.euler.baked_keys import move_times, shift_to_zero
from anim.exchange.euler.convention import (
    UNSPECIFIED,
    PartialConvention,
    fill_from,
    merge_strict,
    parse_convention,
    require_complete,
)
from anim.exchange.euler.curve import HANDLES, MODES, WEIGHTS, Curve, Mode, uniform_modes
from anim.exchange.euler.motion import OFFSETS, Convention, EulerMotion, Pivots
from anim.exchange.formats.json_writer import PIVOT_ROTATIONS, SCHEMA, write
from anim.exchange.formats.node_builder import MAX_UNIT_M, NodeBuilder, build_nodes, check_nodes
from anim.exchange.formats.text import MAX_NUMBER
from anim.gltf.io import json_text
from anim.maths import euler, quaternion
from anim.maths.euler import AxesConvention
from anim.model import TimeAxis

__all__ = ["read", "write"]

CONVENTION_KEYS = ("order", "frame", "unit")
FILE_KEYS = ("schema", *CONVENTION_KEYS, "meters_per_unit", "nodes")
NODE_KEYS = (
    "name",
    "parent",
    *CONVENTION_KEYS,
    "translation",
    "rotation",
    "scale",
    *PIVOT_ROTATIONS,
    *OFFSETS,
    "curves",
)
CURVE_KEYS = ("times", "values", "interpolation", *HANDLES)
KNOWN_KEYS: dict[tuple[str, ...], frozenset[str]] = {
    keys: frozenset(keys) for keys in (FILE_KEYS, NODE_KEYS, CURVE_KEYS)
}
MAX_COMPARED_KEYS = 64  # of curves that are compared as text; longer ones are read as fast
PIVOT_KEYS = frozenset((*OFFSETS, *PIVOT_ROTATIONS))
NOTHING, ORIGIN, UNSCALED = freeze(np.zeros(0)), freeze(np.zeros(3)), freeze(np.ones(3))


def read(data: bytes, options: PartialConvention) -> EulerMotion:
    """Return the motion in a JSON of curves, see above; lengths in metres, angles in radians.

    options: the convention of the command line. Raises FormatError with the position.
    """
    content = json_text.parse(json_text.skip_mark(data))
    if "asset" in content and "schema" not in content:
        raise FormatError(f"is a glTF already (expected a JSON of curves, schema '{SCHEMA}')")
    if content.get("schema") != SCHEMA:
        raise FormatError(f"schema is {content.get('schema')!r} (expected '{SCHEMA}')")
    _check_keys(content, FILE_KEYS, "")
    said = merge_strict(parse_convention(content, ""), options)
    nodes = content.get("nodes")
    if not isinstance(nodes, list) or not nodes:
        raise FormatError("has no nodes")
    later, notes = shift_to_zero(_times(nodes))
    drafts, names = [], set[str]()
    times = _TimeAxes(later)
    for i, node in enumerate(nodes):
        where = f"nodes[{i}]"
        draft = _node_builder(node, said, times, where)
        if draft.name in names:
            raise FormatError(f"a second node '{draft.name}'", where=where)
        names.add(draft.name)
        drafts.append(draft)
    unit = content.get("meters_per_unit", 1.0)
    if type(unit) not in (int, float) or not 0 < unit < MAX_UNIT_M:
        raise FormatError(f"meters_per_unit is {unit!r} (expected a number above 0)")
    finished_nodes, nested = build_nodes(drafts, float(unit))
    return EulerMotion(finished_nodes, nested=nested, notes=notes)


def _times(nodes: list[Any]) -> Iterator[float]:
    """All numeric key times; other values are reported later."""
    for node in nodes:
        curves = node.get("curves") if isinstance(node, dict) else None
        for about in curves.values() if isinstance(curves, dict) else ():
            times = about.get("times") if isinstance(about, dict) else None
            if isinstance(times, list):
                yield from (time for time in times if type(time) in (int, float) and abs(time) <= MAX_NUMBER)


class _TimeAxes:
    """Time axes of curves, moved by `later` seconds; curves with the same times share one.

    curves: short ones by their text and unit.
    """

    def __init__(self, later: float) -> None:
        self._later = later
        self._found: dict[bytes, TimeAxis] = {}
        self.curves: dict[tuple[str, float], Curve] = {}

    def check(self, times: Floats) -> None:
        """Raise FormatError for the first time (K,) that is not after the previous one."""
        if times.tobytes() not in self._found:
            for k in np.flatnonzero(np.diff(times) <= 0)[:1] + 1:
                raise FormatError(f"times not increasing at key {k} ({times[k]:g} s after {times[k - 1]:g} s)")

    def axis(self, times: Floats) -> TimeAxis:
        """Return the axis of times (K,) in seconds."""
        content = times.tobytes()
        if content not in self._found:
            self._found[content] = TimeAxis(move_times(times, self._later))
        return self._found[content]


def _node_builder(node: Any, said: PartialConvention, times: _TimeAxes, where: str) -> NodeBuilder:
    if not isinstance(node, dict) or not isinstance(node.get("name"), str) or not node["name"]:
        raise FormatError("has no name", where=where)
    _check_keys(node, NODE_KEYS, where)
    parent = node.get("parent")
    if parent is not None and not isinstance(parent, str):
        raise FormatError(f"parent is {parent!r} (expected a name)", where=where)
    own = parse_convention(node, where) if any(key in node for key in CONVENTION_KEYS) else UNSPECIFIED
    convention = require_complete(said if own is UNSPECIFIED else fill_from(own, said))
    draft = NodeBuilder(node["name"], convention, parent)
    draft.translation = _parse_array(node, "translation", (3,), ORIGIN, where)
    draft.angles = _parse_array(node, "rotation", (3,), ORIGIN, where)
    draft.scale = _parse_array(node, "scale", (3,), UNSCALED, where)
    if not PIVOT_KEYS.isdisjoint(node):
        draft.pivots = _pivots(node, convention, where)
    curves = node.get("curves", {})
    if not isinstance(curves, dict):
        raise FormatError("curves is no object", where=where)
    for channel, about in curves.items():
        at = f"{where}.curves['{channel}']"
        try:
            kind, _, axis = channel.partition(".")
            slot = draft.place(kind, axis)
            check_nodes(draft, slot, partial(_shared_curve, about, times, at))
        except FormatError as error:
            raise (error if error.where.startswith(at) else error.at(at)) from None
    return draft


def _pivots(node: Mapping[str, Any], convention: Convention, where: str) -> Pivots:
    turns = {}
    for key in PIVOT_ROTATIONS:
        given = _parse_array(node, key, (3, 4), np.zeros(3), where)
        if len(given) == 4:
            if not given.any():
                raise FormatError(f"{key} is zero (expected a unit quaternion)", where=where)
            turns[key] = quaternion.normalize(given)
        else:
            turns[key] = euler.to_quaternion(
                given * convention.unit.radians, order="XYZ", frame=AxesConvention.EXTRINSIC
            )
    offsets = {key: _parse_array(node, key, (3,), np.zeros(3), where) for key in OFFSETS}
    return Pivots(**turns, **offsets)


def _shared_curve(about: Any, axes: _TimeAxes, where: str, unit: float) -> Curve:
    """The curve; short ones of the same text are read once."""
    values = about.get("values") if isinstance(about, dict) else None
    if not isinstance(values, list) or len(values) > MAX_COMPARED_KEYS:
        return _curve(about, axes, where, unit)
    key = repr(about), unit  # unlike values, its text tells 1 from True
    if key not in axes.curves:
        axes.curves[key] = _curve(about, axes, where, unit)
    return axes.curves[key]


def _curve(about: Any, axes: _TimeAxes, where: str, unit: float) -> Curve:
    if not isinstance(about, dict) or not about.keys() >= {"times", "values"}:
        raise FormatError("expected an object with times and values")
    _check_keys(about, CURVE_KEYS, where)
    times = _parse_array(about, "times", None, NOTHING, where)
    count = len(times)
    axes.check(times)
    values = _parse_array(about, "values", (count,), NOTHING, where) * unit
    modes = _parse_modes(about.get("interpolation", "linear"), count)
    tangents: list[Floats | None] = [None, None]
    if Mode.CUBIC in modes.tobytes():
        for i, key in enumerate(("in_tangents", "out_tangents")):
            if key not in about:
                raise FormatError(f"a cubic curve lacks {key}")
            tangents[i] = _parse_array(about, key, (count,), NOTHING, where) * unit
    weights = [_parse_array(about, key, (count,), NOTHING, where) if key in about else None for key in WEIGHTS]
    return Curve(axes.axis(times), values, modes, *tangents, *weights)


def _parse_modes(given: Any, count: int) -> NDArray[np.uint8]:
    if isinstance(given, str) and given in MODES:
        return uniform_modes(count, MODES[given])
    words = given if isinstance(given, list) else [given] * count
    if len(words) != count or not all(isinstance(word, str) and word in MODES for word in words):
        raise FormatError(
            f"interpolation is {given!r} (expected {', '.join(MODES)}, for all or for each of {count} keys)"
        )
    return np.array([MODES[word] for word in words], np.uint8)


def _check_keys(about: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    """Raise FormatError for an unknown key: a misspelled one would be ignored silently."""
    if about.keys() <= KNOWN_KEYS[known]:
        return
    for key in about:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            help = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(known)}"
            raise FormatError(f"unknown key '{key}'", where=where, help=help)


def _parse_array(
    about: Mapping[str, Any], key: str, lengths: tuple[int, ...] | None, default: Floats, where: str
) -> Floats:
    if key not in about:
        return default
    given = about[key]
    good = isinstance(given, list) and all(type(x) is int or isinstance(x, float) for x in given)
    if not good or (lengths is not None and len(given) not in lengths):
        count = "" if lengths is None else " or ".join(map(str, lengths)) + " "
        raise FormatError(f"{key} is not a list of {count}numbers", where=where)
    if not all(-MAX_NUMBER <= x <= MAX_NUMBER for x in given):
        raise FormatError(f"{key} holds a number beyond {MAX_NUMBER:g}", where=where)
    return np.array(given, np.float64)

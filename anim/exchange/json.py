"""JSON curves ↔ EulerMotion: every axis of every node with keys of its own, as FBX and Maya keep them.

    {
      "schema": "euler-curves/1",
      "order": "XYZ", "frame": "extrinsic", "unit": "deg",     how angles combine; a node may say otherwise
      "meters_per_unit": 0.01,                                 of translations, offsets and pivots; 1 if left out
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

Times are seconds. Interpolation is step, linear (if left out) or cubic, for the curve or after each key; tangents are
per second in the value's own unit. Where an axis comes twice in the order (ZXZ), angles are rotation.1, .2, .3.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError
from anim.exchange.convention import Stated, agreed, axis_names, complete, merged, stated
from anim.exchange.curve import Curve, Mode
from anim.exchange.draft import Draft, checked, finished
from anim.exchange.lines import LIMIT
from anim.exchange.motion import OFFSETS, Convention, EulerMotion, EulerNode, Pivots
from anim.gltf import text
from anim.maths import euler, quaternion
from anim.maths.euler import Frame

SCHEMA = "euler-curves/1"
MODES = {mode.name.lower(): mode for mode in Mode}
CURVE_KEYS = {"times", "values", "interpolation", "in_tangents", "out_tangents"}


def read(data: bytes, options: Stated) -> EulerMotion:
    """Return the motion in a JSON of curves, see above; lengths in metres, angles in radians.

    options: what the command line says about the convention. Raises FormatError with the place.
    """
    content = text.parse(data)
    if content.get("schema") != SCHEMA:
        raise FormatError(f"schema is {content.get('schema')!r} (expected '{SCHEMA}')")
    said = agreed(stated(content, ""), options)
    nodes = content.get("nodes")
    if not isinstance(nodes, list) or not nodes:
        raise FormatError("has no nodes")
    drafts, names = [], set[str]()
    for i, node in enumerate(nodes):
        where = f"nodes[{i}]"
        draft = _draft(node, said, where)
        if draft.name in names:
            raise FormatError(f"a second node '{draft.name}'", where=where)
        names.add(draft.name)
        drafts.append(draft)
    unit = content.get("meters_per_unit", 1.0)
    if not isinstance(unit, int | float) or not 0 < unit < 1e9:
        raise FormatError(f"meters_per_unit is {unit!r} (expected a number above 0)")
    finished_nodes, nested = finished(drafts, float(unit))
    return EulerMotion(finished_nodes, nested=nested)


def write(motion: EulerMotion, convention: Convention) -> bytes:
    """Return the motion as a JSON of curves, see above; the convention is that of its nodes, with the unit to use."""
    nodes = [_described(node, motion, convention) for node in motion.nodes]
    content = {
        "schema": SCHEMA,
        "order": convention.order,
        "frame": str(convention.frame),
        "unit": str(convention.unit),
        "nodes": nodes,
    }
    return text.dump(content, indent=1) + b"\n"


def _draft(node: Any, said: Stated, where: str) -> Draft:
    if not isinstance(node, dict) or not isinstance(node.get("name"), str) or not node["name"]:
        raise FormatError("has no name", where=where)
    parent = node.get("parent")
    if parent is not None and not isinstance(parent, str):
        raise FormatError(f"parent is {parent!r} (expected a name)", where=where)
    convention = complete(merged(stated(node, where), said))
    draft = Draft(node["name"], convention, parent)
    draft.translation = _numbers(node, "translation", (3,), np.zeros(3), where)
    draft.angles = _numbers(node, "rotation", (3,), np.zeros(3), where)
    draft.scale = _numbers(node, "scale", (3,), np.ones(3), where)
    if any(key in node for key in (*OFFSETS, "pre_rotation", "post_rotation")):
        draft.pivots = _pivots(node, convention, where)
    curves = node.get("curves", {})
    if not isinstance(curves, dict):
        raise FormatError("curves is no object", where=where)
    for channel, about in curves.items():
        at = f"{where}.curves['{channel}']"
        try:
            kind, _, axis = channel.partition(".")
            slot = draft.place(kind, axis)
            checked(draft, slot, lambda about=about, at=at: _curve(about, at))
        except FormatError as error:
            raise (error if error.where.startswith(at) else error.at(at)) from None
    return draft


def _pivots(node: Mapping[str, Any], convention: Convention, where: str) -> Pivots:
    turns = {}
    for key in ("pre_rotation", "post_rotation"):
        given = _numbers(node, key, (3, 4), np.zeros(3), where)
        if len(given) == 4:
            if not given.any():
                raise FormatError(f"{key} is zero (expected a unit quaternion)", where=where)
            turns[key] = quaternion.normalize(given)
        else:
            turns[key] = euler.to_quaternion(given * convention.unit.radians, order="XYZ", frame=Frame.EXTRINSIC)
    offsets = {key: _numbers(node, key, (3,), np.zeros(3), where) for key in OFFSETS}
    return Pivots(**turns, **offsets)


def _curve(about: Any, where: str) -> Curve:
    if not isinstance(about, dict) or not CURVE_KEYS >= about.keys() >= {"times", "values"}:
        raise FormatError(f"expected an object of {', '.join(sorted(CURVE_KEYS))}; times and values must be there")
    times = _numbers(about, "times", None, np.zeros(0), where)
    count = len(times)
    values = _numbers(about, "values", (count,), np.zeros(0), where)
    given = about.get("interpolation", "linear")
    words = given if isinstance(given, list) else [given] * count
    if len(words) != count or not all(isinstance(word, str) and word in MODES for word in words):
        raise FormatError(
            f"interpolation is {given!r} (expected {', '.join(MODES)}, for all or for each of {count} keys)"
        )
    modes = np.array([MODES[word] for word in words], np.uint8)
    tangents: list[Floats | None] = [None, None]
    if (modes == Mode.CUBIC).any():
        for i, key in enumerate(("in_tangents", "out_tangents")):
            if key not in about:
                raise FormatError(f"a cubic curve lacks {key}")
            tangents[i] = _numbers(about, key, (count,), np.zeros(0), where)
    return Curve(times, values, modes, *tangents)


def _numbers(
    about: Mapping[str, Any], key: str, lengths: tuple[int, ...] | None, default: Floats, where: str
) -> Floats:
    if key not in about:
        return default
    given = about[key]
    good = isinstance(given, list) and all(type(x) in (int, float) for x in given)
    if not good or (lengths is not None and len(given) not in lengths):
        count = "" if lengths is None else " or ".join(map(str, lengths)) + " "
        raise FormatError(f"{key} is not a list of {count}numbers", where=where)
    if not all(-LIMIT <= x <= LIMIT for x in given):
        raise FormatError(f"{key} holds a number beyond {LIMIT:g}", where=where)
    return np.array(given, np.float64)


def _described(node: EulerNode, motion: EulerMotion, convention: Convention) -> dict[str, Any]:
    about: dict[str, Any] = {"name": node.name}
    if node.parent >= 0:
        about["parent"] = motion.nodes[node.parent].name
    about["translation"] = _short(node.translation)
    about["rotation"] = _short(node.angles / convention.unit.radians)
    about["scale"] = _short(node.scale)
    curves: dict[str, Any] = {}
    for axis, curve in sorted(node.moves.items()):
        curves[f"translation.{'xyz'[axis]}"] = _curve_json(curve)
    for axis_name, turn in zip(axis_names(node.order), node.rotation, strict=True):
        if turn is not None:
            curves[f"rotation.{axis_name}"] = _curve_json(turn.scaled(1 / convention.unit.radians))
    for axis, curve in sorted(node.scales.items()):
        curves[f"scale.{'xyz'[axis]}"] = _curve_json(curve)
    return {**about, "curves": curves} if curves else about


def _curve_json(curve: Curve) -> dict[str, Any]:
    about: dict[str, Any] = {"times": _short(curve.times), "values": _short(curve.values)}
    if (curve.modes != Mode.LINEAR).any():
        words = [Mode(mode).name.lower() for mode in curve.modes.tolist()]
        about["interpolation"] = words[0] if len(set(words)) == 1 else words
    if curve.in_tangents is not None and curve.out_tangents is not None:
        about |= {"in_tangents": _short(curve.in_tangents), "out_tangents": _short(curve.out_tangents)}
    return about


def _short(values: Floats) -> list[float]:
    """Numbers with ten digits behind the point: far below float32, without the noise of binary fractions."""
    rounded: list[float] = (np.round(values, 10) + 0.0).tolist()
    return rounded

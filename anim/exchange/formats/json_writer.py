"""EulerMotion → JSON curves. Schema: see `json_reader`."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.exchange.euler.convention import axis_names
from anim.exchange.euler.curve import HANDLES, Curve, Mode
from anim.exchange.euler.motion import NO_PIVOTS, OFFSETS, Convention, EulerMotion, EulerNode, Pivots
from anim.gltf.io import json_text

SCHEMA = "euler-curves/1"
PIVOT_ROTATIONS = ("pre_rotation", "post_rotation")
MULTILINE_LIST = re.compile(rb"\[\n\s*([^][{}]*?)\s*\]")  # of numbers or strings


def write(motion: EulerMotion, convention: Convention) -> bytes:
    """Return the motion as a JSON of curves, in the unit and the default order of the convention."""
    nodes = [_node_json(node, motion, convention) for node in motion.nodes]
    content = {
        "schema": SCHEMA,
        "order": convention.order,
        "frame": str(convention.frame),
        "unit": str(convention.unit),
        "nodes": nodes,
    }
    return MULTILINE_LIST.sub(_on_one_line, json_text.dump(content, indent=1)) + b"\n"


def _on_one_line(found: re.Match[bytes]) -> bytes:
    return b"[" + b" ".join(found[1].split()) + b"]"


def _node_json(node: EulerNode, motion: EulerMotion, convention: Convention) -> dict[str, Any]:
    about: dict[str, Any] = {"name": node.name}
    if node.order != convention.order:
        about["order"] = node.order
    if node.parent >= 0:
        about["parent"] = motion.nodes[node.parent].name
    about["translation"] = _short(node.translation)
    about["rotation"] = _short(node.angles / convention.unit.radians)
    about["scale"] = _short(node.scale)
    if node.pivots is not NO_PIVOTS:
        about |= _pivots_json(node.pivots)
    curves: dict[str, Any] = {}
    for axis, curve in sorted(node.moves.items()):
        curves[f"translation.{'xyz'[axis]}"] = _curve_json(curve)
    for axis_name, turn in zip(axis_names(node.order), node.rotation, strict=True):
        if turn is not None:
            curves[f"rotation.{axis_name}"] = _curve_json(turn.scaled(1 / convention.unit.radians))
    for axis, curve in sorted(node.scales.items()):
        curves[f"scale.{'xyz'[axis]}"] = _curve_json(curve)
    return {**about, "curves": curves} if curves else about


def _pivots_json(pivots: Pivots) -> dict[str, Any]:
    return {name: _short(getattr(pivots, name)) for name in (*PIVOT_ROTATIONS, *OFFSETS)}


def _curve_json(curve: Curve) -> dict[str, Any]:
    about: dict[str, Any] = {"times": _short(curve.times), "values": _short(curve.values)}
    if (curve.modes != Mode.LINEAR).any():
        words = [Mode(mode).name.lower() for mode in curve.modes.tolist()]
        about["interpolation"] = words[0] if len(set(words)) == 1 else words
    handles = {name: getattr(curve, name) for name in HANDLES}
    return about | {name: _short(handle) for name, handle in handles.items() if handle is not None}


def _short(values: Floats) -> list[float]:
    """Numbers with ten decimals: far below float32, without the noise of binary fractions."""
    rounded: list[float] = (np.round(values, 10) + 0.0).tolist()
    return rounded

"""BVH ↔ EulerMotion. Angles are degrees, intrinsic, in the channel order of each joint."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from anim.arrays import Floats
from anim.errors import UnsupportedError
from anim.exchange.euler import curve
from anim.exchange.euler.curve import Curve, Mode
from anim.exchange.euler.motion import Convention, EulerMotion, EulerNode
from anim.exchange.formats import bvh_frames, bvh_hierarchy, bvh_writer
from anim.exchange.formats.bvh_hierarchy import BvhJoint
from anim.exchange.formats.labels import unique
from anim.exchange.formats.text import decode_text
from anim.maths.euler import AxesConvention
from anim.model import TimeAxis
from anim.units import list_some


class BvhPosition(StrEnum):
    """Meaning of position channels relative to the OFFSET of their joint."""

    REPLACE = "replace"
    ADD = "add"


def read(data: bytes, *, position: BvhPosition = BvhPosition.REPLACE) -> EulerMotion:
    """Return the motion in a BVH file, lengths in the file's own unit, times at whole frames.

    position: position channels replace the OFFSET, as in Blender, or are added to it, as in three.js.
    Repeated names get a number: "Hand", "Hand.2". Line ends of any system, UTF-8, UTF-16 or Latin-1.
    Raises FormatError with the line.
    """
    lines = decode_text(data).split("\n")
    while len(lines) > 1 and not lines[-1].strip():
        lines.pop()
    joints, start, column = bvh_hierarchy.read_hierarchy(lines)
    found = bvh_frames.read_frames(lines, start, column, sum(len(joint.channels) for joint in joints))
    names = unique([joint.name for joint in joints])
    renamed = [name for name, joint in zip(names, joints, strict=True) if name != joint.name]
    axis = TimeAxis(np.arange(len(found.rows)) / found.fps)
    nodes, first = [], 0
    for joint, name in zip(joints, names, strict=True):
        last = first + len(joint.channels)
        nodes.append(_node(joint, name, axis, found.rows[:, first:last], position))
        first = last
    notes = found.notes + ((f"names that appear twice got numbers: {list_some(renamed)}",) if renamed else ())
    return EulerMotion(tuple(nodes), sampled=True, notes=notes)


def write(motion: EulerMotion, convention: Convention) -> bytes:
    """Return the motion as a BVH. Raises UnsupportedError for extrinsic angles: BVH has none."""
    if convention.frame != AxesConvention.INTRINSIC:
        raise UnsupportedError("a BVH's angles are intrinsic", help="an extrinsic order is an intrinsic one reversed")
    return bvh_writer.write(motion)


def _node(joint: BvhJoint, name: str, time_axis: TimeAxis, rows: Floats, position: BvhPosition) -> EulerNode:
    offset = np.array(joint.offset)
    modes = curve.uniform_modes(len(time_axis), Mode.LINEAR)
    order, rotation, moves = "", list[Curve | None](), dict[int, Curve]()
    for (axis, kind), values in zip(joint.channels, rows.T, strict=True):
        if kind == "rotation":
            order += axis
            rotation.append(Curve(time_axis, np.radians(values), modes))
        else:
            at = "XYZ".index(axis)
            moves[at] = Curve(time_axis, values + (offset[at] if position == BvhPosition.ADD else 0.0), modes)
    angles = np.zeros(len(order))
    return EulerNode(
        name, joint.parent, offset, order, AxesConvention.INTRINSIC, angles, tuple(rotation), moves, end=joint.end
    )

"""Vertices of a mesh by a side of its box, a joint's weights, a material, or a box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import NotFoundError, RangeError
from anim.model import MeshInstance

SIDES = tuple(f"{axis}-{end}" for axis in "xyz" for end in ("min", "max"))
SIDE_FRACTION = 0.01  # of the extent along the axis
MIN_JOINT_WEIGHT = 0.5
KINDS = f"{', '.join(SIDES)}, joint:GLOB, weight:GLOB,MIN, material:GLOB, box:X,Y,Z,SX,SY,SZ"


def select_vertices(
    selector: str, instance: MeshInstance, positions: Floats, joint_names: Sequence[str], materials: Sequence[str]
) -> Bools:
    """Return the selected vertices (V,) of a mesh instance.

    selector: "x-min" … "z-max", the vertices within 1 % of that side of the box around positions (V, 3);
    "joint:GLOB", those that these joints hold by half or more; "weight:GLOB,MIN", by this weight or more;
    "material:GLOB"; "box:X,Y,Z,SX,SY,SZ", center and size in metres.
    joint_names: of all nodes. materials: names by index.
    Raises RangeError for another selector, NotFoundError if no vertex is selected.
    """
    kind, _, rest = selector.partition(":")
    if selector in SIDES:
        chosen = _at_side(selector, positions)
    elif kind == "joint":
        chosen = _joint_weights(rest, instance, joint_names) >= MIN_JOINT_WEIGHT
    elif kind == "weight":
        chosen = _heavier(rest, instance, joint_names)
    elif kind == "material":
        chosen = _of_materials(rest, instance, materials)
    elif kind == "box":
        chosen = _in_box(rest, positions)
    else:
        raise RangeError(f"'{selector}' selects no vertices (expected {KINDS})")
    if not chosen.any():
        raise NotFoundError(f"'{selector}' selects no vertex of mesh '{instance.mesh.name}'")
    return np.asarray(chosen)


def _at_side(side: str, positions: Floats) -> Bools:
    axis, sign = "xyz".index(side[0]), 1 if side.endswith("min") else -1
    along = sign * positions[:, axis]
    if not len(along):  # a box around nothing has no sides
        return np.zeros(0, bool)
    return np.asarray(along <= along.min() + SIDE_FRACTION * np.ptp(along))


def _joint_weights(glob: str, instance: MeshInstance, names: Sequence[str]) -> Floats:
    """Sum of the weights (V,) of the matching joints."""
    if instance.skin is None:
        raise NotFoundError(f"mesh '{instance.mesh.name}' has no skin, and joints need one")
    matching = np.array([fnmatchcase(names[node], glob) for node in instance.skin.joints.tolist()])
    return np.asarray((instance.mesh.weights * matching[instance.mesh.joints]).sum(axis=1))


def _heavier(text: str, instance: MeshInstance, names: Sequence[str]) -> Bools:
    glob, _, least = text.rpartition(",")
    try:
        weight = float(least)
    except ValueError:
        weight = math.nan
    if not glob or not 0 < weight <= 1:
        raise RangeError(f"'weight:{text}' has no weight (expected weight:GLOB,MIN with a number up to 1)")
    return np.asarray(_joint_weights(glob, instance, names) >= weight)


def _of_materials(glob: str, instance: MeshInstance, materials: Sequence[str]) -> Bools:
    chosen = np.zeros(len(instance.mesh.positions), bool)
    first = 0
    for part in instance.mesh.primitives:
        name = materials[part.material] if 0 <= part.material < len(materials) else ""
        chosen[first : first + part.vertices] = fnmatchcase(name, glob)
        first += part.vertices
    return chosen


def _in_box(text: str, positions: Floats) -> Bools:
    try:
        values = [float(each) for each in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 6 or not all(map(math.isfinite, values)) or min(values[3:]) <= 0:
        raise RangeError(f"'box:{text}' is no box (expected box:X,Y,Z,SX,SY,SZ, sizes above 0)")
    inside: Bools = (np.abs(positions - np.array(values[:3])) <= 0.5 * np.array(values[3:])).all(axis=1)
    return inside

"""Decompose the `matrix` of animated nodes, since glTF animates only TRS."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from anim.arrays import Floats
from anim.errors import AnimError, FormatError
from anim.gltf.document import Json, json_array, node_label
from anim.gltf.validation import channel_targets
from anim.maths import matrix

MAX_RELATIVE_SHEAR = 1e-4  # relative; above the error of float32 products of rotations and scales
SIGNIFICANT_DIGITS = 9  # significant digits written: enough for any float32
IDENTITY = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


def animated_matrices(animations: Iterable[Json], nodes: list[Json]) -> list[int]:
    """Return the indices of nodes with a `matrix` and animated translation, rotation or scale."""
    found = (channel_targets.channel_target(channel) for animation in animations for channel in animation["channels"])
    numbers = {target[0] for target in found if target is not None and target[1] != "weights"}
    return sorted(n for n in numbers if n is not None and "matrix" in nodes[n])


def expand_matrices(json: Json) -> tuple[Json, tuple[int, ...]]:
    """Return the JSON with TRS instead of `matrix` for animated nodes, and the indices of those nodes.

    Identity properties are omitted; nodes without animation keep their matrix.
    Raises FormatError for a matrix that is not a product of translation, rotation and scale.
    {"matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 0, 0, 1]} → {"translation": [1, 0, 0], "scale": [2, 2, 2]}
    """
    nodes = json_array(json, "nodes")
    numbers = animated_matrices(json_array(json, "animations"), nodes)
    if not numbers:
        return json, ()
    new = list(nodes)
    for number in numbers:
        try:
            new[number] = _expand(nodes[number])
        except AnimError as error:
            raise error.at(node_label(json, number)) from None
    return {**json, "nodes": new}, tuple(numbers)


def decompose(values: list[float]) -> tuple[Floats, Floats, Floats, Floats | None]:
    """Return translation (3,), rotation (4,), scale (3,) of a `matrix`; and itself (3, 4) if sheared.

    values: 16 numbers, column-major. Sheared: not a product of translation, rotation and scale within float32.
    """
    whole = np.array(values, float).reshape(4, 4).T
    translation, rotation, scale, shear = matrix.decompose(whole[:3])
    is_sheared = bool(shear > MAX_RELATIVE_SHEAR) or bool(np.abs(whole[3] - (0, 0, 0, 1)).max() > MAX_RELATIVE_SHEAR)
    return translation, rotation, scale, whole[:3] if is_sheared else None


def _expand(node: Json) -> Json:
    """The node with TRS instead of its matrix."""
    translation, rotation, scale, sheared = decompose(node["matrix"])
    if sheared is not None:
        raise FormatError(
            "is animated and has a sheared matrix (expected a product of translation, rotation and scale)",
            help="remove the shear where the file was made: apply the scale of the nodes above this one, then export",
        )
    rotation = -rotation if rotation[3] < 0 else rotation  # both are the same rotation; most tools write w ≥ 0
    pose = {key: _round_values(part) for key, part in zip(IDENTITY, (translation, rotation, scale), strict=True)}
    pose = {key: part for key, part in pose.items() if part != list(IDENTITY[key])}
    new: Json = {}
    for key, value in node.items():
        new |= pose if key == "matrix" else {key: value}
    return new


def _round_values(part: Floats) -> list[float]:
    return [float(f"{value:.{SIGNIFICANT_DIGITS}g}") + 0.0 for value in part.tolist()]

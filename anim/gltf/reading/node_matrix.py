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
    if not any("matrix" in node for node in nodes):  # most files: no channel needs a look
        return []
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
    """Return translation (3,), rotation (4,), scale (3,) of a `matrix`; and itself (3, 4) if it isn't their product.

    values: 16 numbers, column-major. Their product: within float32.
    """
    whole = _matrix(values)
    translation, rotation, scale, shear = matrix.decompose(whole[:3])
    is_product = bool(shear <= MAX_RELATIVE_SHEAR) and _is_affine(whole)
    return translation, rotation, scale, None if is_product else whole[:3]


def _matrix(values: list[float]) -> Floats:
    return np.array(values, float).reshape(4, 4).T


def _is_affine(whole: Floats) -> bool:
    return bool(np.abs(whole[3] - (0, 0, 0, 1)).max() <= MAX_RELATIVE_SHEAR)


def _expand(node: Json) -> Json:
    """The node with TRS instead of its matrix."""
    translation, rotation, scale, whole = decompose(node["matrix"])
    if whole is not None:
        kind, advice = _fault(_matrix(node["matrix"]))
        raise FormatError(
            f"is animated and has a {kind} matrix (expected a product of translation, rotation and scale)", help=advice
        )
    rotation = -rotation if rotation[3] < 0 else rotation  # both are the same rotation; most tools write w ≥ 0
    pose = {key: _round_values(part) for key, part in zip(IDENTITY, (translation, rotation, scale), strict=True)}
    pose = {key: part for key, part in pose.items() if part != list(IDENTITY[key])}
    new: Json = {}
    for key, value in node.items():
        new |= pose if key == "matrix" else {key: value}
    return new


def _fault(whole: Floats) -> tuple[str, str]:
    """The kind of a matrix (4, 4) without translation, rotation and scale, and advice."""
    if _is_affine(whole):
        return (
            "sheared",
            "remove the shear where the file was made: apply the scale of the nodes above this one, then export",
        )
    kind = "projective" if np.linalg.det(whole) else "singular"
    row = ", ".join(f"{value:g}" for value in whole[3].tolist())
    return kind, f"its last row is {row} (expected 0, 0, 0, 1): give the node a transform where the file was made"


def _round_values(part: Floats) -> list[float]:
    return [float(f"{value:.{SIGNIFICANT_DIGITS}g}") + 0.0 for value in part.tolist()]

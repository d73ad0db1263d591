"""GA201: vertices with more influences than most players use."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.influences import edit_influences
from anim.check.rule import Fix, Parameter, Parameters, Rule
from anim.gltf.document import Document


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for skin in file.facts.skins:
        if skin.most_influences is not None and skin.most_influences > parameters["influences"]:
            problem = f"up to {skin.most_influences} influences per vertex"
            yield file.in_skin(skin.index, value=skin.most_influences, problem=problem)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with the largest weights of each vertex, which add up to 1 again."""
    sets = math.ceil(parameters["influences"] / 4)

    def largest(skin: int, joints: Ints, weights: Floats) -> tuple[Ints, Floats]:
        weights = _sums_by_joint(joints, weights)
        order = np.argsort(-weights, axis=1, kind="stable")[:, : 4 * sets]
        joints, weights = np.take_along_axis(joints, order, axis=1), np.take_along_axis(weights, order, axis=1)
        weights[:, int(parameters["influences"]) :] = 0
        sums = weights.sum(axis=1, keepdims=True)
        return np.where(weights > 0, joints, 0), weights / np.where(sums > 0, sums, 1)

    return edit_influences(file, {each.number for each in found}, largest)


def _sums_by_joint(joints: Ints, weights: Floats) -> Floats:
    """Weights (V, I) with the sum of each joint at its first influence, and 0 at others: sets may name a joint twice.

    joints (1, 2, 1), weights (0.5, 0.3, 0.2) → 0.7, 0.3, 0
    """
    sums = weights.copy()
    for later in range(1, joints.shape[1]):
        for first in range(later):
            same = (joints[:, first] == joints[:, later]) & (sums[:, first] > 0) & (sums[:, later] > 0)
            sums[:, first] += np.where(same, sums[:, later], 0)
            sums[same, later] = 0
    return sums


RULE = Rule(
    "GA201",
    "many-influences",
    Severity.WARNING,
    "Vertices have more than four influences.",
    "glTF promises one set of four (JOINTS_0). Godot drops the others (godotengine/godot#61912).",
    find,
    advice="many players use the first four only: limit them where the mesh is made",
    parameters={"influences": Parameter(4, "", "influences per vertex that players use")},
    fix=Fix("keep the four largest of each vertex, divided by their sum", fix, is_safe=False),
)

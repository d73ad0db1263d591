"""GA210: joints whose scale is not uniform."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.arrays import Bools, Floats
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the joints below others, at rest or in a chosen clip."""
    joints = np.array([joint for joint in file.joints if file.skeleton.parents[joint] >= 0], np.int64)
    at_rest = joints[_is_spread(file.skeleton.scale[joints], parameters["spread"])]
    animated = [
        table.nodes[table.count_marked(_is_spread(table.values, parameters["spread"])) > 0]
        for table in file.tracks("scale")
    ]
    moving = np.concatenate([np.zeros(0, np.int64), *animated])
    for joint in sorted({*at_rest.tolist(), *moving[np.isin(moving, joints)].tolist()}):
        yield file.in_node(joint)


def _is_spread(scales: Floats, limit: float) -> Bools:
    """Mask of scales (S, 3) whose factors differ by more than a fraction of the largest."""
    sizes = np.abs(scales)
    most = sizes.max(axis=1, initial=0.0)
    return np.asarray(most - sizes.min(axis=1, initial=np.inf) > limit * most)


RULE = Rule(
    "GA210",
    "non-uniform-joint-scale",
    Severity.WARNING,
    "Joints have a scale that is not uniform.",
    "Joints below are sheared as soon as they rotate; engines that keep scale apart show another shape "
    "(godotengine/godot#49010).",
    find,
    counted("joint has a scale that is not uniform", "joints have a scale that is not uniform"),
    "scale all axes alike, or use morph targets, where the file is made",
    parameters={"spread": Parameter(0.01, "%", "difference between the axes")},
)

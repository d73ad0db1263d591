"""GA208: skeletons below a scaled node."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule
from anim.gltf.document import json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    parents, world = file.skeleton.parents, file.rest_world
    for i, skin in enumerate(json_array(file.json, "skins")):
        joints = set(skin["joints"])
        above = {int(parents[joint]) for joint in joints} - joints - {-1}
        scales = [float(s) for node in above for s in np.sqrt((world[node][:, :3] ** 2).sum(axis=0))]
        worst = max(scales, key=lambda s: abs(s - 1), default=1.0)
        if abs(worst - 1) > parameters["change"]:
            yield file.in_skin(i, value=worst, problem=f"the node above its joints has a scale of {worst:.3g}")


RULE = Rule(
    "GA208",
    "scaled-armature",
    Severity.WARNING,
    "The node above a skeleton is scaled.",
    "Sizes of 0.01 or 100 from other units break physics, constraints and retargeting: "
    "KhronosGroup/glTF-Blender-IO#828, godotengine/godot#63641, pixiv/three-vrm#1064.",
    find,
    advice="apply the scale to joints and mesh where the file is made",
    parameters={"change": Parameter(0.01, "%", "difference from 1")},
)

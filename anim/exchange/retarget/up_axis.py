"""Up axis of a rest pose: detects files with another axis up than Y."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from anim.model import Skeleton
from anim.sampling import rest_pose, world_matrices

MIN_AXIS_FRACTION = 0.8  # fraction of the length along the axis; 37°
FEET = ("left_foot", "right_foot")


def up_axis(skeleton: Skeleton, roles: Mapping[str, int]) -> str:
    """Return "X", "Y" or "Z", the axis from the feet to the hips at rest in world space.

    Without feet, from the hips to the head. "" if these are unknown, or the direction is along no axis clearly: an
    animal's back points forward, its legs still point down.
    """
    places = world_matrices(skeleton, rest_pose(skeleton))[0, :, :3, 3]
    feet = [places[roles[role]] for role in FEET if role in roles]
    if "hips" not in roles or not (feet or "head" in roles):
        return ""
    hips = places[roles["hips"]]
    way = np.abs(hips - np.mean(feet, axis=0) if feet else places[roles["head"]] - hips)
    axis = int(way.argmax())
    return "XYZ"[axis] if way[axis] > MIN_AXIS_FRACTION * np.linalg.norm(way) else ""

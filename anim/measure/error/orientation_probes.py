"""Points that represent position and rotation of nodes: each node's origin, and points on its axes."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Skeleton
from anim.sampling import rest_world

PROBE_DISTANCE = 0.05  # of the skeleton's size: distance of points from a node, for its rotation
SPEED_STEP = 1e-4  # s; step of one-sided differences for velocities at an end
ENDS = np.concatenate((np.eye(3), -np.eye(3)))  # directions of the six points around a node, along its own axes


def probe_size(places: Floats) -> float:
    """Return the diagonal of the box around the points (P, F, 3) in the first frame; 1 if it is empty."""
    first = places[:, 0]
    return float(np.linalg.norm(first.max(axis=0) - first.min(axis=0))) or 1.0


def shell_points(skeleton: Skeleton, nodes: Ints, radius: float) -> Floats:
    """Return points (S, 6, 3) in the space of each of the `nodes`, `radius` m from it in the rest pose."""
    axes = rest_world(skeleton)[nodes, :, :3]
    scale = np.sqrt((axes * axes).sum(axis=1))  # (S, 3)
    return np.asarray(ENDS * (radius / np.where(scale > 0, scale, 1))[:, None])

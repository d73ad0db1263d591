"""Stick mesh for a skeleton: a slim bipyramid from each joint to each of its children."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.model import Mesh, Skeleton, Skin
from anim.sampling import rest_world

NAME = "sticks"
WIDEST_FRACTION = 0.18  # fraction of a stick's length from the joint to its widest point
RADIUS_PER_LENGTH = 0.07  # radius / length
MIN_LENGTH_FRACTION = 1e-4  # fraction of the skeleton's size; shorter sticks are omitted
MAX_RADIUS, MIN_RADIUS = 0.02, 0.004  # fractions of the skeleton's size
END_LENGTH_FRACTION = 0.02  # fraction of the size: stick length of a joint without children


def stick_mesh(skeleton: Skeleton, ends: frozenset[int] = frozenset()) -> tuple[Mesh, Skin]:
    """Return a mesh bound to the skeleton, and its skin; each stick follows its start joint.

    ends: nodes that only mark the end of their parent. Normals are those of flat faces.
    """
    joints: Ints = np.array([i for i in range(len(skeleton)) if i not in ends], np.int64)
    place_of = {int(node): place for place, node in enumerate(joints)}
    world = rest_world(skeleton)
    places = world[:, :, 3]
    size = float(np.ptp(places, axis=0).max()) or 1.0
    pieces, owners = [], []
    for start, end, owner in _lines(skeleton, places, ends, size):
        pieces.append(_bipyramid(start, end, size))
        owners.append(np.full(24, place_of[owner], np.int64))
    corners = np.concatenate(pieces) if pieces else np.zeros((0, 3))
    normals = np.repeat(_normals(corners.reshape(-1, 3, 3)), 3, axis=0)
    holders: Ints = np.zeros((len(corners), 4), np.int64)
    holders[:, 0] = np.concatenate(owners) if owners else 0
    weights = np.tile((1.0, 0.0, 0.0, 0.0), (len(corners), 1))
    faces = np.arange(len(corners)).reshape(-1, 3)
    none = np.zeros((0, len(corners), 3))
    mesh = Mesh(NAME, corners, faces, holders, weights, none, np.zeros(0), normals)
    return mesh, Skin(joints, matrix.inverse(world[joints]))


def _lines(skeleton: Skeleton, places: Floats, ends: frozenset[int], size: float) -> list[tuple[Floats, Floats, int]]:
    """Start, end and owner of every stick."""
    lines = []
    parents = skeleton.parents.tolist()
    bare = set(range(len(parents))) - ends
    for node, parent in enumerate(parents):
        if parent >= 0 and np.linalg.norm(places[node] - places[parent]) > MIN_LENGTH_FRACTION * size:
            lines.append((places[parent], places[node], parent))
            bare.discard(parent)
    return lines + [(places[node], places[node] + [0, END_LENGTH_FRACTION * size, 0], node) for node in sorted(bare)]


def _bipyramid(start: Floats, end: Floats, size: float) -> Floats:
    """Corners (24, 3) of eight triangles."""
    along = end - start
    length = float(np.linalg.norm(along))
    ahead = along / length
    side = np.cross(ahead, (1.0, 0, 0) if abs(ahead[0]) < 0.7 else (0, 0, 1.0))
    side /= np.linalg.norm(side)
    radius = min(np.clip(RADIUS_PER_LENGTH * length, MIN_RADIUS * size, MAX_RADIUS * size), length / 2)
    ring = [radius * v for v in (side, np.cross(ahead, side), -side, -np.cross(ahead, side))]
    middle = start + WIDEST_FRACTION * along
    triangles = []
    for i in range(4):
        a, b = middle + ring[i], middle + ring[(i + 1) % 4]
        triangles += [start, b, a, end, a, b]
    return np.array(triangles)


def _normals(triangles: Floats) -> Floats:
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))

"""Stick mesh for a skeleton: a slim bipyramid from each joint to each of its children."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.memory import MemoryBudget
from anim.model import Mesh, Skeleton, Skin
from anim.sampling import rest_world

NAME = "sticks"
WIDEST_FRACTION = 0.18  # fraction of a stick's length from the joint to its widest point
RADIUS_PER_LENGTH = 0.07  # radius / length
MIN_LENGTH_FRACTION = 1e-4  # fraction of the skeleton's size; shorter sticks are omitted
MAX_RADIUS, MIN_RADIUS = 0.02, 0.004  # fractions of the skeleton's size
BYTES_PER_STICK = 24 * 512  # of 24 vertices, bound and baked
END_LENGTH_FRACTION = 0.02  # fraction of the size: stick length of a joint without children


def stick_mesh(skeleton: Skeleton, ends: frozenset[int] = frozenset()) -> tuple[Mesh, Skin]:
    """Return a mesh bound to the skeleton, and its skin; each stick follows its start joint.

    ends: nodes that only mark the end of their parent. Normals are those of flat faces.
    Raises UnsupportedError for more sticks than the limit of memory allows to bake.
    """
    joints: Ints = np.array([i for i in range(len(skeleton)) if i not in ends], np.int64)
    place_of = {int(node): place for place, node in enumerate(joints)}
    world = rest_world(skeleton)
    places = world[:, :, 3]
    size = float(np.ptp(places, axis=0).max()) or 1.0
    starts, tips, owners = _lines(skeleton, places, ends, size)
    MemoryBudget(0).check(BYTES_PER_STICK * len(starts))
    corners = _bipyramids(starts, tips, size).reshape(-1, 3)
    normals = np.repeat(_normals(corners.reshape(-1, 3, 3)), 3, axis=0)
    holders: Ints = np.zeros((len(corners), 4), np.int64)
    holders[:, 0] = np.repeat(np.array([place_of[owner] for owner in owners], np.int64), 24)
    weights = np.tile((1.0, 0.0, 0.0, 0.0), (len(corners), 1))
    faces = np.arange(len(corners)).reshape(-1, 3)
    none = np.zeros((0, len(corners), 3))
    mesh = Mesh(NAME, corners, faces, holders, weights, none, np.zeros(0), normals)
    return mesh, Skin(joints, matrix.inverse(world[joints]))


def _lines(skeleton: Skeleton, places: Floats, ends: frozenset[int], size: float) -> tuple[Floats, Floats, list[int]]:
    """Start (S, 3), end (S, 3) and owner of every stick."""
    parents = skeleton.parents.tolist()
    below = np.flatnonzero(skeleton.parents >= 0)
    below = below[_lengths(places[below] - places[skeleton.parents[below]]) > MIN_LENGTH_FRACTION * size]
    owners = [parents[node] for node in below.tolist()]
    bare = sorted(set(range(len(parents))) - ends - set(owners))
    up = places[bare] + [0, END_LENGTH_FRACTION * size, 0]
    return np.concatenate((places[owners], places[bare])), np.concatenate((places[below], up)), [*owners, *bare]


def _bipyramids(start: Floats, end: Floats, size: float) -> Floats:
    """Corners (S, 24, 3) of eight triangles each."""
    along = end - start
    length = _lengths(along)[:, None]
    ahead = along / length
    side = np.cross(ahead, np.where(np.abs(ahead[:, :1]) < 0.7, (1.0, 0, 0), (0, 0, 1.0)))
    side /= _lengths(side)[:, None]
    radius = np.minimum(np.clip(RADIUS_PER_LENGTH * length, MIN_RADIUS * size, MAX_RADIUS * size), length / 2)
    other = np.cross(ahead, side)
    middle = start + WIDEST_FRACTION * along
    ring = [middle + radius * v for v in (side, other, -side, -other)]
    pairs = [(ring[i], ring[(i + 1) % 4]) for i in range(4)]
    return np.stack([corner for a, b in pairs for corner in (start, b, a, end, a, b)], axis=1)


def _lengths(vectors: Floats) -> Floats:
    """Length (S,) of vectors (S, 3), each summed as by `np.linalg.norm` of one."""
    return np.sqrt(np.array([each.dot(each) for each in vectors], np.float64))


def _normals(triangles: Floats) -> Floats:
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))

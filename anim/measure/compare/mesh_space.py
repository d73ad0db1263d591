"""Transforms between the spaces of two meshes: tools move and scale vertices, and joints or nodes the other way."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import matrix
from anim.model import Mesh

SAME_SPACE_TOLERANCE = 0.01  # of a mesh's size: vertices at a larger distance are different ones
SINGULAR = 1e-12  # determinants below this, relative to the cube of the size, have no inverse
SAME_SPACE = 1e-3  # relative; joints whose matrices differ by more have another bind pose, not another mesh space
IDENTITY = np.eye(4)[:3]


def same_vertices(old: Mesh, new: Mesh) -> bool:
    """Return whether both have the same vertices in the same order, possibly in another mesh space."""
    a, b = old.positions, new.positions
    if np.array_equal(a, b):
        return True
    if len(a) != len(b):
        return False
    space = from_points(a, b)
    rest = np.linalg.norm(matrix.apply(space, a) - b, axis=1).max()
    return bool(rest <= SAME_SPACE_TOLERANCE * np.linalg.norm(np.ptp(b, axis=0)) and space[0, 0] > 0)


def from_points(a: Floats, b: Floats) -> Floats:
    """b_from_a (3, 4): translation and uniform scale from points a (V, 3) to b, by least squares."""
    if np.array_equal(a, b):
        return IDENTITY
    middle_a, middle_b = a.mean(axis=0), b.mean(axis=0)
    spread = float(((a - middle_a) ** 2).sum())
    factor = float(((a - middle_a) * (b - middle_b)).sum()) / spread if spread > 0 else 1.0
    return np.column_stack((factor * np.eye(3), middle_b - factor * middle_a))


def from_boxes(a: Floats, b: Floats) -> Floats | None:
    """b_from_a (3, 4) from the boxes around points a and b, in any order; None for other proportions."""
    sizes = [np.ptp(each, axis=0) for each in (a, b)]
    middles = [(each.max(axis=0) + each.min(axis=0)) / 2 for each in (a, b)]
    limit = SAME_SPACE_TOLERANCE * float(np.linalg.norm(sizes[1]))
    if max(np.abs(sizes[0] - sizes[1]).max(), np.abs(middles[0] - middles[1]).max()) <= limit:
        return IDENTITY
    longest = int(sizes[0].argmax())
    factor = float(sizes[1][longest] / sizes[0][longest]) if sizes[0][longest] > 0 else 1.0
    if np.abs(factor * sizes[0] - sizes[1]).max() > limit:
        return None
    return np.column_stack((factor * np.eye(3), middles[1] - factor * middles[0]))


def from_binds(a: Floats, b: Floats, guess: Floats | None) -> Floats:
    """b_from_a (3, 4) from inverse bind matrices a and b (J, 3, 4), a = b · b_from_a; else from vertices.

    Vertices give it within their rounding, the matrices exactly; but other tools may have changed the bind pose of
    joints.
    """
    if not len(a) or np.array_equal(a, b):
        return IDENTITY
    size = np.sqrt((b[..., :3] ** 2).sum(axis=(-1, -2)))
    regular: Bools = np.asarray(np.abs(np.linalg.det(b[..., :3])) > SINGULAR * size**3)
    if not regular.any():
        return IDENTITY if guess is None else guess
    back = np.linalg.inv(b[regular][..., :3])
    spaces = np.concatenate((back @ a[regular][..., :3], back @ (a - b)[regular][..., 3:]), axis=-1)
    middle: Floats = np.median(spaces, axis=0)
    apart = np.sqrt(((spaces - middle) ** 2).sum(axis=(-1, -2))) / np.sqrt((middle * middle).sum())
    is_one = float(np.median(apart)) <= SAME_SPACE
    return middle if is_one or guess is None else guess

"""A chain of joints that swing, there and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from anim.model import Clip, Mesh, MeshInstance, Scene
from tests.clips import about, clip, skeleton, track

FPS = 10
AT = np.arange(11) / FPS  # s
SWING = 30 * np.sin(2 * np.pi * AT)  # deg; there and back, to the bit
SWING[-1] = SWING[0]


def point_mesh(point: ArrayLike, target: ArrayLike | None = None) -> Mesh:
    """One vertex, and one morph target that moves it."""
    none = np.empty((1, 0))
    targets = np.empty((0, 1, 3)) if target is None else np.array([[target]], float)
    return Mesh("", np.array([point], float), np.empty((0, 3), int), none.astype(int), none, targets, np.empty(0))


def chain(targets: ArrayLike | None = None) -> Scene:
    """Three joints in a row, 1 m apart, each with a vertex half a metre on; node 3 is a control without any."""
    nodes = skeleton([-1, 0, 1, 0], translation=[[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 5, 0]])
    rows = [
        MeshInstance(n, point_mesh([0.5, 0, 0], targets), None, np.zeros(int(targets is not None))) for n in range(3)
    ]
    return Scene(nodes, tuple(rows))


CHAIN = chain()


def swinging(**ends: float) -> Clip:
    """All joints swing; j0, j1, j2: by how much (deg) each drifts away until the end."""
    tracks = []
    for node in range(3):
        degrees = (1 + 0.1 * node) * SWING + np.linspace(0, ends.get(f"j{node}", 0.0), 11)
        tracks.append(track("rotation", AT, about("z", degrees), node=node))
    return clip(*tracks)

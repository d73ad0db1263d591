"""Nodes that mirror their meshes, against determinants of whole world matrices."""

from __future__ import annotations

import numpy as np
import pytest

from anim.caches.source_document.winding import find_negative_determinants
from anim.gltf.document import Json


@pytest.mark.parametrize("seed", range(3))
def test_mirrored_nodes_have_negative_determinants(seed: int) -> None:
    random = np.random.default_rng(seed)
    parents = [-1, *(int(random.integers(-1, i)) for i in range(1, 60))]
    nodes: list[Json] = []
    world: list[float] = []
    for i, parent in enumerate(parents):
        matrix = np.eye(4)
        if i % 3 == 0:
            matrix[:3, :3] = random.normal(size=(3, 3))
            nodes.append({"matrix": matrix.T.reshape(-1).tolist()})
        else:
            scale = random.choice([-2.0, -1.0, 0.5, 3.0, 0.0], 3, p=[0.2, 0.2, 0.3, 0.29, 0.01])
            matrix[:3, :3] = np.diag(scale)
            nodes.append({"scale": scale.tolist()} if i % 3 == 1 else {"translation": [1, 2, 3]})
            matrix = matrix if i % 3 == 1 else np.eye(4)
        world.append(float(np.linalg.det(matrix)) * (world[parent] if parent >= 0 else 1.0))
    for i, parent in enumerate(parents):
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(i)
    assert find_negative_determinants({"nodes": nodes}).tolist() == [each < 0 for each in world]

"""VertexCache: frames that are in memory fit together."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.errors import ShapeError
from anim.model.vertex_cache import from_arrays

FACES = np.array([[0, 1, 2]])


def test_frames_come_back() -> None:
    positions = np.arange(24.0).reshape(2, 4, 3)
    assert from_arrays(np.arange(2.0), positions, FACES).load_all().positions.tolist() == positions.tolist()


@pytest.mark.parametrize("shape", [(3, 4, 3), (2, 4, 2), (4, 3)])
def test_positions_that_do_not_fit_the_times_are_refused(shape: Any) -> None:
    with pytest.raises(ShapeError, match="positions has shape"):
        from_arrays(np.arange(2.0), np.zeros(shape), FACES)


def test_normals_that_do_not_fit_the_positions_are_refused() -> None:
    with pytest.raises(ShapeError, match="normals has shape"):
        from_arrays(np.arange(2.0), np.zeros((2, 4, 3)), FACES, normals=np.zeros((2, 3, 3)))


@pytest.mark.parametrize("vertex", [-1, 4])
def test_faces_use_vertices_that_are_there(vertex: int) -> None:
    with pytest.raises(ShapeError, match=f"a face uses vertex {vertex} of 4"):
        from_arrays(np.arange(2.0), np.zeros((2, 4, 3)), np.array([[0, vertex, 1]]))

"""Skin, Mesh and Scene: what fits together."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.errors import FormatError, ShapeError
from anim.model import Mesh, MeshInstance, Scene, Skin
from tests.clips import skeleton


def _mesh(**fields: Any) -> Mesh:
    parts = {
        "positions": np.zeros((3, 3)),
        "faces": np.array([[0, 1, 2]]),
        "joints": np.zeros((3, 1), np.int64),
        "weights": np.ones((3, 1)),
        "targets": np.empty((0, 3, 3)),
        "rest_weights": np.empty(0),
    }
    return Mesh("flag", **(parts | fields))


def test_a_scene_counts_its_vertices() -> None:
    mesh = _mesh()
    scene = Scene(skeleton([-1]), (MeshInstance(0, mesh, None, np.empty(0)),) * 2)
    assert scene.vertex_count == 6
    assert Scene(skeleton([]), ()).vertex_count == 0


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(FormatError, match=r"mesh 'flag': a skin weight is negative \(-0.5\)"):
        _mesh(weights=np.array([[1.0], [-0.5], [1.0]]))
    with pytest.raises(FormatError, match=r"mesh 'flag': a face uses vertex 3 \(of 3\)"):
        _mesh(faces=np.array([[0, 1, 3]]))
    with pytest.raises(ShapeError, match="positions"):
        _mesh(positions=np.zeros((3, 2)))
    with pytest.raises(ShapeError, match="1 inverse bind matrices for 2 joints"):
        Skin(np.array([0, 1]), np.zeros((1, 3, 4)))

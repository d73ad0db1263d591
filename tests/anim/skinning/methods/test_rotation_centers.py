"""Optimized centers of rotation against the paper's formula, triangle by triangle."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.reading import reader
from anim.model import Mesh
from anim.skinning.binding import bind_skin
from anim.skinning.methods.rotation_centers import SIMILARITY_WIDTH, find_centers
from tests.anim.skinning.scenes import random_scene
from tests.files import opened_fixture


def plainly(mesh: Mesh, joints: int) -> Floats:
    """Equation 1 with the similarity of equation 4, all vertices with all triangles."""
    dense = np.zeros((len(mesh.positions), joints))
    for v, (held, weights) in enumerate(zip(mesh.joints, mesh.weights, strict=True)):
        np.add.at(dense[v], held, weights)
    result = np.full((len(mesh.positions), 3), np.nan)
    corners = mesh.positions[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    of_faces, middles = dense[mesh.faces].mean(axis=1), corners.mean(axis=1)
    for v, p in enumerate(dense):
        similar = np.zeros(len(areas))
        for j in range(joints):
            for k in range(joints):
                if j != k:
                    tj, tk = of_faces[:, j], of_faces[:, k]
                    similar += p[j] * p[k] * tj * tk * np.exp(-((p[j] * tk - p[k] * tj) ** 2) / SIMILARITY_WIDTH**2)
        total = (similar * areas).sum()
        if total > 0:
            result[v] = (similar * areas) @ middles / total
    return result


def test_centers_are_the_papers() -> None:
    of = random_scene(4, vertices=60)
    mesh = of.instances[0].mesh
    found = find_centers(bind_skin(of.instances[0], of.skeleton.parents))
    wanted = plainly(mesh, 9)
    assert np.array_equal(np.isnan(found), np.isnan(wanted))
    assert np.isnan(found).any()
    assert np.nanmax(np.abs(found - wanted)) < 1e-5


def test_centers_of_a_tube_lie_on_its_axis() -> None:
    """At the height where the triangles that hang alike are: their own ring's, but for the ends."""
    of = reader.scene(opened_fixture("tube"))
    found = find_centers(bind_skin(of.instances[0], of.skeleton.parents))
    heights = of.instances[0].mesh.positions[:, 1]
    between = (heights > 0.2) & (heights < 0.8)
    assert np.abs(found[between][:, [0, 2]]).max() < 1e-6
    assert found[between][:, 1] == pytest.approx(heights[between], abs=0.03)

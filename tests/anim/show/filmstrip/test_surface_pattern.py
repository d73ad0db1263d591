"""Marks on surfaces: shares of corners, squares that stay where they were at rest, edges."""

from __future__ import annotations

import numpy as np
import pytest

from anim.show.filmstrip.camera import fit_camera
from anim.show.filmstrip.surface_pattern import DARK, EDGE, LIGHT, barycentric, checker, edges

RANDOM = np.random.default_rng(7)


def test_shares_give_the_sample_again() -> None:
    corners = RANDOM.uniform(0, 100, (50, 3, 3))
    samples = RANDOM.uniform(0, 100, (50, 2))
    shares = barycentric(corners, samples)
    assert shares.sum(axis=1) == pytest.approx(np.ones(50))
    assert np.einsum("si,sic->sc", shares, corners[..., :2]) == pytest.approx(samples)


def test_squares_are_those_of_the_place_in_space() -> None:
    """A wide triangle that leans away: middles between corners on the screen are not those in space."""
    rest = np.array([[0, 0, 0], [1, 0, -3], [0, 1, 0.0]])
    faces = np.array([[0, 1, 2]])
    camera = fit_camera(rest, height=300)
    shares = RANDOM.dirichlet([1, 1, 1], 400)
    places = shares @ rest
    corners = np.repeat(camera.project(rest)[None], 400, axis=0)
    seen = checker(rest, faces)(corners, camera.project(places)[:, :2], np.zeros(400, int))
    cell = np.sqrt(1 + 1 + 9) / 10
    shifted = (places - (rest.max(axis=0) + rest.min(axis=0)) / 2) / cell
    clear = (np.abs(shifted - np.rint(shifted)) > 1e-6).all(axis=1)
    expected = np.where(np.floor(shifted).sum(axis=1) % 2 == 1, DARK, LIGHT)
    assert (seen == expected)[clear].all()
    assert {DARK, LIGHT} == set(seen.tolist())


def test_edges_are_as_wide_as_they_should_be() -> None:
    corners = np.array([[[0, 0, 1], [100, 0, 1], [0, 100, 1.0]]])
    samples = np.array([[30, 0.3], [30, 2.0], [30, 30], [49.9, 49.9]])
    assert edges(np.repeat(corners, 4, axis=0), samples, np.zeros(4, int)) == pytest.approx([EDGE, 1, 1, EDGE])


def test_edges_of_small_triangles_are_faint() -> None:
    corners = np.array([[[0, 0, 1], [4, 0, 1], [0, 4, 1.0]]])
    assert 0.85 < edges(corners, np.array([[2, 0.1]]), np.zeros(1, int))[0] < 1

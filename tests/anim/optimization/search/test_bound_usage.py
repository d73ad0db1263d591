"""Strains against plain loops: what is shown, point by point and moment by moment."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.optimization.options import Bounds
from anim.optimization.search.bound_usage import MIN_GAP_S, BoundUsage
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.world_matrices import level_world_matrices
from tests.anim.optimization.making import every_point, scene, truth_of, waving

OF = scene()
POINTS = every_point(OF)
RNG = np.random.default_rng(11)
ALLOWED = RNG.uniform(0.5, 2, len(POINTS))


def _changed(truth: SourceMotion) -> list[Floats]:
    """The truth with every moving track a little off."""
    shown = [part.copy() for part in truth.local]
    for each in truth.moving:
        path = ("translation", "rotation", "scale").index(each.path)
        shown[path][each.node] += 0.01 * RNG.normal(size=shown[path][each.node].shape)
    return shown


def _moves(truth: SourceMotion, shown: list[Floats]) -> Floats:
    """How far each point is from where it should be, (P, W, 3)."""
    levels = OF.skeleton.levels()
    return POINTS.places(level_world_matrices(OF.skeleton, shown, levels)) - POINTS.places(
        level_world_matrices(OF.skeleton, truth.local, levels)
    )


def test_the_largest_distance_of_each_point() -> None:
    truth = truth_of(OF, waving(), POINTS)
    shown = _changed(truth)
    expected = np.linalg.norm(_moves(truth, shown), axis=2).max(axis=1) / ALLOWED
    strains = BoundUsage(OF.skeleton, truth, POINTS, ALLOWED, Bounds(0.1, 0.0))
    assert strains.slerp_raw(shown) == pytest.approx(expected, rel=1e-5)
    assert strains.slerp_raw(truth.local).max() == 0


def test_speeds_count_where_they_are_bounded() -> None:
    truth = truth_of(OF, waving(), POINTS)
    shown = _changed(truth)
    moves = _moves(truth, shown)
    gaps = np.maximum(np.diff(truth.at), MIN_GAP_S)
    speeds = np.linalg.norm(np.diff(moves, axis=1), axis=2) / gaps
    expected = np.maximum(np.linalg.norm(moves, axis=2).max(axis=1) / ALLOWED, speeds.max(axis=1) / 0.3)
    strains = BoundUsage(OF.skeleton, truth, POINTS, ALLOWED, Bounds(0.1, 0.0, max_speed_error=0.3))
    assert strains.slerp_raw(shown) == pytest.approx(expected, rel=1e-4)


def test_without_a_bound_on_angles_tracks_have_no_strain_of_their_own() -> None:
    truth = truth_of(OF, waving(), POINTS)
    strains = BoundUsage(OF.skeleton, truth, POINTS, ALLOWED, Bounds(0.1, 0.0))
    assert not strains.own(_changed(truth)).any()

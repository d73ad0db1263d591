"""Strains against plain loops: what is shown, point by point and moment by moment."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.optimization.options import Bounds
from anim.optimization.search import trial
from anim.optimization.search.playback import level_world_matrices
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.search.trial import MIN_INTERVAL_S, BoundUsage
from tests.anim.optimization.making import every_point, scene, truth_of, waving

OF = scene()
POINTS = every_point(OF)
RNG = np.random.default_rng(11)
ALLOWED = RNG.uniform(0.5, 2, len(POINTS))


def _changed(source: SourceMotion) -> list[Floats]:
    """The truth with every moving track a little off."""
    shown = [part.copy() for part in source.local]
    for each in source.moving:
        path = ("translation", "rotation", "scale").index(each.path)
        shown[path][each.node] += 0.01 * RNG.normal(size=shown[path][each.node].shape)
    return shown


def _moves(source: SourceMotion, shown: list[Floats]) -> Floats:
    """How far each point is from where it should be, (P, W, 3)."""
    levels = OF.skeleton.levels()
    return POINTS.places(level_world_matrices(OF.skeleton, shown, levels)) - POINTS.places(
        level_world_matrices(OF.skeleton, source.local, levels)
    )


def test_the_largest_distance_of_each_point() -> None:
    source = truth_of(OF, waving(), POINTS)
    shown = _changed(source)
    expected = np.linalg.norm(_moves(source, shown), axis=2).max(axis=1) / ALLOWED
    usage = BoundUsage(OF.skeleton, source, ALLOWED, Bounds(0.1, 0.0))
    assert usage.slerp_raw(shown) == pytest.approx(expected, rel=1e-5)
    assert usage.slerp_raw(source.local).max() == 0


def test_speeds_count_where_they_are_bounded() -> None:
    source = truth_of(OF, waving(), POINTS)
    shown = _changed(source)
    moves = _moves(source, shown)
    gaps = np.maximum(np.diff(source.at), MIN_INTERVAL_S)
    speeds = np.linalg.norm(np.diff(moves, axis=1), axis=2) / gaps
    expected = np.maximum(np.linalg.norm(moves, axis=2).max(axis=1) / ALLOWED, speeds.max(axis=1) / 0.3)
    usage = BoundUsage(OF.skeleton, source, ALLOWED, Bounds(0.1, 0.0, max_speed_error=0.3))
    assert usage.slerp_raw(shown) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("length", [1, 2, 7])
def test_blocks_of_times_give_the_same(length: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Long clips are measured block by block, so that memory does not follow their length; speeds cross its ends."""
    source = truth_of(OF, waving(), POINTS)
    shown = _changed(source)
    bounds = Bounds(0.1, 0.0, max_speed_error=0.3)
    whole = BoundUsage(OF.skeleton, source, ALLOWED, bounds)
    monkeypatch.setattr(trial, "MAX_BLOCK_MATRICES", length * len(OF.skeleton))
    monkeypatch.setattr(trial, "MIN_BLOCK_TIMES", 1)
    blocks = BoundUsage(OF.skeleton, source, ALLOWED, bounds)
    assert len(trial._time_blocks(len(source.at), len(OF.skeleton))) == -(-len(source.at) // length) > 1
    assert blocks.slerp_raw(shown) == pytest.approx(whole.slerp_raw(shown), rel=1e-4)
    assert blocks.nlerp(shown) == pytest.approx(whole.nlerp(shown), rel=1e-4)


def test_without_a_bound_on_angles_tracks_have_no_strain_of_their_own() -> None:
    source = truth_of(OF, waving(), POINTS)
    usage = BoundUsage(OF.skeleton, source, ALLOWED, Bounds(0.1, 0.0))
    assert not usage.own(_changed(source)).any()

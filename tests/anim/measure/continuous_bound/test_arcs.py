"""Arcs of players against their values: the same quaternions, on both sides of every key."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.continuous_bound.intervals import Intervals, merge_intervals
from anim.measure.continuous_bound.node_tracks import NodeTracks
from anim.measure.continuous_bound.prover import PLAYER_ORDER
from anim.measure.continuous_bound.rotation_endpoints import rotation_endpoints
from anim.measure.error.sample_times import dense_times
from anim.model import Clip, Interpolation, Track
from anim.sampling.lazy_batch import lazy_batches
from anim.sampling.players import PLAYERS, sampler_for
from tests.clips import CUBICSPLINE, LINEAR, STEP, clip, skeleton, track

TIMES = np.array([0.1, 0.2, 0.5, 0.9, 1.0])


def _rotations(mode: Interpolation, seed: int) -> Track:
    """Near and far keys, some equal, of lengths up to 1 % off 1, with signs by chance."""
    random = np.random.default_rng(seed)
    keys = np.cumsum(random.normal(size=(5, 4)) * random.choice([0.001, 0.02, 0.5], size=(5, 1)), axis=0)
    keys += [0, 0, 0, 2]
    keys *= random.choice([-1, 1], size=(5, 1)) * random.uniform(0.99, 1.01, (5, 1))
    keys /= np.linalg.norm(keys, axis=1, keepdims=True) ** random.choice([0.98, 1], size=(5, 1))
    keys[2] = keys[1]
    sides = (random.normal(size=(5, 4)), random.normal(size=(5, 4))) if mode is CUBICSPLINE else None
    return track("rotation", TIMES, keys, mode, tangents=sides)


def test_the_prover_orders_every_player() -> None:
    assert sorted(PLAYER_ORDER) == sorted(PLAYERS)


@pytest.mark.parametrize("mode", [LINEAR, STEP, CUBICSPLINE])
@pytest.mark.parametrize("seed", range(6))
def test_laws_play_as_players_do(mode: Interpolation, seed: int) -> None:
    moving = clip(_rotations(mode, seed))
    times = np.unique(np.concatenate((dense_times(moving), [0.0, 1.2])))
    where = merge_intervals(times, moving)
    players = list(PLAYER_ORDER)
    found = rotation_endpoints([_tracks(moving, where)], players=players)
    length = np.linalg.norm(found.value, axis=1)  # (2, P, L)
    shown = found.value / np.where(found.unit, length, 1.0)[:, None]
    for p, player in enumerate(players):
        poses = sampler_for(skeleton([-1]), moving, player=player)
        for end, at in enumerate((where.starts, np.nextafter(where.ends, 0))):
            expected = poses.at(at).rotation[:, 0]
            assert np.abs(_same_side(shown[end, :, p].T, expected) - expected).max() < 1e-9
        after = np.where(found.next_unit[p], 1.0, length[1, p])
        at_key = np.linalg.norm(poses.at(where.ends).rotation[:, 0], axis=1)
        if mode is LINEAR:  # a step is elsewhere
            assert np.abs(after - at_key).max() < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_within_gaps_the_law_goes_on(seed: int) -> None:
    """Half-way through a gap, by c″ = −ν²c from both ends, divided by its length where it says so."""
    moving = clip(_rotations(LINEAR, seed))
    where = merge_intervals(dense_times(moving), moving)
    players = list(PLAYER_ORDER)
    found = rotation_endpoints([_tracks(moving, where)], players=players)
    middle = (found.value[0] + found.value[1]) / (2 * np.cos(found.turn / 2))
    middle /= np.where(found.unit, np.linalg.norm(middle, axis=0), 1.0)
    for p, player in enumerate(players):
        expected = sampler_for(skeleton([-1]), moving, player=player).at((where.starts + where.ends) / 2).rotation[:, 0]
        assert np.abs(_same_side(middle[:, p].T, expected) - expected).max() < 1e-9


def _tracks(moving: Clip, where: Intervals) -> NodeTracks:
    return NodeTracks(np.zeros(1, int), np.array([[0.0, 0, 0, 1]]), lazy_batches(moving.tracks), where)


def _same_side(found: Floats, expected: Floats) -> Floats:
    return found * np.where((found * expected).sum(axis=1) < 0, -1.0, 1.0)[:, None]

"""Tracks on axes, as stored: what they show is what sampling them shows."""

from __future__ import annotations

import numpy as np
import pytest

from anim.maths import quaternion
from anim.optimization.options import Packing
from anim.optimization.search import candidates as candidates_
from anim.optimization.search.candidates import Candidates
from anim.optimization.search.time_axes import SharedAxis
from anim.sampling.track import sample
from tests.anim.optimization.making import every_point, scene, truth_of, waving
from tests.clips import track

OF = scene()
TRUTH = truth_of(OF, waving(), every_point(OF))
EVERY_THIRD = SharedAxis(np.arange(25) % 3 == 0, (0, 1, 2, 4))
FULL = SharedAxis(np.ones(25, np.bool_), (0, 1, 2, 4))


@pytest.mark.parametrize("packing", list(Packing))
@pytest.mark.parametrize("axis", [EVERY_THIRD, FULL])
def test_shown_is_what_the_stored_track_is_at_each_moment(packing: Packing, axis: SharedAxis) -> None:
    tolerances = [1e-3] * 5
    for i, candidate in Candidates(TRUTH, packing).of(axis, tolerances):
        moving = TRUTH.moving[i]
        assert len(candidate.stored.values) == axis.keys.sum()
        played = track(moving.path, TRUTH.grid[axis.keys], candidate.stored.values, node=0)
        expected = sample(played, TRUTH.at)
        shown = candidate.shown
        if moving.path == "rotation":
            shown = quaternion.normalize(shown)
            assert np.abs(np.linalg.norm(candidate.shown, axis=1) - 1).max() < 5e-5  # as stored, not normalized
            expected = expected * np.sign((expected * shown).sum(axis=1))[:, None]
        assert shown == pytest.approx(expected, abs=1e-5)


def test_a_full_axis_has_the_truth_as_keys() -> None:
    for i, candidate in Candidates(TRUTH, Packing.CORE).of(FULL, [0.0] * 5):
        source = TRUTH.moving[i].values[TRUTH.on_grid]
        assert (candidate.stored.values == source.astype(np.float32)).all()


def test_fitted_keys_are_nearer_than_the_truths_own() -> None:
    """Over all moments, by least squares; the sway of track 0 is what it gains most on."""
    (candidate,) = [each for i, each in Candidates(TRUTH, Packing.CORE).of(EVERY_THIRD, [0.0] * 5) if i == 0]
    source = TRUTH.moving[0].values
    own = track("translation", TRUTH.grid[EVERY_THIRD.keys], source[TRUTH.on_grid[EVERY_THIRD.keys]])
    assert ((candidate.shown - source) ** 2).sum() < 0.7 * ((sample(own, TRUTH.at) - source) ** 2).sum()


def test_what_was_made_is_kept() -> None:
    candidates = Candidates(TRUTH, Packing.EXT)
    first, again = (dict(candidates.of(EVERY_THIRD, [1e-3] * 5)) for _ in range(2))
    finer = dict(candidates.of(EVERY_THIRD, [1e-4] * 5))
    assert all(first[i] is again[i] for i in first)
    assert all(first[i] is not finer[i] for i in first)


def test_chords() -> None:
    candidates = Candidates(TRUTH, Packing.CORE)
    made = dict(candidates.of(EVERY_THIRD, [1e-3] * 5))
    shown = candidates.by_chords(EVERY_THIRD, [made[1].stored, made[2].stored])
    keys, times = made[1].stored.values, TRUTH.grid[EVERY_THIRD.keys]
    mixed = np.transpose([np.interp(TRUTH.at, times, column) for column in quaternion.align_signs(keys).T])
    assert shown[:, 0] == pytest.approx(mixed / np.linalg.norm(mixed, axis=1, keepdims=True), abs=1e-12)
    assert shown.shape == (len(TRUTH.at), 2, 4)


def test_what_is_kept_is_let_go_when_it_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(candidates_, "MAX_CACHED_VALUES", 0)
    candidates = Candidates(TRUTH, Packing.EXT)
    first, again = (dict(candidates.of(EVERY_THIRD, [1e-3] * 5)) for _ in range(2))
    assert all(first[i] is not again[i] for i in first)
    assert all((first[i].shown == again[i].shown).all() for i in first)

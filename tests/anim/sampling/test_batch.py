"""Tracks laid end to end, sampled together: the same as one by one."""

from __future__ import annotations

import numpy as np
import pytest

from anim.sampling import batch as module
from anim.sampling.batch import concatenate
from anim.sampling.track import sample
from tests import clips
from tests.anim.operations.tracks import TRACKS
from tests.clips import CUBICSPLINE

SINGLE = clips.track("translation", [2.0], [[1.0, 2.0, 3.0]])
WEIGHTS = clips.track("weights", [0.0, 1, 2], np.array([[0, 1], [1, 0], [1, 1]]))
ALL = [*TRACKS.values(), SINGLE, WEIGHTS, *TRACKS.values()]


@pytest.mark.parametrize("limit", [1, 5, 4096])
def test_each_track_is_sampled_at_its_own_times_as_it_is_alone(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_GROUP_KEYS", limit)
    rng = np.random.default_rng(3)
    at = np.column_stack((rng.uniform(-1, 4, (len(ALL), 5)), np.full(len(ALL), 1.25)))  # before, after, and on a key
    seen = []
    for group in concatenate(ALL):
        values = group.sample(at[group.numbers])
        for i, number in enumerate(group.numbers.tolist()):
            assert group.tracks[i] is ALL[number]
            np.testing.assert_allclose(values[i], sample(ALL[number], at[number]), rtol=0, atol=1e-15)
            seen.append(number)
    assert sorted(seen) == list(range(len(ALL)))


def test_tracks_lie_one_after_the_other_with_their_tangents() -> None:
    one = clips.track("scale", [0.0, 1], np.ones((2, 3)), CUBICSPLINE, tangents=(np.full((2, 3), 5.0), np.ones((2, 3))))
    other = clips.track("scale", [0.0, 2, 3], np.zeros((3, 3)), CUBICSPLINE, tangents=(np.ones((3, 3)),) * 2)
    (group,) = concatenate([one, other])
    assert group.counts.tolist() == [2, 3]
    assert group.starts.tolist() == [0, 2]
    assert group.times.tolist() == [0, 1, 0, 2, 3]
    assert group.values[:, 0].tolist() == [1, 1, 0, 0, 0]
    assert group.tangents is not None
    assert group.tangents[0][:, 0].tolist() == [5, 5, 1, 1, 1]


def test_no_tracks_are_no_groups() -> None:
    assert concatenate([]) == []

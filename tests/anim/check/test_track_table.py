"""Tables of tracks against loops over their keys."""

from __future__ import annotations

import numpy as np

from anim.check.track_table import track_table
from anim.model import Interpolation, TimeAxis, Track

RNG = np.random.default_rng(7)
CLIPS = (2, 0, 2, 5, 0, 5)


def _track(node: int) -> Track:
    times = np.sort(RNG.choice(20, 7, replace=False)) / 4
    return Track(node, "scale", Interpolation.LINEAR, TimeAxis(times), RNG.normal(size=(7, 3)))


TRACKS = [(clip, _track(node)) for node, clip in enumerate(CLIPS)]


def test_the_first_marked_key_of_each_clip() -> None:
    table = track_table(TRACKS, "scale")
    for fraction in (0.0, 0.1, 0.4, 1.0):
        marked = RNG.random(len(table.values)) < fraction
        keys = [(clip, time, node) for node, (clip, track) in enumerate(TRACKS) for time in track.times.tolist()]
        expected: dict[int, tuple[int, float]] = {}
        for (clip, time, node), is_marked in zip(keys, marked, strict=True):
            if is_marked and (clip not in expected or time < expected[clip][1]):
                expected[clip] = node, time
        assert table.first_keys(marked) == expected


def test_sums_of_each_clip_in_the_order_of_tracks() -> None:
    table = track_table(TRACKS, "scale")
    assert list(table.per_clip(np.array([1, 0, 4, 2, 0, 3]))) == [(2, 5), (5, 5)]
    assert list(table.per_clip(np.array([0, 3, 0, 1, 1, 0]))) == [(0, 4), (5, 1)]


def test_a_table_without_tracks() -> None:
    table = track_table([], "rotation")
    assert table.values.shape == (0, 4)
    assert table.first_keys(np.zeros(0, np.bool_)) == {}
    assert not list(table.per_clip(np.zeros(0, np.int64)))

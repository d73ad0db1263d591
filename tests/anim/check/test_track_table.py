"""Tables of tracks against loops over their keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from anim.check.track_table import TrackTable, add_counts, keep_earliest, track_table, track_tables
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
    sums: dict[int, int] = {}
    add_counts(sums, table, np.array([1, 0, 4, 2, 0, 3]))
    assert list(sums.items()) == [(2, 5), (5, 5)]
    add_counts(sums, table, np.array([0, 3, 0, 1, 1, 0]))
    assert list(sums.items()) == [(2, 5), (5, 6), (0, 4)]


def test_a_table_without_tracks() -> None:
    table = track_table([], "rotation")
    assert table.values.shape == (0, 4)
    assert table.first_keys(np.zeros(0, np.bool_)) == {}
    sums: dict[int, int] = {}
    add_counts(sums, table, np.zeros(0, np.int64))
    assert not sums
    assert not list(track_tables([], "rotation"))


def test_tracks_that_share_their_keys_have_them_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("anim.check.track_table.MAX_BLOCK_KEYS", 10)
    clips = [(clip, track.on_node(node)) for clip, node in ((0, 3), (1, 4), (1, 5)) for _, track in TRACKS[:2]]
    shared, own = track_table(clips, "scale"), track_table([(clip, _copy(track)) for clip, track in clips], "scale")
    assert (len(shared.values), len(own.values)) == (14, 42)
    bounds = [table.range() for table in (shared, own)]
    np.testing.assert_array_equal(bounds[0], bounds[1])
    marks = [table.inner_steps() & (table.values > 0.5).any(axis=1) for table in (shared, own)]
    np.testing.assert_array_equal(shared.count_marked(marks[0]), own.count_marked(marks[1]))
    assert shared.first_keys(marks[0]) == own.first_keys(marks[1])


def test_tables_of_some_tracks_find_what_one_of_all_does(monkeypatch: pytest.MonkeyPatch) -> None:
    tracks = [*TRACKS, *((clip + 1, track.on_node(9)) for clip, track in TRACKS)]
    monkeypatch.setattr("anim.check.track_table.MAX_BLOCK_KEYS", 20)
    tables = list(track_tables(tracks, "scale"))
    assert [len(table.counts) for table in tables] == [2, 2, 2, 2, 2, 2]
    for limit in (-1.0, 0.9, 5.0):
        found = [_found(some, limit) for some in (tables, [track_table(tracks, "scale")])]
        assert found[0] == found[1]


def _found(tables: Sequence[TrackTable], limit: float) -> tuple[list[tuple[int, int]], dict[int, tuple[int, float]]]:
    sums: dict[int, int] = {}
    first: dict[int, tuple[int, float]] = {}
    for table in tables:
        marked = np.asarray((table.values > limit).all(axis=1))
        add_counts(sums, table, table.count_marked(marked))
        keep_earliest(first, table, marked)
    return list(sums.items()), first


def _copy(track: Track) -> Track:
    return replace(track, values=track.values.copy())

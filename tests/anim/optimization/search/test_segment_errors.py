"""The fewest keys, against every choice of keys and against plain lines."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import greedy_keys
from anim.optimization.search import fewest_keys, segment_errors
from anim.optimization.search.segment_errors import SPAN_RANGE, SegmentErrors, fits
from tests.anim.optimization.search.stacks import table_of


def _missed(values: Floats, times: Floats, keep: Bools) -> float:
    """How far lines between the kept keys are off, at most."""
    lines = [np.interp(times, times[keep], column[keep]) for column in values.T]
    return float(np.linalg.norm(np.transpose(lines) - values, axis=1).max())


def _random(seed: int, count: int, tracks: int = 4) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal(size=(tracks, count, 3)), axis=1), np.cumsum(rng.uniform(0.1, 1, count))


def _keys(table: SegmentErrors, tracks: Ints, budgets: Floats) -> Bools:
    """The keys (k, K) of some tracks of one table."""
    (keep,) = fewest_keys.greedy_keys([(table, tracks, budgets)])
    return keep


def _chosen(count: int, inner: tuple[int, ...]) -> Bools:
    keep = np.zeros(count, np.bool_)
    keep[[0, *inner, -1]] = True
    return keep


@given(st.integers(0, 2**32 - 1), st.integers(2, 70), st.floats(0.1, 10))
def test_lines_between_kept_keys_keep_each_tracks_budget(seed: int, count: int, budget: float) -> None:
    values, times = _random(seed, count)
    budgets = budget * np.array([1.0, 0.5, 2, 0.01])
    keep = _keys(table_of(values, times, np.inf), np.arange(4), budgets)
    assert keep[:, [0, -1]].all()
    for track in range(4):
        assert _missed(values[track], times, keep[track]) <= budgets[track] * (1 + 1e-5)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_no_choice_of_fewer_keys_does(seed: int) -> None:
    """Tried are all of them."""
    values, times = _random(seed, 9)
    keep = _keys(table_of(values, times, np.inf), np.arange(4), np.full(4, 1.5))
    for track in range(4):
        count = int(keep[track].sum())
        fewer = (_chosen(9, inner) for inner in combinations(range(1, 8), max(count - 3, 0)))
        assert count == 2 or all(_missed(values[track], times, each) > 1.5 for each in fewer)


def test_among_the_fewest_the_one_that_misses_least() -> None:
    """A bow in two lines: the middle key misses least."""
    times = np.linspace(0, 1, 11)
    bow = (times**2)[None, :, None]
    keep = _keys(table_of(bow, times, np.inf), np.array([0]), np.array([0.08]))
    assert np.flatnonzero(keep[0]).tolist() == [0, 5, 10]


def test_some_tracks_of_many() -> None:
    values, times = _random(3, 40)
    table = table_of(values, times, np.inf)
    every = _keys(table, np.arange(4), np.array([1.0, 2, 3, 4]))
    some = _keys(table, np.array([3, 1]), np.array([4.0, 2]))
    assert (some == every[[3, 1]]).all()


def test_never_more_keys_than_greedy_ones() -> None:
    values, times = _random(5, 60, tracks=30)
    fewest = _keys(table_of(values, times, np.inf), np.arange(30), np.full(30, 2.0)).sum(axis=1)
    greedy = greedy_keys(values / 2.0, times).sum(axis=1)
    assert (fewest <= greedy).all()
    assert fewest.sum() < greedy.sum()


def test_long_lines_have_a_key_now_and_then() -> None:
    times = np.arange(300.0)
    keep = _keys(table_of(times[None, :, None] * np.ones(3), times, np.inf), np.array([0]), np.array([1e-3]))
    at = np.flatnonzero(keep[0])
    assert np.diff(at).max() <= SPAN_RANGE[0]
    assert len(at) == 2 + (299 - 1) // SPAN_RANGE[0]


def test_parts_of_long_tracks_are_searched_by_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fewest_keys, "KEYS_PER_PART", 200)
    count = 500
    values, times = _random(4, count, tracks=2)
    budgets = np.array([1.0, 3])
    keep = _keys(table_of(values, times, 4.0), np.arange(2), budgets)
    monkeypatch.setattr(fewest_keys, "MAX_JOINT_TABLE_VALUES", 1)
    assert (_keys(table_of(values, times, 4.0), np.arange(2), budgets) == keep).all()
    for start in range(0, count - 1, 200):
        part = slice(start, start + 201)
        alone = _keys(table_of(values[:, part], times[part], 4.0), np.arange(2), budgets)
        assert keep[:, part][:, [0, -1]].all()
        assert (alone == keep[:, part]).all()


@pytest.mark.parametrize("count", [1, 2])
def test_one_and_two_keys_stay(count: int) -> None:
    values, times = _random(1, count)
    assert _keys(table_of(values, times, np.inf), np.arange(4), np.full(4, 1e9)).all()


def test_tables_are_kept_within_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    assert fits(100, np.arange(2000) / 30)
    assert not fits(2000, np.arange(20_000) / 30)
    assert not fits(400, np.arange(2000) / 240)
    monkeypatch.setattr(segment_errors, "MAX_TABLE_VALUES", 10)
    assert not fits(2, np.arange(4.0))


def test_segments_beyond_the_limit_are_not_looked_at() -> None:
    """Budgets within it lead to the same keys; a noisy track has no long segments, a straight one has all of them."""
    values, times = _random(8, 40)
    values[3] = times[:, None] * np.ones(3)
    whole, limited = table_of(values, times, np.inf), table_of(values, times, 2.0)
    budgets = np.full(4, 1.9)
    expected = _keys(whole, np.arange(4), budgets)
    assert (_keys(limited, np.arange(4), budgets) == expected).mean() > 0.98
    assert _keys(limited, np.arange(4), budgets)[3].sum() == 3  # 40 keys are more than one segment spans
    for track in range(4):
        keep = _keys(limited, np.array([track]), np.array([10.0]))[0]
        assert _missed(values[track], times, keep) <= 10


def test_a_limit_keeps_the_keys_of_budgets_below_it() -> None:
    values, times = _random(5, 300)
    budgets = np.array([0.5, 1, 0.01, 1e-6])
    tables = [table_of(values, times, limit) for limit in (np.inf, 1.0, 1e-6)]
    whole, limited = (_keys(each, np.arange(4), budgets) for each in tables[:2])
    np.testing.assert_array_equal(limited, whole)
    assert _keys(tables[2], np.arange(4), np.full(4, 1e-6)).all()
    assert [each._errors.shape[2] for each in tables][2] == 2, "errors of longer segments are not kept in memory"


@given(st.integers(0, 2**32 - 1), st.integers(2, 60), st.floats(0.1, 10))
def test_keys_of_a_group_keep_the_budget_of_each_of_its_tracks(seed: int, count: int, budget: float) -> None:
    values, times = _random(seed, count)
    budgets = budget * np.array([0.5, 2, 1.0, 0.7])
    table, groups = table_of(values, times, np.inf), [np.array([1, 3]), np.array([2]), np.array([0])]
    order = np.concatenate(groups)
    (keep,) = fewest_keys.shared_keys([(table, groups, budgets[order])])
    for mask, group in zip(keep, groups, strict=True):
        for track in group.tolist():
            assert _missed(values[track], times, mask) <= budgets[track] * (1 + 1e-5)
    np.testing.assert_array_equal(keep[1:], _keys(table, order[2:], budgets[order[2:]]))


@given(st.integers(0, 2**32 - 1), st.integers(2, 60))
def test_each_key_reaches_as_far_as_all_shorter_lines_keep_the_budget(seed: int, count: int) -> None:
    values, times = _random(seed, count, tracks=2)
    tracks, budgets = np.array([1, 0]), np.array([2.0, 0.8])
    reach = table_of(values, times, np.inf).reach(tracks, budgets)
    for row, track, budget in zip(reach, tracks.tolist(), budgets.tolist(), strict=True):
        for start in range(count - 1):
            end = start + 1
            while end + 1 < min(count, start + 1 + SPAN_RANGE[0]) and _is_within(
                values[track, start : end + 2], times[start : end + 2], budget
            ):
                end += 1
            assert row[start] == end or row[start] > start + SPAN_RANGE[0] - 2
    assert (reach[:, -1] == count - 1).all()


def _is_within(values: Floats, times: Floats, budget: float) -> bool:
    return _missed(values, times, _chosen(len(values), ())) <= budget

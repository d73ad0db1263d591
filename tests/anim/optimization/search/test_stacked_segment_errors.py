"""Tables of several clips searched together: the keys of each are those that it has by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.arrays import Bools, Floats, Ints
from anim.optimization.search import fewest_keys, segment_errors
from anim.optimization.search.segment_errors import SegmentErrors, Tabulated, tabulate
from tests.anim.optimization.search.stacks import table_of
from tests.calls import count_calls

SHAPES = ((4, 40), (1, 130), (7, 12), (2, 95), (3, 2), (1, 1))  # tracks and keys of each table


def _asked() -> list[tuple[SegmentErrors, Ints, Floats]]:
    """Tables of all lengths and spans, each asked for some of its tracks, in any order."""
    rng = np.random.default_rng(12)
    asked = []
    for tracks, count in SHAPES:
        values = np.cumsum(rng.normal(size=(tracks, count, 3)), axis=1)
        table = table_of(values, np.cumsum(rng.uniform(0.01, 0.1, count)), np.inf)
        some = rng.permutation(tracks)[: max(tracks - 1, 1)]
        asked.append((table, some, rng.uniform(0.3, 6, len(some))))
    return asked


def _tabulated() -> list[Tabulated]:
    """Tracks of all lengths, some noisy, some with long segments within the limit of their clip."""
    rng = np.random.default_rng(3)
    asked = []
    for number, (tracks, count) in enumerate((*SHAPES, (0, 9))):
        noise = rng.choice([0.0, 0.01, 1.0], size=(tracks, 1, 1)) * rng.normal(size=(tracks, count, 3))
        times = np.cumsum(rng.uniform(0.01, 0.1, count))
        asked.append(Tabulated(times[:, None] * np.ones(3) + noise, times, (np.inf, 0.05, 1e-3)[number % 3]))
    return asked


@pytest.mark.parametrize("values", [1, 400, segment_errors.MAX_STACKED_VALUES])
def test_errors_of_tracks_do_not_depend_on_those_beside(values: int, monkeypatch: pytest.MonkeyPatch) -> None:
    alone = [tabulate([each])[0] for each in _tabulated()]
    monkeypatch.setattr(segment_errors, "MAX_STACKED_VALUES", values)
    for one, other in zip(tabulate(_tabulated()), alone, strict=True):
        budgets = np.ones(len(one._errors))
        found, expected = (each.costs(np.arange(len(budgets)), budgets) for each in (one, other))
        np.testing.assert_array_equal(found, expected)
    assert len({each.span for each in alone}) > 4


def test_errors_are_those_of_interpolation() -> None:
    for values, times, limit in _tabulated()[::3]:
        assert limit == np.inf
        table = table_of(values, times, limit)
        for track, value in enumerate(values):
            for end in range(1, len(times)):
                for n in range(1, min(table.span, end) + 1):
                    some = slice(end - n, end + 1)
                    line = np.stack([np.interp(times[some], times[[end - n, end]], c[[end - n, end]]) for c in value.T])
                    expected = np.linalg.norm(line.T - value[some], axis=1).max()
                    assert table._errors[track, end, n - 1] == pytest.approx(expected, rel=1e-5, abs=1e-6)


def _plain(table: SegmentErrors, tracks: Ints, budgets: Floats) -> Bools:
    """The cheapest keys (k, K), by a loop over all segments of each track."""
    costs = table.costs(tracks, budgets)  # (K, k, span)
    keep = np.zeros((len(tracks), len(costs)), np.bool_)
    for track, kept in enumerate(keep):
        paths: list[tuple[Any, tuple[int, ...]]] = [(np.float32(0), (0,))]
        for end in range(1, len(costs)):
            steps = range(1, min(costs.shape[2], end) + 1)
            paths.append(
                min(
                    ((paths[end - n][0] + costs[end, track, n - 1], (*paths[end - n][1], end)) for n in steps),
                    key=lambda path: path[0],
                )
            )
        kept[list(paths[-1][1])] = True
    return keep


def test_keys_are_those_of_a_plain_loop() -> None:
    for asked, keys in zip(_asked(), fewest_keys.greedy_keys(_asked()), strict=True):
        np.testing.assert_array_equal(keys, _plain(*asked))


@pytest.mark.parametrize(("values", "calls"), [(1, len(SHAPES)), (20000, 3), (fewest_keys.MAX_JOINT_TABLE_VALUES, 1)])
def test_tables_together_have_the_keys_of_each_alone(values: int, calls: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also in parts, where all together would take too much memory."""
    asked = _asked()
    alone = [fewest_keys.greedy_keys([each])[0] for each in asked]
    assert len({keys.sum() for keys in alone}) > 3
    monkeypatch.setattr(fewest_keys, "MAX_JOINT_TABLE_VALUES", values)
    counted = count_calls(monkeypatch, fewest_keys, "_stacked_keys")
    together = fewest_keys.greedy_keys(asked)
    assert len(counted) == calls
    for some, keys in zip(together, alone, strict=True):
        np.testing.assert_array_equal(some, keys)


@pytest.mark.parametrize("length", [10, 50, 100])
def test_long_tracks_are_in_the_same_parts_alone_and_together(length: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fewest_keys, "KEYS_PER_PART", length)
    asked = _asked()
    alone = [fewest_keys.greedy_keys([each])[0] for each in asked]
    assert all(keys[:, ::length].all() for keys in alone if keys.shape[1] > length)
    for some, keys in zip(fewest_keys.greedy_keys(asked), alone, strict=True):
        np.testing.assert_array_equal(some, keys)


def test_nothing_is_asked() -> None:
    assert fewest_keys.greedy_keys([]) == []

"""Tables of several clips searched together: the keys of each are those that it has by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from anim.arrays import Bools, Floats, Ints
from anim.optimization.search import segment_errors
from anim.optimization.search.segment_errors import SegmentErrors, greedy_keys
from tests.calls import count_calls

SHAPES = ((4, 40), (1, 130), (7, 12), (2, 95), (3, 2), (1, 1))  # tracks and keys of each table


def _asked() -> list[tuple[SegmentErrors, Ints, Floats]]:
    """Tables of all lengths and spans, each asked for some of its tracks, in any order."""
    rng = np.random.default_rng(12)
    asked = []
    for tracks, count in SHAPES:
        values = np.cumsum(rng.normal(size=(tracks, count, 3)), axis=1)
        table = SegmentErrors(values, np.cumsum(rng.uniform(0.01, 0.1, count)), np.inf)
        some = rng.permutation(tracks)[: max(tracks - 1, 1)]
        asked.append((table, some, rng.uniform(0.3, 6, len(some))))
    return asked


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
    for asked, keys in zip(_asked(), greedy_keys(_asked()), strict=True):
        np.testing.assert_array_equal(keys, _plain(*asked))


@pytest.mark.parametrize(
    ("values", "calls"), [(1, len(SHAPES)), (20000, 3), (segment_errors.MAX_JOINT_TABLE_VALUES, 1)]
)
def test_tables_together_have_the_keys_of_each_alone(values: int, calls: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also in parts, where all together would take too much memory."""
    asked = _asked()
    alone = [greedy_keys([each])[0] for each in asked]
    assert len({keys.sum() for keys in alone}) > 3
    monkeypatch.setattr(segment_errors, "MAX_JOINT_TABLE_VALUES", values)
    counted = count_calls(monkeypatch, segment_errors, "_stacked_keys")
    together = greedy_keys(asked)
    assert len(counted) == calls
    for some, keys in zip(together, alone, strict=True):
        np.testing.assert_array_equal(some, keys)


@pytest.mark.parametrize("length", [10, 50, 100])
def test_long_tracks_are_in_the_same_parts_alone_and_together(length: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(segment_errors, "KEYS_PER_PART", length)
    asked = _asked()
    alone = [greedy_keys([each])[0] for each in asked]
    assert all(keys[:, ::length].all() for keys in alone if keys.shape[1] > length)
    for some, keys in zip(greedy_keys(asked), alone, strict=True):
        np.testing.assert_array_equal(some, keys)


def test_nothing_is_asked() -> None:
    assert greedy_keys([]) == []

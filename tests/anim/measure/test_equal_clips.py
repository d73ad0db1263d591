"""Clips with equal tracks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.measure.equal_clips import first_equal, repeat_change, track_digests
from anim.model import AccessorFormat, Clip, Track
from tests.clips import CUBICSPLINE, STEP, clip, track

TRACK = track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
ZEROS = np.zeros((2, 3))
CUBIC = track("translation", [0, 1], ZEROS, CUBICSPLINE, tangents=(ZEROS, ZEROS))
BENT = track("translation", [0, 1], ZEROS, CUBICSPLINE, tangents=(ZEROS, ZEROS + 1))


def _clips(*tracks: Track) -> list[tuple[Clip, ...]]:
    return [(clip(each, name=f"c{i}"),) for i, each in enumerate(tracks)]


def test_names_and_objects_do_not_count() -> None:
    copy = track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    assert first_equal(_clips(TRACK, BENT, copy, BENT)) == [0, 1, 0, 1]
    assert first_equal([]) == []
    assert first_equal([(clip(name="a"),), (clip(name="b"),)]) == [0, 0]


@pytest.mark.parametrize(
    "other",
    [
        track("translation", [0, 2], [[0, 0, 0], [1, 0, 0]]),
        track("translation", [0, 1], [[0, 0, 0.0], [1, 1e-9, 0]]),
        track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]], STEP),
        track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]], node=1),
        track("scale", [0, 1], [[0, 0, 0], [1, 0, 0]]),
        replace(TRACK, storage=AccessorFormat(5120, True)),
    ],
    ids=["time", "value", "interpolation", "node", "path", "storage"],
)
def test_whatever_moves_or_is_stored_counts(other: Track) -> None:
    assert first_equal(_clips(TRACK, other)) == [0, 1]


def test_tangents_count() -> None:
    assert first_equal(_clips(CUBIC, BENT, CUBIC)) == [0, 1, 0]


def test_every_clip_of_an_item_counts() -> None:
    (one,), (other,) = _clips(TRACK, BENT)
    assert first_equal([(one, one), (one, other), (one, one), (other, one)]) == [0, 1, 0, 3]


def test_keys_do_not_run_into_those_of_the_next_track() -> None:
    """Two tracks of one and three keys against two of two each, with the same numbers in a row."""
    ones = np.ones((4, 1))
    sizes = [(1, 3), (2, 2)]
    items = [
        (clip(*(track(f"/a/{i}", range(n), ones[:n]) for i, n in enumerate(size)), name=str(size)),) for size in sizes
    ]
    assert track_digests(items[0][0]) != track_digests(items[1][0])


def test_a_change_is_repeated_under_the_own_name() -> None:
    old, same, new = (clip(each, name=name) for each, name in ((TRACK, "a"), (replace(TRACK), "b"), (BENT, "a")))
    assert repeat_change(same, old, new) == replace(new, name="b")
    assert repeat_change(same, old, old) is same


def test_signs_of_zeros_count() -> None:
    """They are kept in files, so that equal tracks can stand for each other."""
    other = replace(TRACK, values=-np.zeros((2, 3)))
    assert first_equal(_clips(replace(TRACK, values=np.zeros((2, 3))), other)) == [0, 1]

"""Clip: its span, and one track for each property."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from typing import Any

import pytest

from anim.errors import FormatError, ShapeError
from anim.model import Clip
from tests.clips import clip, track


def test_start_and_end_are_those_of_the_widest_tracks() -> None:
    walk = clip(track("scale", [0.5, 1], [[1, 1, 1]] * 2), track("translation", [0.25, 0.75], [[0, 0, 0]] * 2))
    assert (walk.start, walk.end) == (0.25, 1.0)
    assert (clip().start, clip().end) == (0.0, 0.0)


def test_a_property_has_one_track() -> None:
    one, other = track("scale", [0], [[1, 1, 1]]), track("scale", [1], [[2, 2, 2]])
    with pytest.raises(FormatError, match=r"clip 'walk': two tracks .*0.*scale"):
        clip(one, other, name="walk")
    clip(one, track("scale", [1], [[2, 2, 2]], node=1), track("translation", [1], [[2, 2, 2]]))


def test_a_pointer_may_have_two_since_real_files_do() -> None:
    one = track("/materials/0/alphaCutoff", [0], [[1]])
    assert len(clip(one, one).tracks) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((None, ()), "name is None .expected text, empty for none"),
        ((5, ()), "name is 5 "),
        (("walk", track("scale", [0], [[1, 1, 1]])), "tracks is Track .expected a sequence of Track"),
        (("walk", ["hip"]), "tracks hold str "),
    ],
)
def test_what_is_no_clip_is_refused(arguments: Any, message: str) -> None:
    with pytest.raises(ShapeError, match=message):
        Clip(*arguments)


def test_tracks_become_a_tuple() -> None:
    one = track("scale", [0], [[1, 1, 1]])
    assert Clip("walk", [one]).tracks == (one,)  # type: ignore[arg-type]


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda value: pickle.loads(pickle.dumps(value))])
def test_copies_are_equal_and_read_only(copied: Any) -> None:
    walk = clip(track("scale", [0, 1], [[1, 1, 1]] * 2), name="walk")
    found = copied(walk)
    assert found == walk
    assert not found.tracks[0].values.flags.writeable
    assert not found.tracks[0].times.flags.writeable


def test_time_axes_are_found_once() -> None:
    """Operations ask for the end of the clip at every track: a search over all tracks each time would be quadratic."""
    found = clip(track("rotation", [0, 1], [[0, 0, 0, 1]] * 2, node=1))
    assert found.time_axes is found.time_axes
    assert Clip("", ()).time_axes == ()
    assert replace(found, tracks=()).time_axes == ()
    assert pickle.loads(pickle.dumps(found)) == found

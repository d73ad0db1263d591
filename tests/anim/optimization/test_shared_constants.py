"""What clips have in common: properties that never leave rest, and values at which they are held."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import Clip
from anim.optimization.shared_constants import Constants, find_constants
from tests.anim.optimization.making import TIMES, scene, setting_of, turning
from tests.clips import CUBICSPLINE, about, clip, track

OF = scene()


def _known(*clips: Clip, max_error: float = 1e-3) -> Constants:
    return find_constants(setting_of(OF, clips, max_error=max_error), clips)


def _held(path: str, value: object, node: int = 2) -> Clip:
    return clip(track(path, [0, 1], np.tile(np.asarray(value, float), (2, 1)), node=node))


def test_unused_is_what_no_clip_moves_from_rest() -> None:
    rest = OF.skeleton.rotation[2]
    still, turned = _held("rotation", rest), clip(track("rotation", TIMES, turning(1.0), node=2))
    assert _known(still, _held("rotation", -rest)).unused == {(2, "rotation")}
    assert _known(still, turned).unused == frozenset()
    assert _known(still).values.get((2, "rotation"), ()) == ()
    assert (3, "rotation") not in _known(still).unused  # no clip drives it: there is nothing to drop


def test_nearly_rest_is_judged_in_meters() -> None:
    nearly = _held("translation", OF.skeleton.translation[2] + [0.003, 0, 0])
    assert _known(nearly, max_error=1e-3).unused == frozenset()
    assert _known(nearly, max_error=1e-2).unused == {(2, "translation")}


def test_values_that_most_clips_hold_come_first() -> None:
    few, many = about("x", 50), about("y", 70)
    clips = [_held("rotation", few), _held("rotation", many), _held("rotation", -many), _held("rotation", many)]
    values = _known(*clips).values[2, "rotation"]
    assert np.abs(values[0] @ many) == pytest.approx(1)
    assert np.abs(values[1] @ few) == pytest.approx(1)
    assert len(values) == 2


def test_a_moving_track_is_no_constant() -> None:
    found = _known(clip(track("rotation", TIMES, turning(1.0), node=2)))
    assert found.values.get((2, "rotation"), ()) == ()


def test_a_spline_that_moves_between_equal_keys_is_no_constant_and_not_unused() -> None:
    rest = np.tile(OF.skeleton.translation[2], (2, 1))
    slopes = np.array([[0, 0, 0], [1.0, 0, 0]])
    waving = clip(track("translation", [0, 1], rest, CUBICSPLINE, tangents=(slopes, slopes), node=2))
    found = _known(waving)
    assert found.unused == frozenset()
    assert found.values.get((2, "translation"), ()) == ()


def test_pointers_and_weights_have_no_part_in_it() -> None:
    found = _known(clip(track("/materials/0/alphaCutoff", [0], [[1]]), track("weights", [0], [[1]], node=5)))
    assert (found.unused, found.values) == (frozenset(), {})


def test_tracks_at_rest_are_found_for_all_clips(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same with few keys a call; q and −q are one rotation, and a spline can move between equal keys."""
    rest, place = OF.skeleton.rotation[2], OF.skeleton.translation[2]
    slopes = np.array([[0, 0, 0], [1.0, 0, 0]])
    waving = track("translation", [0, 1], np.tile(place, (2, 1)), CUBICSPLINE, tangents=(slopes, slopes), node=2)
    clips = [
        _held("rotation", -rest),
        clip(),
        clip(track("weights", [0], [[0]], node=5), track("translation", [0], [place + 0.1], node=2)),
        clip(waving, track("rotation", [0], [rest], node=1)),
    ]
    found = _known(*clips)
    rotation = np.allclose(OF.skeleton.rotation[1], rest)
    expected = [(True,), (), (False, False), (False, rotation)]
    assert [found.at_rest(i, 1e-3) for i in range(4)] == expected
    monkeypatch.setattr("anim.optimization.shared_constants.MAX_STACKED_KEYS", 1)
    again = _known(*clips)
    assert all(np.array_equal(a, b) for a, b in zip(found.from_rest, again.from_rest, strict=True))

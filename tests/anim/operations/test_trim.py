"""A trimmed clip shows what the whole one shows, with exact ends."""

from __future__ import annotations

import numpy as np
import pytest

from anim.errors import RangeError
from anim.model import Clip, Interpolation, Track
from anim.operations.retime import shift_time
from anim.operations.trim import trim
from anim.sampling.derivatives import rates
from anim.sampling.track import sample
from tests.anim.operations.tracks import ANCHOR, KEYS, TRACKS, distance

START, END = 0.3125, 2.625  # exact in float32, to which bounds are rounded
INSIDE = np.linspace(START, END, 997)


def cut(track: Track, **options: float) -> Track:
    return trim(Clip("", (track, ANCHOR)), **{"start": START, "end": END, **options}).tracks[0]  # type: ignore[arg-type]


@pytest.mark.parametrize("track", TRACKS.values(), ids=TRACKS)
def test_shows_the_same_inside(track: Track) -> None:
    near = np.radians(0.001) * 1.01 if track.path == "rotation" else 1e-12
    assert distance(track, sample(cut(track), INSIDE), sample(track, INSIDE)) <= near


@pytest.mark.parametrize("track", TRACKS.values(), ids=TRACKS)
def test_rebased_starts_at_0(track: Track) -> None:
    new = trim(Clip("", (track, ANCHOR)), start=START, end=END, rebase=True)
    assert new.start == 0
    assert new.end == pytest.approx(END - START, abs=1e-15)


@pytest.mark.parametrize("key", ["cubic", "turning"])
def test_ends_are_exact_in_value_and_rate(key: str) -> None:
    track, new = TRACKS[key], cut(TRACKS[key])
    ends = np.array([START, END])
    assert distance(track, sample(new, ends), sample(track, ends)) < 1e-12
    for side, before in ((0, False), (1, True)):
        got = rates(new, ends[side : side + 1], before=before)
        np.testing.assert_allclose(got, rates(track, ends[side : side + 1], before=before), atol=1e-9)


@pytest.mark.parametrize("key", ["cubic", "turning", "flipped", "long arc"])
def test_inner_keys_stay_to_the_bit(key: str) -> None:
    """The signs of quaternions too: a spline between q and −q takes the long arc."""
    new = cut(TRACKS[key])
    at = np.searchsorted(new.times, KEYS[1:3])
    np.testing.assert_array_equal(new.values[at], TRACKS[key].values[1:3])


def test_a_held_part_is_one_key() -> None:
    assert len(trim(Clip("", (ANCHOR, TRACKS["short"])), start=1.5, end=2.5).tracks[1].times) == 1


def test_by_hand() -> None:
    new = trim(Clip("", (TRACKS["linear"],)), start=0.25).tracks[0]
    np.testing.assert_allclose(new.values[0], TRACKS["linear"].values[:2].mean(axis=0))


def test_a_bound_at_a_key_as_float32_holds_it_is_that_key() -> None:
    times = np.array([0, 0.3, 0.7, 1]).astype(np.float32).astype(np.float64)
    track = Track(0, "translation", TRACKS["linear"].interpolation, times, TRACKS["linear"].values)
    new = trim(Clip("", (track,)), start=0.3, end=0.7).tracks[0]
    np.testing.assert_array_equal(new.times, times[1:3])


def test_a_clip_of_one_moment_stays() -> None:
    still = Clip("", (Track(0, "scale", ANCHOR.interpolation, np.zeros(1), np.ones((1, 3))),))
    assert trim(still, start=0.1, end=0.2) is still


def test_nothing_left_is_refused() -> None:
    with pytest.raises(RangeError, match="start 4 s is at or after the clip's end"):
        cut(TRACKS["linear"], start=4.0, end=5.0)


@pytest.mark.parametrize("track", TRACKS.values(), ids=TRACKS)
def test_rebase_alone_moves_all_keys_and_cuts_none(track: Track) -> None:
    late = np.float64(np.float32(1 / 24))
    clip = Clip("", (shift_time(track, late), shift_time(ANCHOR, late)))
    new = trim(clip, rebase=True)
    assert new.start == 0
    np.testing.assert_allclose(new.tracks[0].times, track.times, atol=1e-15)
    np.testing.assert_array_equal(new.tracks[0].values, track.values)


def test_rebase_moves_a_clip_of_one_moment_too() -> None:
    still = Clip("", (Track(0, "scale", ANCHOR.interpolation, np.full(1, 0.5), np.ones((1, 3))),))
    assert trim(still, rebase=True).end == 0


def test_rebase_leaves_what_starts_at_0() -> None:
    clip = Clip("", (TRACKS["short"], ANCHOR))
    assert trim(clip, rebase=True) is clip


@pytest.mark.parametrize("interpolation", [Interpolation.STEP, Interpolation.LINEAR, Interpolation.CUBICSPLINE])
def test_constant_clip_keeps_the_duration_asked_for(interpolation: Interpolation) -> None:
    flat = np.zeros((2, 3)) if interpolation is Interpolation.CUBICSPLINE else None
    poses = [
        Track(node, "translation", interpolation, [0.0, 2.0], np.ones((2, 3)), in_tangents=flat, out_tangents=flat)
        for node in (0, 1)
    ]
    new = trim(Clip("", tuple(poses)), start=0.25, end=0.75)
    assert (new.start, new.end) == (0.25, 0.75)
    assert [len(track.times) for track in new.tracks] == [2, 1]
    assert np.array_equal(new.tracks[0].values, np.ones((2, 3)))

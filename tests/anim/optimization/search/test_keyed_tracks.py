"""Tracks on axes, as stored: what they show is what sampling them shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from anim.arrays import Bools, Floats, Ints
from anim.maths import quaternion
from anim.optimization.options import Packing
from anim.optimization.search import keyed_tracks, playback
from anim.optimization.search.axis_merging import SharedAxis
from anim.optimization.search.keyed_tracks import KeyedAxes, KeyedTracks, StoredTracks
from anim.optimization.search.source_motion import PATHS, ROTATION, SourceTrack
from anim.optimization.search.stacked_clips import StackedClips
from anim.sampling.track import sample
from tests.anim.optimization.making import TIMES, turning, waving
from tests.anim.optimization.search.stacks import CLIPS, stack
from tests.clips import CUBICSPLINE, about, clip, track

STACKED = stack(*CLIPS)
TRACKS: list[SourceTrack] = [each for source in STACKED.sources for each in source.moving]
MEMBERS = ((0, 1, 2), (0, 1, 2, 4), (2,))  # of each clip; a track that is on no axis among them


def _every(nth: int) -> list[Bools]:
    """Masks (K,) of every nth time of each clip's grid, and its last."""
    masks = [np.arange(len(source.grid)) % nth == 0 for source in STACKED.sources]
    for keys in masks:
        keys[-1] = True
    return masks


FULL, THIRDS = _every(1), _every(3)
MIXED = [FULL[0], THIRDS[1], FULL[2]]


def _axes(keyed: KeyedTracks, masks: Sequence[Bools], clips: Sequence[int] = (0, 1, 2)) -> KeyedAxes:
    return keyed.on([(clip, [SharedAxis(masks[clip], MEMBERS[clip])]) for clip in clips])


def _made(keyed: KeyedTracks, axes: KeyedAxes, tolerance: float = 1e-3) -> list[StoredTracks]:
    tolerances = np.full(len(TRACKS), tolerance)
    return _each(keyed, axes, tolerances)


def _each(keyed: KeyedTracks, axes: KeyedAxes, tolerances: Floats) -> list[StoredTracks]:
    """The tracks of all paths."""
    return [made for path in range(len(PATHS)) for made in keyed.each(path, axes, tolerances)]


@pytest.mark.parametrize("packing", list(Packing))
@pytest.mark.parametrize("masks", [THIRDS, FULL, MIXED])
def test_shown_is_what_the_stored_track_is_at_each_moment(packing: Packing, masks: list[Bools]) -> None:
    keyed = KeyedTracks(STACKED, packing)
    found = []
    for made in _made(keyed, _axes(keyed, masks)):
        for t, i in enumerate(made.tracks.tolist()):
            found.append(i)
            moving, number = TRACKS[i], int(STACKED.clip[i])
            keys, stored = masks[number], made.stored[t].values
            assert len(stored) == keys.sum()
            assert (made.keys[:, t, : len(stored)] == stored.T).all()
            played = track(moving.path, STACKED.sources[number].grid[keys], stored, node=0)
            expected = sample(played, STACKED.at[number])
            shown = made.shown[:, t].T
            if moving.path == "rotation":
                assert np.abs(np.linalg.norm(shown, axis=1) - 1).max() < 5e-5  # as stored, not normalized
                shown = quaternion.normalize(shown)
                expected = expected * np.sign((expected * shown).sum(axis=1))[:, None]
            assert shown == pytest.approx(expected, abs=1e-5)
    firsts = STACKED.first_track.tolist()
    assert sorted(found) == [first + i for first, some in zip(firsts, MEMBERS, strict=False) for i in some]


def test_a_full_axis_has_the_truth_as_keys() -> None:
    keyed = KeyedTracks(STACKED, Packing.CORE)
    for made in _made(keyed, _axes(keyed, FULL), 0.0):
        for i, stored in zip(made.tracks.tolist(), made.stored, strict=True):
            source = STACKED.sources[int(STACKED.clip[i])]
            assert (stored.values == TRACKS[i].values[source.on_grid].astype(np.float32)).all()


def test_fitted_keys_are_nearer_than_the_truths_own() -> None:
    """Over all moments, by least squares; the sway of the second clip's track 0 is what it gains most on."""
    keyed = KeyedTracks(STACKED, Packing.CORE)
    sway, source = int(STACKED.first_track[1]), STACKED.sources[1]
    (shown,) = [
        made.shown[:, made.tracks.tolist().index(sway), : len(source.at)].T
        for made in _made(keyed, _axes(keyed, THIRDS), 0.0)
        if sway in made.tracks
    ]
    values = source.moving[0].values
    own = track("translation", source.grid[THIRDS[1]], values[source.on_grid[THIRDS[1]]])
    assert ((shown - values) ** 2).sum() < 0.7 * ((sample(own, source.at) - values) ** 2).sum()


@pytest.mark.parametrize("packing", list(Packing))
@pytest.mark.parametrize("masks", [THIRDS, FULL, MIXED])
def test_tracks_of_clips_together_are_those_of_each_alone(packing: Packing, masks: list[Bools]) -> None:
    keyed = KeyedTracks(STACKED, packing)
    together = {
        i: (made.stored[t], made.shown[:, t])
        for made in _made(keyed, _axes(keyed, masks))
        for t, i in enumerate(made.tracks.tolist())
    }
    for number, what in enumerate(CLIPS):
        alone = KeyedTracks(stack(what), packing)
        axes = alone.on([(0, [SharedAxis(masks[number], MEMBERS[number])])])
        tolerances = np.full(len(what.tracks), 1e-3)
        for made in _each(alone, axes, tolerances):
            for t, i in enumerate(made.tracks.tolist()):
                stored, shown = together[i + int(STACKED.first_track[number])]
                assert (stored.form, stored.codes) == (made.stored[t].form, made.stored[t].codes)
                np.testing.assert_array_equal(stored.values, made.stored[t].values)
                count = made.shown.shape[2]
                assert shown[:, :count] == pytest.approx(made.shown[:, t], abs=1e-15)
                assert shown[:, count:] == pytest.approx(np.tile(shown[:, count - 1 : count], len(shown[0]) - count))


def test_clips_that_are_not_asked_for_have_no_tracks() -> None:
    keyed = KeyedTracks(STACKED, Packing.CORE)
    tracks = np.concatenate([made.tracks for made in _made(keyed, _axes(keyed, THIRDS, (0, 2)))])
    assert set(STACKED.clip[tracks].tolist()) == {0, 2}


@pytest.mark.parametrize("packing", list(Packing))
def test_keys_of_an_earlier_trial_are_made_once(packing: Packing, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of equal axes and storage; on another axis, or stored otherwise, tracks are made again."""
    keyed, fresh = KeyedTracks(STACKED, packing), KeyedTracks(STACKED, packing)
    made: list[int] = []
    make = KeyedTracks._make

    def counted(self: KeyedTracks, tracks: Ints, *more: Any) -> Any:
        made.extend(tracks.tolist() if self is keyed else [])
        return make(self, tracks, *more)

    monkeypatch.setattr(KeyedTracks, "_make", counted)
    expected_calls = []
    for masks, tolerance in ((THIRDS, 1e-3), (THIRDS, 1e-3), (MIXED, 1e-3), (THIRDS, 1.1e-3), (THIRDS, 1e-9)):
        found, expected = (_made(each, _axes(each, masks), tolerance) for each in (keyed, fresh))
        fresh = KeyedTracks(STACKED, packing)
        expected_calls.append(len(made))
        made.clear()
        for a, b in zip(found, expected, strict=True):
            np.testing.assert_array_equal(a.shown, b.shown)
            assert [(each.form, each.codes) for each in a.stored] == [(each.form, each.codes) for each in b.stored]
    assert expected_calls[:4] == [8, 0, 4, 0]
    assert expected_calls[4] > 0


def test_keys_of_earlier_trials_take_no_more_memory_than_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keyed_tracks, "MAX_KNOWN_VALUES", 100)
    keyed = KeyedTracks(STACKED, Packing.CORE)
    first = _made(keyed, _axes(keyed, THIRDS))
    second = _made(keyed, _axes(keyed, THIRDS))
    assert sum(each.values.size for each in keyed._known.values()) < 400
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.shown, b.shown)


def test_many_tracks_are_made_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    keyed = KeyedTracks(STACKED, Packing.EXT)
    whole = _made(keyed, _axes(keyed, THIRDS))
    monkeypatch.setattr(keyed_tracks, "MAX_STACKED_VALUES", 2 * STACKED.at.shape[1])
    parts = _made(keyed, _axes(keyed, THIRDS))
    assert [len(each.tracks) for each in whole] == [1, 5, 2]
    assert [len(each.tracks) for each in parts] == [1, 2, 2, 1, 2]
    for kind in (4, 3):
        some, every = ([made for made in each if len(made.keys) == kind] for each in (parts, whole))
        for field, axis in (("tracks", 0), ("keys", 1), ("shown", 1)):
            found, expected = (np.concatenate([getattr(made, field) for made in each], axis) for each in (some, every))
            np.testing.assert_array_equal(found, expected)


def test_chords() -> None:
    keyed = KeyedTracks(STACKED, Packing.CORE)
    axes = _axes(keyed, THIRDS)
    for made in keyed.each(ROTATION, axes, np.full(len(TRACKS), 1e-3)):
        axis_of = axes.axis_of[made.tracks]
        shown = playback.nlerp(made.keys, axes.intervals.left[axis_of], axes.intervals.u[axis_of])
        for t, i in enumerate(made.tracks.tolist()):
            number = int(STACKED.clip[i])
            times = STACKED.sources[number].grid[THIRDS[number]]
            columns = quaternion.align_signs(made.stored[t].values).T
            mixed = np.transpose([np.interp(STACKED.at[number], times, column) for column in columns])
            expected = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
            assert pytest.approx(expected, abs=1e-12) == shown[:, t].T


def _values(stacked: StackedClips, tracks: Ints) -> Floats:
    """The rotations (4, T, W) of some tracks, their last value repeated."""
    every = [each.values for source in stacked.sources for each in source.moving]
    length = stacked.at.shape[1]
    return np.stack([np.pad(every[i], ((0, length - len(every[i])), (0, 0)), "edge").T for i in tracks.tolist()], 1)


def test_other_values_than_their_own() -> None:
    """The same call as for their own, with rotations of other tracks: on the axis with every key these are stored."""
    keyed = KeyedTracks(STACKED, Packing.CORE)
    tracks = np.flatnonzero((STACKED.path == ROTATION) & (STACKED.clip == 1))
    values = _values(STACKED, tracks[::-1])
    made = keyed.store(tracks, values, _axes(keyed, FULL), np.zeros(len(TRACKS)))
    for stored, i in zip(made.stored, tracks[::-1].tolist(), strict=True):
        assert (stored.values == TRACKS[i].values[STACKED.sources[1].on_grid].astype(np.float32)).all()


def _loops() -> list[Floats]:
    """Rotations (25, 4) that come back, come back with the other sign, and do not."""
    once = np.concatenate((about("z", np.linspace(0, 360, 25))[:-1], [[0.0, 0, 0, -1]]))
    return [turning(1.5), once, about("x", np.linspace(0, 90, 25))]


def test_closed_tracks_stay_closed_to_the_bit() -> None:
    """Beside a clip with fewer keys on its axis: by the mean of both ends."""
    loops = clip(*(track("rotation", TIMES, each, node=node) for node, each in enumerate(_loops())))
    stacked = stack(loops, waving())
    closures = [each.closure for each in stacked.sources[0].moving]
    assert closures == [1, -1, 0]
    keyed = KeyedTracks(stacked, Packing.CORE)
    keys = np.arange(25) % 6 == 0
    axes = keyed.on([(0, [SharedAxis(keys, (0, 1, 2))]), (1, [SharedAxis(FULL[1], (0, 1, 2))])])
    (made,) = keyed.each(ROTATION, axes, np.zeros(len(stacked.clip)))
    ends = [(stored.values[0], stored.values[-1]) for stored in made.stored[:3]]
    assert (ends[0][0] == ends[0][1]).all()
    assert (ends[1][0] == -ends[1][1]).all()
    assert np.abs(ends[2][0] - ends[2][1]).max() > 0.5
    values = _values(stacked, np.arange(3))
    start = values[:, :, stacked.on_grid[0, keys]]
    fitted = axes.fit.rotations(values, np.concatenate((start, start[..., -1:].repeat(20, 2)), 2), axes.axis_of[:3])
    for t, (stored, sign) in enumerate(zip(made.stored[:3], closures, strict=True)):
        expected = fitted[:, t, :5].T
        if sign:
            mean = quaternion.normalize((expected[0] + sign * expected[-1]) / 2)
            expected[0], expected[-1] = mean, sign * mean
        assert stored.values == pytest.approx(expected, abs=1e-7)


def test_an_axis_with_every_key_has_the_truth_beside_one_with_fewer() -> None:
    """Of a spline, which no line fits: its middles don't move its keys."""
    knots, slopes = np.array([[0.0, 0, 0], [1, 2, 0], [0, 1, 1]]), np.full((3, 3), 9.0)
    spline = clip(track("translation", [0, 1, 2], knots, CUBICSPLINE, tangents=(slopes, -slopes), node=0))
    stacked = stack(spline, waving())
    keyed = KeyedTracks(stacked, Packing.CORE)
    source = stacked.sources[0]
    full = SharedAxis(np.ones(len(source.grid), np.bool_), (0,))
    axes = keyed.on([(0, [full]), (1, [SharedAxis(THIRDS[1], (0,))])])
    (made,) = keyed.each(PATHS.index("translation"), axes, np.zeros(len(stacked.clip)))
    assert made.tracks.tolist() == [0, 1]
    assert (made.stored[0].values == source.moving[0].values[source.on_grid].astype(np.float32)).all()

"""The same motion on a grid, by hand: exact ends, jumps where they were, and frames that show what they showed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anim.arrays import Floats
from anim.errors import RangeError
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import AccessorFormat, Interpolation, Track, ValueKind
from anim.operations.resample import INTERPOLATIONS, resample
from anim.sampling.times import frame_times, key_times
from anim.sampling.track import sample
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, track
from tests.files import opened_fixture

BYTES = AccessorFormat(5121, False, "SCALAR")

LINE = track("translation", [0, 1], [[0, 0, 0], [4, 0, 0]])
ZIGZAG = track("translation", [0, 0.3, 1], [[0, 0, 0], [3, 0, 0], [10, 0, 0]])
JUMP = track("scale", [0.1, 0.35, 0.9], [[1, 1, 1], [2, 2, 2], [3, 3, 3]], STEP)
TURN = track("rotation", [0, 0.5, 1], about("y", [0, 80, 20]))
ZEROS = np.zeros((3, 4))
CURVE = track("rotation", [0, 0.5, 1], about("y", [0, 80, 20]), CUBICSPLINE, tangents=(ZEROS, ZEROS))


# By hand


def test_a_line() -> None:
    found = resample(clip(LINE, name="walk"), fps=4)
    assert found.name == "walk"
    (made,) = found.tracks
    assert made.times.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert made.values.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]]
    assert made.interpolation is LINEAR


def test_a_corner_between_frames_is_cut() -> None:
    (made,) = resample(clip(ZIGZAG), fps=2).tracks
    np.testing.assert_allclose(made.values[:, 0], [0, 5, 10], rtol=1e-6)  # 3 + 7 · 0.2 / 0.7 = 5 at 0.5 s


def test_the_end_is_exact_though_it_is_no_frame() -> None:
    line = track("translation", [0, 0.7], [[0, 0, 0], [7, 0, 0]])
    (made,) = resample(clip(line), fps=4).tracks
    assert made.times.tolist() == [0, 0.25, 0.5, float(np.float32(0.7))]
    np.testing.assert_allclose(made.values[:, 0], [0, 2.5, 5, 7], rtol=1e-6)


@given(start=st.floats(0, 100, width=32), length=st.floats(0.125, 10, width=32), fps=st.floats(0.5, 120))
def test_start_and_end_are_exact(start: float, length: float, fps: float) -> None:
    end = float(np.float32(start + length))
    line = track("translation", [start, end], [[0, 0, 0], [1, 0, 0]])
    found = resample(clip(line), fps=fps)
    assert (found.start, found.end) == (start, end)
    np.testing.assert_allclose(found.tracks[0].values[[0, -1], 0], [0, 1], atol=1e-15)


def test_all_tracks_stand_on_the_clips_grid() -> None:
    late = track("scale", [0.5, 2], [[1, 1, 1], [2, 2, 2]], node=1)
    found = resample(clip(LINE, late), fps=2)
    for each in found.tracks:
        assert each.times.tolist() == [0, 0.5, 1, 1.5, 2]
    assert found.tracks[0].values[:, 0].tolist() == [0, 2, 4, 4, 4]
    np.testing.assert_allclose(found.tracks[1].values[:, 0], [1, 1, 4 / 3, 5 / 3, 2])


def test_chosen_tracks_only() -> None:
    found = resample(clip(LINE, TURN), fps=8, tracks=frozenset({1}))
    assert found.tracks[0] is LINE
    assert len(found.tracks[1].times) == 9
    assert resample(clip(LINE, TURN), fps=8, tracks=frozenset()).tracks == (LINE, TURN)


# Steps


@pytest.mark.parametrize("interpolation", ["keep", "step"])
def test_jumps_keep_their_times(interpolation: str) -> None:
    assert resample(clip(JUMP, LINE), fps=3, interpolation=interpolation).tracks[0] is JUMP


def test_snap_moves_jumps_to_the_next_frame() -> None:
    (made, _) = resample(clip(JUMP, LINE), fps=4, snap=True).tracks
    assert made.interpolation is STEP
    assert made.times.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert made.values[:, 0].tolist() == [1, 1, 2, 2, 3]


def test_a_line_as_steps_holds_what_each_frame_shows() -> None:
    (made,) = resample(clip(LINE), fps=4, interpolation="step").tracks
    assert made.interpolation is STEP
    assert made.values[:, 0].tolist() == [0, 1, 2, 3, 4]


def test_steps_as_a_line_pass_through_what_each_frame_shows() -> None:
    (made, _) = resample(clip(JUMP, LINE), fps=4, interpolation="linear").tracks
    assert made.interpolation is LINEAR
    assert made.values[:, 0].tolist() == [1, 1, 2, 2, 3]


# Kinds


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_bools_behind_pointers_stay_steps_and_bytes(interpolation: str) -> None:
    document = opened_fixture("pointer")
    number = next(i for i, each in enumerate(reader.clips(document)) if each.name == "blink")
    for snap in (False, True):
        made = resample(reader.clips(document)[number], fps=24, interpolation=interpolation, snap=snap)
        assert made.tracks[0].interpolation is STEP
        assert set(np.unique(made.tracks[0].values)) <= {0, 1}
        written = reader.clips(writer.replace_clips(document, {number: made}))[number].tracks[0]
        assert written.storage == BYTES
        assert (written.kind, written.interpolation) == (ValueKind.DISCRETE, STEP)


@pytest.mark.parametrize("name", ["color", "turn", "light", "weights", "one_weight"])
def test_pointers_are_resampled_like_any_track(name: str) -> None:
    before = next(each for each in reader.clips(opened_fixture("pointer")) if each.name == name)
    after = resample(before, fps=24)
    (a,), (b,) = before.tracks, after.tracks
    assert (a.target, a.pointer, a.path) == (b.target, b.pointer, b.path)
    assert len(b.times) == 25
    np.testing.assert_allclose(b.values, sample(a, b.times), atol=1e-15)


def test_rotations_are_unit_and_keep_their_side() -> None:
    signs = track("rotation", [0, 0.5, 1], about("y", [0, 80, 20]) * [[1], [-1], [1]])
    (made,) = resample(clip(signs), fps=30).tracks
    np.testing.assert_allclose(np.linalg.norm(made.values, axis=1), 1, atol=1e-15)
    assert (np.sum(made.values[1:] * made.values[:-1], axis=1) > 0).all()


@pytest.mark.parametrize(
    "made",
    [
        track("translation", [0.5], [[1, 2, 3]]),
        track("translation", [0, 0.4, 1], [[1, 2, 3]] * 3),
        track("rotation", [0, 1], about("y", [30, 30])),
        track("scale", [0, 1], np.ones((2, 3)), CUBICSPLINE, tangents=(np.zeros((2, 3)),) * 2),
        track("scale", [0, 1], np.ones((2, 3)), CUBICSPLINE, tangents=([[9, 9, 9], [0, 0, 0]], [[0, 0, 0], [9, 9, 9]])),
    ],
    ids=["one key", "constant", "constant turn", "constant curve", "tangents outside"],
)
def test_what_never_changes_stays(made: Track) -> None:
    assert resample(clip(made, replace(TURN, node=1)), fps=30).tracks[0] is made


@pytest.mark.parametrize(
    ("arriving", "leaving", "middle"), [([0, -1], [1, 0], 1.25), ([0, -1], [0, 0], 1.125), ([0, 0], [1, 0], 1.125)]
)
def test_equal_keys_with_tangents_are_not_constant(arriving: list[float], leaving: list[float], middle: float) -> None:
    sides = np.reshape(arriving, (2, 1)), np.reshape(leaving, (2, 1))
    (made,) = resample(clip(track("weights", [0, 1], [[1], [1]], CUBICSPLINE, tangents=sides)), fps=2).tracks
    np.testing.assert_allclose(made.values[:, 0], [1, middle, 1])


# Goals


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
@pytest.mark.parametrize("made", [ZIGZAG, TURN, CURVE, JUMP], ids=["line", "turn", "curve", "jump"])
def test_frames_show_what_they_showed(made: Track, interpolation: str) -> None:
    whole = clip(made)
    (new,) = resample(whole, fps=20, interpolation=interpolation).tracks
    goal = made.interpolation if interpolation == "keep" else Interpolation(interpolation.upper())
    assert new.interpolation is goal
    assert (new.in_tangents is not None) == (goal is CUBICSPLINE)
    frames = key_times(frame_times(whole.start, whole.end, fps=20))
    np.testing.assert_allclose(_aligned(sample(new, frames)), _aligned(sample(made, frames)), atol=1e-12)


def test_a_cubic_on_finer_frames_is_the_same_cubic() -> None:
    sides = np.array([[0.0, 1, 2], [3, -1, 0.5], [1, 1, 1]])
    made = track("translation", [0, 0.5, 2], sides * 2, CUBICSPLINE, tangents=(sides, -sides))
    (new,) = resample(clip(made), fps=8).tracks
    at = np.linspace(0, 2, 333)
    np.testing.assert_allclose(sample(new, at), sample(made, at), atol=1e-14)


@pytest.mark.parametrize("made", [TURN, CURVE], ids=["turn", "curve"])
def test_a_turn_as_a_fine_cubic_is_the_same_turn(made: Track) -> None:
    at = np.linspace(0, 1, 500)
    off = []
    for fps in (20, 40):
        (new,) = resample(clip(made), fps=fps, interpolation="cubicspline").tracks
        off.append(np.abs(_aligned(sample(new, at)) - _aligned(sample(made, at))).max())
    assert off[1] < 1e-6
    assert off[1] < off[0] / 10  # a cubic's error falls with the fourth power of the step


def test_a_cubic_needs_two_keys() -> None:
    instant = clip(track("translation", [1.0], [[0, 0, 0]]))
    assert resample(instant, fps=30, interpolation="cubicspline").tracks == instant.tracks


# Refusals


@pytest.mark.parametrize("fps", [0, -30, float("nan"), float("inf")])
def test_rates_that_are_none_are_refused(fps: float) -> None:
    with pytest.raises(RangeError, match="fps"):
        resample(clip(LINE), fps=fps)


def test_unknown_interpolations_are_refused() -> None:
    with pytest.raises(RangeError, match=r"'cubic' .*keep, step, linear, cubicspline"):
        resample(clip(LINE), fps=30, interpolation="cubic")


def test_an_empty_clip_stays_empty() -> None:
    assert resample(clip(name="nothing"), fps=30) == clip(name="nothing")


def _aligned(values: Floats) -> Floats:
    """Values with the sign of the first: quaternions are the same rotations with either."""
    signs = np.where((values * values[:1]).sum(axis=1, keepdims=True) < 0, -1, 1) if values.shape[1] == 4 else 1
    return np.asarray(values * signs)

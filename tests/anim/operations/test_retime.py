"""Retimed clips show the same at another time: against the source sampled at the time that it should show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.curves.easing.table import parse
from anim.errors import RangeError, UnsupportedError
from anim.model import Clip, TimeAxis, Track
from anim.operations.retime import retime
from anim.operations.time_warp import warp
from anim.sampling.track import sample
from tests import clips
from tests.anim.operations.plain_eases import EASES
from tests.anim.operations.tracks import ANCHOR, KEYS, TRACKS, distance

INSIDE = np.linspace(0, 3, 1400)[1:-1] + 1e-4


def shows(track: Track, new: Track, old_time: Callable[[Floats], Floats], times: Floats) -> float:
    """How far the new track is, at `times`, from the source at the times that it should show."""
    return distance(track, sample(new, times), sample(track, old_time(times)))


def changed(track: Track, **options: object) -> Track:
    return retime(Clip("", (track, ANCHOR)), **options).tracks[0]  # type: ignore[arg-type]


@pytest.mark.parametrize("track", TRACKS.values(), ids=TRACKS)
class TestExact:
    def test_slower(self, track: Track) -> None:
        assert shows(track, changed(track, speed=0.25), lambda t: t / 4, 4 * INSIDE) < 1e-12

    def test_to_a_duration(self, track: Track) -> None:
        assert shows(track, changed(track, duration=1.5), lambda t: 2 * t, INSIDE / 2) < 1e-12

    def test_backwards(self, track: Track) -> None:
        assert shows(track, changed(track, reverse=True), lambda t: 3 - t, INSIDE) < 1e-12

    def test_backwards_twice_is_the_same(self, track: Track) -> None:
        once = retime(Clip("", (track, ANCHOR)), reverse=True)
        assert shows(track, retime(once, reverse=True).tracks[0], lambda t: t, INSIDE) < 1e-12

    def test_there_and_back(self, track: Track) -> None:
        new = changed(track, ping_pong=True)
        assert shows(track, new, lambda t: np.minimum(t, 6 - t), np.concatenate((INSIDE, INSIDE + 3))) < 1e-12

    def test_later(self, track: Track) -> None:
        assert shows(track, changed(track, offset=2), lambda t: t - 2, INSIDE + 2) < 1e-12


def test_tangents_follow_the_chain_rule() -> None:
    new = changed(TRACKS["cubic"], speed=0.5)
    np.testing.assert_array_equal(new.in_tangents, np.asarray(TRACKS["cubic"].in_tangents) / 2)


def test_step_ends_on_what_it_began_with_when_reversed() -> None:
    new = changed(TRACKS["step"], reverse=True)
    np.testing.assert_array_equal(new.values[0], TRACKS["step"].values[-1])
    np.testing.assert_array_equal(new.values[-1], TRACKS["step"].values[0])


def test_reversed_lines_are_reversed_to_the_bit() -> None:
    for name in ("linear", "slerp", "cubic", "turning"):
        twice = retime(retime(Clip("", (TRACKS[name],)), reverse=True), reverse=True).tracks[0]
        np.testing.assert_array_equal(twice.values, TRACKS[name].values)
        np.testing.assert_array_equal(twice.times, TRACKS[name].times)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"speed": 0.0}, "`speed` is 0"),
        ({"speed": -1.0}, "use `reverse`"),
        ({"duration": 0.0}, "`duration` is 0"),
        ({"offset": -1.0}, "leads to -1 s"),
        ({"speed": 1.0, "duration": 1.0}, "exclude"),
    ],
)
def test_refusals(options: dict[str, float], words: str) -> None:
    with pytest.raises(RangeError, match=words):
        changed(TRACKS["linear"], **options)


@pytest.mark.parametrize("printed", ["-0.0416667", "-0.04166667", "-0.0417", "-0.042", "-0.04166", "-0.041666668"])
def test_an_offset_by_a_start_as_it_is_printed_leads_to_0(printed: str) -> None:
    start = float(np.float32(1 / 24))
    track = replace(TRACKS["linear"], time_axis=TimeAxis(TRACKS["linear"].times + start))
    new = retime(Clip("", (track,)), offset=float(printed)).tracks[0]
    np.testing.assert_allclose(new.times, TRACKS["linear"].times, atol=1e-15)
    assert new.times[0] == 0


def test_a_small_offset_to_later_stays() -> None:
    assert changed(TRACKS["linear"], offset=1e-4).times[0] == 1e-4


@pytest.mark.parametrize("name", ["smoothstep", "quad-in", "bounce-out", "back-out", "sine-in-out", "ease", "circ-out"])
@pytest.mark.parametrize("span", [(0.0, 3.0), (0.7, 2.0)], ids=["whole", "part"])
@pytest.mark.parametrize("key", ["linear", "cubic", "slerp", "turning", "step"])
def test_warp_shows_the_eased_time(name: str, span: tuple[float, float], key: str) -> None:
    track, (start, end) = TRACKS[key], span

    def old(times: Floats) -> Floats:
        u = (times - start) / (end - start)
        plain = np.array([EASES[name](min(max(x, 0.0), 1.0)) for x in u.tolist()])
        return np.where((u >= 0) & (u <= 1), start + (end - start) * plain, times)

    new = warp(Clip("", (track,)), easing=parse(name), start=start, end=end).tracks[0]
    got, want = sample(new, INSIDE), sample(track, old(INSIDE))
    if key == "step":
        assert (np.abs(got - want).max(axis=1) > 1e-9).mean() < 1e-3  # a sample may fall into a jump's rounding
        return
    extent = np.radians(0.05) if track.path == "rotation" else 1e-3 * np.ptp(track.values, axis=0).max()
    assert distance(track, got, want) <= extent * 1.01


def test_warp_of_lines_by_a_cubic_is_exact_and_has_a_key_where_the_map_reaches_one() -> None:
    new = warp(Clip("", (TRACKS["linear"],)), easing=parse("quad-in")).tracks[0]
    np.testing.assert_allclose(new.times, 3 * np.sqrt(KEYS / 3), atol=1e-12)


def test_warp_refuses_jumps_and_empty_ranges() -> None:
    with pytest.raises(RangeError, match="jumps"):
        warp(Clip("", (TRACKS["linear"],)), easing=parse("steps(3)"))
    with pytest.raises(RangeError, match="empty"):
        warp(Clip("", (TRACKS["linear"],)), easing=parse("quad-in"), start=2, end=2)


def test_a_track_that_hardly_moves_gets_no_keys_beyond_what_float32_tells_apart() -> None:
    values = (1 + 1e-7 * np.arange(4))[:, None] * np.ones(3)
    trembling = Track(0, "translation", TRACKS["linear"].interpolation, KEYS, values)
    assert len(warp(Clip("", (trembling,)), easing=parse("sine-in-out")).tracks[0].times) < 50


def test_warp_gives_lines_too() -> None:
    new = warp(Clip("", (TRACKS["slerp"],)), easing=parse("smoothstep"), interpolation="linear").tracks[0]
    u = INSIDE / 3
    old = 3 * (u * u * (3 - 2 * u))
    assert new.in_tangents is None
    assert distance(new, sample(new, INSIDE), sample(TRACKS["slerp"], old)) <= np.radians(0.05) * 1.01


# Late clips


@pytest.mark.parametrize("start", [0.0, 7200.0])
@pytest.mark.parametrize("options", [{"reverse": True}, {"ping_pong": True}, {"reverse": True, "offset": 3600.0}])
def test_late_steps_keep_their_jumps_in_float32(start: float, options: dict[str, object]) -> None:
    """Float32 times are 0.5 ms apart at 7200 s: a jump of a microsecond would be none."""
    step = replace(TRACKS["step"], time_axis=TimeAxis(20 * TRACKS["step"].times + start))
    new = retime(Clip("", (step,)), **options).tracks[0]  # type: ignore[arg-type]
    stored = new.times.astype(np.float32)
    assert (np.diff(stored) > 0).all()
    assert new.times[0] == start + options.get("offset", 0.0)  # type: ignore[operator]
    inside = INSIDE * 20 + start
    times = inside if "reverse" not in options else 2 * start + 60 - inside
    shown = sample(replace(new, time_axis=TimeAxis(stored)), inside + options.get("offset", 0.0))  # type: ignore[operator]
    assert distance(step, shown, sample(step, times)) < 1e-12


@pytest.mark.parametrize("name", ["linear", "cubic", "slerp", "turning", "step"])
def test_a_jump_stays_one_where_it_gets_later(name: str) -> None:
    """Reversed back, the first microsecond becomes the last, at 60 s."""
    times = 20 * TRACKS[name].times
    early = replace(TRACKS[name], time_axis=TimeAxis(np.concatenate((times[:1], times[:1] + 1e-6, times[2:]))))
    for options in ({"reverse": True}, {"offset": 100.0}):
        new = changed(early, **options)
        assert (np.diff(new.times.astype(np.float32)) > 0).all()


@pytest.mark.parametrize("options", [{"reverse": True}, {"ping_pong": True}, {"offset": 1.0}, {"speed": 0.5}])
@pytest.mark.parametrize("interpolation", ["LINEAR", "STEP"])
def test_keys_near_0_that_rounding_brings_together_stay_a_jump(options: dict[str, Any], interpolation: str) -> None:
    values = np.outer([1.0, 2, 3, 4, 5], np.ones(3))
    track = Track(0, "translation", interpolation, np.array([0, 1e-45, 1e-38, 1, 3]), values)
    (new,) = retime(Clip("", (track,)), **options).tracks
    stored = new.times.astype(np.float32)
    assert (np.diff(stored) > 0).all()
    assert new.values[:, 0].tolist()[:2] == ([5, 4] if "reverse" in options else [1, 2])
    assert set(new.values[:, 0]) == {1, 2, 3, 4, 5}


def test_more_keys_than_a_jump_has_are_refused() -> None:
    track = Track(0, "translation", "LINEAR", np.array([*(1e-45 * np.arange(1, 90)), 3.0]), np.ones((90, 3)))
    with pytest.raises(UnsupportedError, match=r"keys 1 and 2 would fall together, at 3 s") as caught:
        retime(Clip("", (track,)), reverse=True)
    assert "resample" in caught.value.help


def test_keys_that_no_float32_time_tells_apart_are_left_to_the_writer() -> None:
    dense = clips.track("scale", 1e-6 * np.arange(9), np.ones((9, 3)))
    new = retime(Clip("", (dense,)), offset=1000.0).tracks[0]
    np.testing.assert_array_equal(new.times, dense.times + 1000)


def test_a_clip_beyond_the_seconds_of_float32_is_refused() -> None:
    with pytest.raises(RangeError, match=r"the clip would end at 3e\+30 s \(limit 16777216 s"):
        changed(TRACKS["linear"], speed=1e-30)
    with pytest.raises(RangeError, match=r"the clip would end too late \(limit 16777216 s"):
        changed(TRACKS["linear"], speed=1e-320)

"""`resample`: the same motion on a grid, what it costs measured right, and nothing else touched."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import fixtures
from tests.cli.conftest import Call, Fixture
from tests.cli.playing import Channel, Floats, Player, apart, value_at
from tests.cli.running import built, refusal
from tests.cli.untouched import check_only_animations_changed

MODES = ("STEP", "LINEAR", "CUBICSPLINE")
EXACT = 1e-6  # files hold float32


def resampled(call: Call, data: bytes, *options: str) -> Player:
    return Player(call("resample", "-", "-", *options, stdin=data).product())


def by_target(player: Player, clip: int = 0) -> dict[tuple[int, str], Channel]:
    return {(channel.node, channel.path): channel for channel in player.channels(clip)}


def keys(channel: Channel) -> Floats:
    return channel.values.reshape(len(channel.times), 3, -1)[:, 1]


@pytest.mark.parametrize(
    ("clip", "fps", "times"),
    [
        ("straight", 8, [k / 8 for k in range(9)]),
        ("late", 3, [0.5, 0.5 + 1 / 3, 0.5 + 2 / 3, 1.5]),
        ("open_loop", 10, [k / 10 for k in range(10)] + [23 / 24]),
        ("straight", 0.4, [0, 1]),
    ],
)
def test_keys_lie_on_the_grid_and_the_end_stays(
    clip: str, fps: float, times: list[float], noop: bytes, call: Call
) -> None:
    number = Player(noop).names().index(clip)
    (channel,) = resampled(call, noop, "--fps", str(fps), "--clip", clip).channels(number)
    assert channel.times == pytest.approx(times, abs=1e-7)
    (old,) = Player(noop).channels(number)
    assert (channel.times[0], channel.times[-1]) == (old.times[0], old.times[-1])
    for time, value in zip(channel.times, channel.values, strict=True):
        assert value == pytest.approx(value_at(old, time), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "clip", "fps", "turned"),
    [
        ("biped", "walk", 48, EXACT),
        ("biped", "wave", 40, 5e-6),
        ("biped", "jump", 100, 5e-6),
        ("morph_cube", "linear", 10, EXACT),
        ("morph_cube", "cubic", 6, EXACT),
        ("interpolations", "move", 2, 5e-3),
        ("interpolations", "move", 10, 2e-4),
        ("interpolations", "move", 60, EXACT),
        ("noop", "late", 7, EXACT),
        ("accessors", "sparse", 8, EXACT),
    ],
)
def test_a_multiple_of_the_source_rate_is_the_same_motion(
    name: str, clip: str, fps: int, turned: float, call: Call
) -> None:
    """turned: what CUBICSPLINE rotations may be off. Between keys their splines hold no unit quaternions, keys must:
    no spline through these is the same curve, one only comes near it with the fourth power of the distance."""
    old = Player(built(name))
    number = old.names().index(clip)
    new = resampled(call, built(name), "--fps", str(fps))
    after = by_target(new, number)
    for target, channel in by_target(old, number).items():
        for time in np.arange(0, channel.times[-1] + 0.1, 1 / 97):
            error = apart(channel.path, value_at(after[target], time), value_at(channel, time))
            is_turned_spline = channel.path == "rotation" and channel.interpolation == "CUBICSPLINE"
            assert error < (turned if is_turned_spline else EXACT), (target, time)


def test_every_mode_is_kept_and_steps_keep_their_times(call: Call) -> None:
    data = built("interpolations")
    old, new = by_target(Player(data)), by_target(resampled(call, data, "--fps", "7"))
    for target, channel in new.items():
        assert channel.interpolation == old[target].interpolation
        if channel.interpolation == "STEP":
            assert channel.times.tolist() == old[target].times.tolist()
            assert channel.values.tolist() == old[target].values.tolist()
        else:
            assert channel.times == pytest.approx([k / 7 for k in range(15)])


def test_snap_moves_steps_onto_the_grid(call: Call) -> None:
    data = built("interpolations")
    new = by_target(resampled(call, data, "--fps", "4", "--snap"))
    for target, channel in by_target(Player(data)).items():
        if channel.interpolation == "STEP":
            assert new[target].interpolation == "STEP"
            assert new[target].times == pytest.approx([k / 4 for k in range(9)])
            assert new[target].values == pytest.approx(np.array([value_at(channel, k / 4) for k in range(9)]), abs=1e-6)


@pytest.mark.parametrize("mode", MODES)
def test_another_interpolation_has_the_same_values_at_its_keys(mode: str, call: Call) -> None:
    data = built("interpolations")
    new = by_target(resampled(call, data, "--fps", "8", "--snap", "--interpolation", mode.lower()))
    for target, channel in by_target(Player(data)).items():
        assert new[target].interpolation == mode
        assert len(new[target].times) == 17
        values = keys(new[target]) if mode == "CUBICSPLINE" else new[target].values
        for time, value in zip(new[target].times, values, strict=True):
            assert apart(channel.path, value, value_at(channel, time)) < 1e-6


def test_a_named_interpolation_is_that_of_every_track(biped: bytes, call: Call) -> None:
    new = resampled(call, biped, "--fps", "10", "--interpolation", "linear", "--clip", "wave")
    assert {channel.interpolation for channel in new.channels(new.names().index("wave"))} == {"LINEAR"}


def test_only_what_is_selected_changes(biped: bytes, call: Call) -> None:
    old = Player(biped)
    new = resampled(call, biped, "--fps", "48", "--clip", "w*", "--node", "left_*", "--path", "rotation")
    for number, name in enumerate(old.names()):
        after = by_target(new, number)
        for (node, path), channel in by_target(old, number).items():
            meant = name in ("walk", "wave") and old.nodes[node]["name"].startswith("left_") and path == "rotation"
            values = keys(channel) if channel.interpolation == "CUBICSPLINE" else channel.values
            moving = np.ptp(values, axis=0).any()
            assert (after[node, path].times.tolist() != channel.times.tolist()) == (meant and moving)


def test_what_says_nothing_is_not_written_more_often(noop: bytes, call: Call) -> None:
    old, new = Player(noop), resampled(call, noop, "--fps", "100")
    for name in ("constant", "at_rest", "one_key"):
        number = old.names().index(name)
        assert [len(c.times) for c in new.channels(number)] == [len(c.times) for c in old.channels(number)]


def test_rotations_are_unit_and_keep_their_sign(noop: bytes, biped: bytes, call: Call) -> None:
    for data in (noop, biped):
        new = resampled(call, data, "--fps", "30", "--interpolation", "linear")
        for number, name in enumerate(new.names()):
            for channel in new.channels(number):
                if channel.path == "rotation":
                    values = keys(channel) if channel.interpolation == "CUBICSPLINE" else channel.values
                    assert np.linalg.norm(values, axis=1) == pytest.approx(1, abs=1e-6), name
                    assert ((values[1:] * values[:-1]).sum(axis=1) >= 0).all(), name


def test_pointers_are_resampled_too(call: Call) -> None:
    after = resampled(call, built("pointer"), "--fps", "8")
    found = {}
    for animation in after.document["animations"]:
        (sampler,) = animation["samplers"]
        count = after.document["accessors"][sampler["input"]]["count"]
        found[animation["name"]] = (count, sampler.get("interpolation", "LINEAR"))
    linear = dict.fromkeys(("color", "turn", "light", "weights", "one_weight"), (9, "LINEAR"))
    assert found == {**linear, "blink": (3, "STEP")}
    before, found_after = (
        {
            finding["name"]
            for finding in call("inspect", "-", "--format", "json", stdin=data).json["files"][0]["findings"]
        }
        for data in (built("pointer"), after.bytes)
    )
    assert found_after <= before | {"redundant-keys"}


@pytest.mark.parametrize("name", fixtures.FIXTURES)
def test_nothing_else_changes(name: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    path = fixture(name)
    for out in (tmp_path / "out.glb", tmp_path / "out.gltf"):
        call("resample", path, out, "--fps", "31").product()
        check_only_animations_changed(path, out)


def test_extras_and_unknown_extensions_stay(call: Call) -> None:
    path_free = json.loads(built("gltf_embedded"))
    extra = {"extras": {"z": 1, "a": [None, {"deep": "é"}]}, "extensions": {"ACME_note": {"on": True}}}
    path_free["animations"][0] |= extra
    path_free["animations"][0]["channels"][0] |= extra
    path_free["animations"][0]["samplers"][0] |= extra
    path_free["asset"] |= {"generator": "by hand", **extra}
    path_free["ACME_top"] = ["kept"]
    new = resampled(call, json.dumps(path_free).encode(), "--fps", "4").document
    animation = new["animations"][0]
    for part in (animation, animation["channels"][0], animation["samplers"][0], new["asset"]):
        assert {key: part[key] for key in extra} == extra
    assert new["asset"]["generator"] == "by hand"
    assert new["ACME_top"] == ["kept"]


def test_two_runs_give_the_same_bytes(biped: bytes, call: Call) -> None:
    runs = [call("resample", "-", "-", "--fps", "50", stdin=biped).product() for _ in range(2)]
    assert runs[0] == runs[1]


@pytest.mark.slow
def test_its_own_output_keeps_its_keys(biped: bytes, call: Call) -> None:
    once = call("resample", "-", "-", "--fps", "50", stdin=biped).product()
    twice = call("resample", "-", "-", "--fps", "50", stdin=once).product()
    for number in range(3):
        for target, channel in by_target(Player(twice), number).items():
            assert channel.times.tolist() == by_target(Player(once), number)[target].times.tolist()
            assert channel.values == pytest.approx(by_target(Player(once), number)[target].values, abs=1e-6)


def test_its_own_output_is_a_fixed_point(biped: bytes, call: Call) -> None:
    once = call("resample", "-", "-", "--fps", "50", stdin=biped).product()
    assert call("resample", "-", "-", "--fps", "50", stdin=once).product() == once


def test_an_input_may_be_its_own_output(biped: bytes, call: Call, tmp_path: Path, fixture: Fixture) -> None:
    expected = call("resample", "-", "-", "--fps", "12", stdin=biped).product()
    path = tmp_path / "walk.glb"
    path.write_bytes(biped)
    call("resample", path, path, "--fps", "12").product()
    assert path.read_bytes() == expected
    text = fixture("gltf_external")
    call("resample", text, text, "--fps", "3").product()
    assert [len(channel.times) for channel in Player(call("convert", text).product()).channels(0)] == [4]


@pytest.mark.parametrize("fps", ["0", "-1"])
def test_a_rate_that_is_none_is_refused(fps: str, biped: bytes, call: Call) -> None:
    assert "(expected a number above 0)" in refusal(call("resample", "-", "--fps", fps, stdin=biped), 2)


def test_too_many_frames_are_refused_before_memory_is_gone(biped: bytes, call: Call) -> None:
    assert "limit" in refusal(call("resample", "-", "--fps", "1e12", stdin=biped), 4)

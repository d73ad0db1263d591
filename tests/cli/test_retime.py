"""`gltf-anim retime`: the seconds of the clips that it writes."""

from __future__ import annotations

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import refusal
from tests.files import clips_of


@pytest.mark.parametrize(
    ("options", "start", "end"),
    [
        (["--speed", "0.25"], 0, 4),
        (["--duration", "2.5"], 0, 2.5),
        (["--reverse"], 0, 1),
        (["--ping-pong"], 0, 2),
        (["--offset", "0.5"], 0.5, 1.5),
        (["--warp", "sine-in-out"], 0, 1),
        (["--speed", "2", "--ping-pong", "--offset", "1"], 1, 2),
    ],
)
def test_seconds(call: Call, fixture: Fixture, options: list[str], start: float, end: float) -> None:
    clip = clips_of(call("retime", fixture("biped"), "--clip", "walk", "-q", *options).product())[0]
    assert (clip.start, clip.end) == pytest.approx((start, end), abs=1e-6)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "nothing to do"),
        (["--speed", "0"], "speed is 0"),
        (["--speed", "2", "--duration", "1"], "exclude"),
        (["--offset", "-1"], "leads to -1 s"),
        (["--warp", "sinus"], "'sinus'"),
    ],
)
def test_refusals(call: Call, fixture: Fixture, options: list[str], words: str) -> None:
    assert words in refusal(call("retime", fixture("biped"), *options), 2)

"""`gltf-anim retime`: the seconds of the clips that it writes."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.gltf.authoring import build_document
from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal
from tests.clips import clip, skeleton, track
from tests.files import clips_of, glb_of


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
    found = clips_of(call("retime", fixture("biped"), "--clip", "walk", "-q", *options).product())[0]
    assert (found.start, found.end) == pytest.approx((start, end), abs=1e-6)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "nothing to do"),
        (["--speed", "0"], "speed is 0"),
        (["--speed", "2", "--duration", "1"], "exclude"),
        (["--speed", "1e308"], "--speed is 1e+308 (expected above 0, at most 1e+09)"),
        (["--duration", "1e-40"], "--duration is 1e-40 s (expected 1e-06 or more)"),
        (["--offset", "-1"], "leads to -1 s"),
        (["--warp", "sinus"], "'sinus'"),
    ],
)
def test_refusals(call: Call, fixture: Fixture, options: list[str], words: str) -> None:
    assert words in refusal(call("retime", fixture("biped"), *options), 2)


@pytest.mark.parametrize(
    ("start", "options", "advice"),
    [
        (0, ["--speed", "1e-9"], "choose a higher --speed, or a shorter --duration or --offset"),
        (1e9, ["--speed", "0.5"], "gltf-anim trim shortens the clip, and moves a late start to 0 s"),
    ],
)
def test_an_end_beyond_float32_has_advice(
    start: float, options: list[str], advice: str, call: Call, tmp_path: Path
) -> None:
    moved = clip(track("translation", [start, start + 500], [[0, 0, 0], [1, 0, 0]]))
    (tmp_path / "in.glb").write_bytes(glb_of(build_document(skeleton([-1]), [moved])))
    run = call("retime", tmp_path / "in.glb", tmp_path / "out.glb", *options)
    assert "(limit 16777216 s, for times in float32)" in refusal(run, 2)
    assert help_line(run) == advice

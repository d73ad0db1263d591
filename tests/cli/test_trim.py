"""`gltf-anim trim`: the part that it keeps."""

from __future__ import annotations

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal
from tests.files import clips_of


@pytest.mark.parametrize(
    ("options", "start", "end"),
    [
        (["--from", "0.25", "--to", "0.8"], 0.25, 0.8),
        (["--from", "0.25", "--to", "0.8", "--rebase"], 0, 0.55),
        (["--to", "0.5"], 0, 0.5),
        (["--from", "0.5", "--to", "9"], 0.5, 1),
    ],
)
def test_seconds(call: Call, fixture: Fixture, options: list[str], start: float, end: float) -> None:
    clip = clips_of(call("trim", fixture("biped"), "--clip", "walk", "-q", *options).product())[0]
    assert (clip.start, clip.end) == pytest.approx((start, end), abs=1e-6)


def test_rebase_alone_moves_a_late_start_to_0(call: Call, fixture: Fixture) -> None:
    before = clips_of(built("noop"))
    after = clips_of(call("trim", fixture("noop"), "--rebase", "-q").product())
    late = [clip.name for clip in before].index("late")
    assert (before[late].start, after[late].start, after[late].end) == (0.5, 0, 1)
    assert [clip.end for i, clip in enumerate(after) if i != late] == [
        clip.end for i, clip in enumerate(before) if i != late
    ]


def test_rebase_says_which_clips_it_moves_apart(call: Call, fixture: Fixture) -> None:
    run = call("trim", fixture("noop"), "-", "--from", "0.25", "--to", "0.8", "--rebase")
    run.product()
    assert "note: --rebase moves clips that belong together apart: " in run.err
    assert "by 0.25 s; clip 'late' by 0.5 s\n" in run.err
    assert "apart" not in call("trim", fixture("noop"), "-", "--from", "0.6", "--to", "0.8", "--rebase").err


@pytest.mark.parametrize(
    ("options", "words"), [([], "nothing to do"), (["--from", "8"], "start 8 s is at or after the clip's end")]
)
def test_refusals(call: Call, fixture: Fixture, options: list[str], words: str) -> None:
    assert words in refusal(call("trim", fixture("biped"), *options), 2)


@pytest.mark.parametrize("command", ["trim", "retime"])
def test_a_missing_clip_is_said_before_missing_options(call: Call, fixture: Fixture, command: str) -> None:
    run = call(command, fixture("biped"), "-", "--clip", "wakl")
    assert "no clip matches 'wakl'" in refusal(run, 5)
    assert "nothing to do" in refusal(call(command, fixture("biped"), "-", "--clip", "walk"), 2)

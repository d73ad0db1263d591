"""The last line of a command: how long clips became, and how long the command took."""

from __future__ import annotations

import re

import pytest

from cli.text import format_duration, format_span, format_time
from cli.workflows.edit_clips import clip_lengths
from tests.cli.conftest import Call, Fixture
from tests.clips import clip, track


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("retime", "--speed", "0.25", "--clip", "walk"), "'walk' 1 s → 4 s"),
        (("retime", "--offset", "0.5", "--clip", "walk"), "'walk' 1 s → 0.5–1.5 s"),
        (("retime", "--speed", "2"), "'walk' 1 s → 0.5 s, 'wave' 2 s → 1 s, 'jump' 1.6 s → 0.8 s"),
        (("trim", "--from", "0.25", "--clip", "walk"), "'walk' 1 s → 0.25–1 s"),
        (("trim", "--from", "0.25", "--rebase", "--clip", "walk"), "'walk' 1 s → 0.75 s"),
    ],
    ids=lambda each: " ".join(each) if isinstance(each, tuple) else "",
)
def test_new_lengths(options: tuple[str, ...], words: str, call: Call, fixture: Fixture) -> None:
    command, *rest = options
    last = call(command, fixture("biped"), "-", *rest).err.splitlines()[-1]
    assert f", {words}, took " in last


@pytest.mark.parametrize(
    "options",
    [
        ("resample", "--fps", "30"),
        ("ease",),
        ("optimize", "--effort", "fast"),
        ("convert",),
        ("bake", "--clip", "walk"),
        ("to-euler", "--clip", "walk"),
        ("render",),
    ],
    ids=" ".join,
)
def test_every_command_says_took_and_only_new_lengths(options: tuple[str, ...], call: Call, fixture: Fixture) -> None:
    command, *rest = options
    words = call(command, fixture("biped"), "-", *rest).err
    assert re.search(r", took \d[\d.]* s\b", words), words
    assert "1 s →" not in words


def test_many_clips_are_summed_up() -> None:
    before = {i: clip(track("translation", [0, 1 + i], [[0, 0, 0], [1, 0, 0]])) for i in range(4)}
    after = {i: clip(track("translation", [0, 0.5], [[0, 0, 0], [1, 0, 0]])) for i in range(4)}
    assert clip_lengths(before, after) == "4 clips 10 s → 2 s in all"
    assert clip_lengths(before, before) == ""


def test_times_as_words() -> None:
    assert format_time(1 / 24) == "0.0417 s"
    assert format_time(12) == "12 s"
    assert format_span(1 / 24, 2) == "0.0417–2 s"
    assert format_span(0, 1.5) == "1.5 s"
    assert (format_duration(0.0312), format_duration(0.84), format_duration(75.31)) == (
        "took 0.031 s",
        "took 0.84 s",
        "took 75.3 s",
    )

"""`gltf-anim ease`: the files that it writes, what it says, and what it refuses."""

from __future__ import annotations

import pytest

from anim.curves.easing.table import EASINGS
from anim.model import Interpolation
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import help_line, refusal
from tests.files import clips_of


def test_list_shows_every_ease_with_its_shape(call: Call) -> None:
    lines = call("ease", "--list").text.splitlines()
    assert "easings.net's differ by up to 0.001" in lines[-1]
    shown = {line.split()[0] for line in lines if "▁" in line or "█" in line}
    assert shown == set(EASINGS)
    assert any("cubic-bezier(" in line for line in lines)


def test_chosen_clip_only(call: Call, fixture: Fixture) -> None:
    path = fixture("biped")
    before, after = clips_of(path.read_bytes()), clips_of(call("ease", path, "--clip", "walk", "-q").product())
    assert {t.interpolation for t in after[0].tracks} == {Interpolation.CUBICSPLINE}
    assert [len(t.times) for t in after[1].tracks] == [len(t.times) for t in before[1].tracks]


def test_chosen_path_only(call: Call, fixture: Fixture) -> None:
    after = clips_of(call("ease", fixture("biped"), "--clip", "walk", "--path", "translation", "-q").product())[0]
    eased = {t.path for t in after.tracks if t.interpolation is Interpolation.CUBICSPLINE}
    assert eased == {"translation"}


def test_says_when_easing_will_stutter_and_when_values_overshoot(call: Call, fixture: Fixture) -> None:
    assert "stutter" in call("ease", fixture("biped"), "-", "--clip", "walk").err
    run = call("ease", fixture("interpolations"), "-", "--ease", "back-out")
    assert "'back-out' reaches 0 … 110 %" in run.err
    assert "scale" in run.err


def test_says_why_a_file_is_larger(call: Call, fixture: Fixture) -> None:
    path = fixture("interpolations")
    words = "three values per key instead of one; optimize removes"
    assert words in call("ease", path, "-").err
    assert words not in call("ease", path, "-", "--interpolation", "linear").err


def test_per_range_keeps_the_clips_ends(call: Call, fixture: Fixture) -> None:
    clip = clips_of(
        call("ease", fixture("biped"), "--clip", "walk", "--per", "range", "--ease", "ease", "-q").product()
    )
    assert (clip[0].start, clip[0].end) == (0.0, 1.0)


def test_a_selection_of_nothing_is_said_and_changes_nothing(call: Call, fixture: Fixture) -> None:
    path = fixture("biped")
    run = call("ease", path, "-", "--path", "weights")
    assert "no track was changed" in run.err
    assert run.product() == path.read_bytes()


@pytest.mark.parametrize(
    ("options", "words", "hint"),
    [
        (["--ease", "smoothstp"], "smoothstp", "smoothstep"),
        (["--ease", "cubic-bezier(2,0,0,1)"], "x1 and x2 are 2", ""),
        (["--ease", "steps(3)", "--per", "range"], "is discontinuous; a time warp must be continuous", ""),
        (["--angle-tolerance", "1"], "--angle-tolerance is '1'", ""),
        (["--tolerance", "-1%"], "--tolerance is '-1%'", ""),
    ],
)
def test_refusals(call: Call, fixture: Fixture, options: list[str], words: str, hint: str) -> None:
    run = call("ease", fixture("biped"), *options)
    assert words in refusal(run, 2)
    assert hint in help_line(run) + run.err


def test_tracks_that_stand_still_do_not_hide_that_keys_are_dense(call: Call, asset: Find) -> None:
    """Most tracks of Knight's clips are constant, with a key at each end: what moves has one per frame."""
    run = call("ease", asset("Knight.glb"), "-", "--clip", "Walking_A", "--dry-run")
    assert (
        "note: clip 'Walking_A': median key interval 33 ms; easing every interval makes the motion stutter" in run.err
    )


def test_notes_are_said_once_for_all_clips(call: Call, asset: Find) -> None:
    run = call("ease", asset("Fox.glb"), "-", "--dry-run", "--ease", "back-out")
    assert run.err.count("stutter") == 1
    assert run.err.startswith("note: clips 'Survey', 'Walk', 'Run': median key interval ")

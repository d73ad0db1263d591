"""The mark that makes a second run change nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from anim.gltf.document import Document
from anim.model import TimeAxis
from anim.optimization.writing import KEY, add_mark, has_mark
from tests.clips import STEP, clip, track

CLIPS = (clip(track("scale", [0, 1], [[1, 1, 1], [2, 2, 2]]), name="a"),)


def _document(**asset: Any) -> Document:
    return Document({"asset": {"version": "2.0", **asset}, "nodes": [{}]}, ())


def test_a_mark_for_these_clips_and_options_only() -> None:
    marked = add_mark(_document(), CLIPS, "options")
    assert has_mark(marked, CLIPS, "options")
    assert not has_mark(_document(), CLIPS, "options")
    assert not has_mark(marked, CLIPS, "other options")
    (only,) = CLIPS[0].tracks
    others = (
        replace(only, values=2 * only.values), replace(only, time_axis=TimeAxis(2 * only.times)), replace(only, node=1),
        replace(only, interpolation=STEP), replace(only, path="translation"),
    )  # fmt: skip
    for other in others:
        assert not has_mark(marked, [clip(other, name="a")], "options")
    assert not has_mark(marked, [replace(CLIPS[0], name="b")], "options")
    assert not has_mark(marked, [*CLIPS, *CLIPS], "options")


def test_all_else_in_asset_stays_as_it_was() -> None:
    before = _document(copyright="me", extras={"mine": [1]}, extensions={"X": {}})
    after = add_mark(before, CLIPS, "o").json
    assert {**after["asset"], "extras": {"mine": [1]}} == before.json["asset"]
    assert list(after["asset"]) == list(before.json["asset"])
    assert after["asset"]["extras"]["mine"] == [1]
    assert isinstance(after["asset"]["extras"][KEY], str)
    assert before.json["asset"]["extras"] == {"mine": [1]}  # the old document is as it was


@pytest.mark.parametrize("extras", [[1, 2], "text", 3, None])
def test_extras_that_are_no_object_stay(extras: Any) -> None:
    before = _document(extras=extras)
    assert add_mark(before, CLIPS, "o") is before
    assert not has_mark(before, CLIPS, "o")


def test_the_same_mark_every_time() -> None:
    marks = {add_mark(_document(), CLIPS, "o").json["asset"]["extras"][KEY] for _ in range(3)}
    assert len(marks) == 1


def test_a_new_mark_replaces_the_old_one() -> None:
    twice = add_mark(add_mark(_document(), CLIPS, "first"), CLIPS, "second")
    assert has_mark(twice, CLIPS, "second")
    assert list(twice.json["asset"]["extras"]) == [KEY]


def test_names_that_are_no_text() -> None:
    odd = (clip(name="\ud800"),)
    assert has_mark(add_mark(_document(), odd, "o"), odd, "o")

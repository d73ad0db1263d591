"""Words on filmstrips: where they are, and that they fit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.show.filmstrip import captions, clips
from anim.show.filmstrip.filmstrip import Extent, Strip, ViewOptions, animate_frames, filmstrip
from anim.show.filmstrip.frame_selection import FrameSelection
from tests.files import opened_fixture

LONG = "Dualwield_Melee_Attack_Chop"
FACE = np.array([[0, 1, 2]])
EXTENT = Extent(np.array([[0, 0, 0], [0.3, 0, 0], [0, 1, 0.0]]), 0.0)
SMALL = ViewOptions(height=64)


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int, int]]:
    """Texts with the x and y where they were written."""
    found: list[tuple[str, int, int]] = []
    real = captions.write

    def write(image: Any, text: str, x: int, y: int, **rest: Any) -> None:
        found.append((text, x, y))
        assert x >= 0
        assert x + captions.width(text) <= image.shape[1], f"{text} is cut off"
        real(image, text, x, y, **rest)

    monkeypatch.setattr(captions, "write", write)
    return found


def row(heading: str, count: int, label: str = "", clip: int = 0) -> Strip:
    positions = np.repeat(EXTENT.points[None], count, axis=0)
    return Strip(label, np.arange(count) / 10, positions, FACE, np.full((1, 3), 0.5), heading=heading, clip=clip)


@pytest.mark.parametrize(
    ("text", "pixels", "lines"),
    [
        (LONG, 400, [LONG]),
        (LONG, 150, ["Dualwield_Melee_", "Attack_Chop"]),
        ("Walk lbs", 45, ["Walk", "lbs"]),
        ("", 60, [""]),
    ],
)
def test_long_names_are_broken_behind_their_marks(text: str, pixels: int, lines: list[str]) -> None:
    assert captions.wrap_text(text, pixels) == lines
    assert all(captions.width(line) <= pixels for line in lines)


def test_a_name_without_marks_is_broken_anywhere() -> None:
    lines = captions.wrap_text("x" * 40, 118)
    assert "".join(lines) == "x" * 40
    assert len(lines) > 2
    assert all(captions.width(line) <= 118 for line in lines)
    assert captions.wrap_text("xxx", 1) == ["x", "x", "x"], "a letter that is too wide stands alone"


@pytest.mark.parametrize("name", ["A" * 500, "a b " * 25_000, "i" * 100_000])
def test_long_names_take_a_few_lines(name: str, written: list[tuple[str, int, int]]) -> None:
    """Headings of more than one line were drawn over what follows, and every start of a long one was measured."""
    lines = captions.wrap_text(name, 300)
    assert len(lines) == 3
    assert lines[-1].endswith("...")
    assert all(captions.width(line) <= 300 for line in lines)
    image = filmstrip([row(name, 2), row(name, 2, clip=1)], EXTENT, look=SMALL)
    places = [y for text, _, y in written if text]
    assert places == sorted(places)
    assert places[-1] + captions.LINE <= image.shape[0]
    next(animate_frames([row(name, 2), row(name, 2)], EXTENT, look=SMALL))


def test_clips_of_one_name_come_one_after_the_other_too(written: list[tuple[str, int, int]]) -> None:
    """Rows of one clip are interleaved line by line, so that methods can be compared: not those of two clips."""
    document = opened_fixture("biped")
    animations = [{**each, "name": "same"} for each in document.json["animations"]]
    renamed = replace(document, json={**document.json, "animations": animations})
    rows, extent = clips.build_strips(clips.of_document(renamed, [0, 1], ("lbs",), FrameSelection(count=40)))
    assert [each.clip for each in rows] == [0, 1]
    filmstrip(rows, extent, look=SMALL)
    places = sorted((y, x, text) for text, x, y in written if text.endswith(" s"))
    times = [float(text[:-2]) for _, _, text in places]
    assert times == [*np.round(rows[0].times, 2), *np.round(rows[1].times, 2)]


@pytest.mark.parametrize("text", ["Gehen für später", "Прыжок", "歩く", "a\nb", "\ud83d", "\0", "👋🏽", ""])
def test_names_in_any_script_are_written(text: str) -> None:
    """Letters that the font lacks are boxes; nothing is an error, and the same text gives the same pixels."""
    images = [np.full((40, 200, 3), 255, np.uint8) for _ in range(2)]
    for image in images:
        captions.write(image, text, 5, 5)
    assert (images[0] == images[1]).all()
    assert (images[0] < 255).any() == bool(text)


@pytest.mark.parametrize(("x", "y"), [(-3, -5), (25, 10), (-500, 5), (5, -500), (99, 99)])
def test_what_lies_outside_is_cut_off(x: int, y: int) -> None:
    image = np.full((20, 30, 3), 255, np.uint8)
    captions.write(image, "MMMMM", x, y)
    assert (image < 255).any() == (min(abs(x), abs(y)) < 20 and max(abs(x), abs(y)) < 50)


def test_clips_come_one_after_the_other(written: list[tuple[str, int, int]]) -> None:
    filmstrip([row("first", 60), row("second", 60, clip=1)], EXTENT, look=SMALL)
    names = [text for text, _, _ in written if not text.endswith(" s")]
    assert names == ["", "first", "second"]
    (y,) = (y for text, _, y in written if text == "second")
    heights = [y for text, _, y in written if text == "0.00 s"]
    lasts = [y for text, _, y in written if text == "5.90 s"]
    assert heights[0] < lasts[0] < y < heights[1] < lasts[1]


def test_methods_of_one_clip_are_compared_at_the_same_times(written: list[tuple[str, int, int]]) -> None:
    filmstrip([row("", 60, "lbs"), row("", 60, "dqs")], EXTENT, look=SMALL)
    first, second = [y for text, _, y in written if text == "0.00 s"]
    later = [y for text, _, y in written if text == "5.90 s"]
    assert first < second < later[0] < later[1]


def test_names_of_clips_side_by_side_don_t_overlap(written: list[tuple[str, int, int]]) -> None:
    image = next(animate_frames([row(LONG, 2), row(LONG[::-1], 2)], EXTENT, look=SMALL))
    cells = sorted({x for text, x, _ in written if text and not text.endswith(" s")})
    assert len(cells) == 2
    frame = cells[1] - cells[0]
    assert all(captions.width(text) <= frame for text, _, _ in written if text)
    assert image.shape[0] > 64 + 4 * captions.LINE


def test_many_clips_of_a_film_go_on_in_a_next_line() -> None:
    found = list(animate_frames([row(f"clip {i}", 1) for i in range(60)], EXTENT, look=SMALL))
    assert found[0].shape[1] <= 1600
    assert found[0].shape[0] > 2 * 64


def test_headings_are_the_names_of_clips() -> None:
    document = opened_fixture("biped")
    rows, _ = clips.build_strips(clips.of_document(document, [0, 1], ("lbs", "dqs"), FrameSelection(count=1)))
    assert [(each.heading, each.label) for each in rows] == [
        ("walk", "lbs"), ("walk", "dqs"), ("wave", "lbs"), ("wave", "dqs"),
    ]  # fmt: skip


@pytest.mark.parametrize("letters", [1000, 2_000_000])
def test_a_long_title_makes_no_wide_picture(letters: int) -> None:
    title = "Fox.glb " + "n" * letters
    assert captions.MAX_TITLE / 2 < captions.header_width(title, "") <= captions.MAX_TITLE
    image = np.full((60, 1200, 3), 255, np.uint8)
    captions.write_header(image, title, "", left=10, top=10)
    assert (image != 255).any()
    assert (image[:, 10 + captions.MAX_TITLE :] == 255).all()

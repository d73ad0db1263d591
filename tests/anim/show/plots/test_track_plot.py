"""Pictures of tracks: what is chosen, what is said of it, and a second file over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.errors import NotFoundError
from anim.gltf.authoring import build_document
from anim.gltf.document import Document
from anim.model import Clip, Track
from anim.operations.resample import resample
from anim.operations.selection import Selection
from anim.show.plots.figure import SMALL, TITLE, style, text_width
from anim.show.plots.track_plot import COLUMN, LIMIT, Names, track_plot
from anim.show.plots.track_selection import TrackSelection, compare_selection, select_tracks
from tests import clips
from tests.anim.show.reading import png_size, words
from tests.clips import CUBICSPLINE, STEP, about
from tests.files import REAL, mark_slow, opened_fixture, opened_path

ALL = Selection()
BUMP = np.array([[0.0, 1, 0], [1, 1, 0], [0, 1, 0]])


def document(*tracks: Track, name: str = "wave", names: tuple[str, ...] = ()) -> Document:
    skeleton = clips.skeleton([-1, 0, 1])
    if names:
        parts = skeleton.translation, skeleton.rotation, skeleton.scale
        skeleton = type(skeleton)(names, skeleton.parents, *parts)
    return build_document(skeleton, [Clip(name, tracks)])


def drawn(chosen: TrackSelection, names: Names | None = None) -> list[str]:
    return words(track_plot(chosen.shown, title="title", kind="svg", names=names))


def test_words_of_each_kind_of_track() -> None:
    said = drawn(
        select_tracks(
            document(
                clips.track("translation", [0, 1, 2], BUMP),
                clips.track("rotation", [0, 1, 2], about("y", [0, 50, 10]), node=1),
                clips.track("scale", [0, 2], [[1, 1, 1], [2, 1, 1]], STEP, node=1),
                clips.track("translation", [0, 1, 2], BUMP, CUBICSPLINE, tangents=(BUMP, BUMP), node=2),
            ),
            ALL,
            limit=LIMIT,
        )
    )
    for expected in ("title", "0", "1", "2", "x", "y", "z", "2 s", "speed, m/s", "angular speed, °/s",
                     "angle from rest, °"):  # fmt: skip
        assert expected in said, expected
    assert "translation, m  ·  linear, 3 keys" in said
    assert "rotation from rest, °  ·  linear, 3 keys" in said
    assert "scale, factor  ·  step, 2 keys" in said
    assert "translation, m  ·  cubicspline, 3 keys" in said
    assert said.count("speed, per second") == 0  # STEP has none


def test_still_tracks_give_way_to_moving_ones() -> None:
    still = clips.track("translation", [0, 1], [[1, 1, 1]] * 2)
    moving = clips.track("translation", [0, 1, 2], BUMP, node=1)
    found = select_tracks(document(still, moving), ALL, limit=LIMIT)
    assert [each.target for each in found.shown] == ["1"]
    assert (found.still, found.more) == (1, 0)
    alone = select_tracks(document(still), ALL, limit=LIMIT)
    assert [each.target for each in alone.shown] == ["0"]
    assert drawn(alone)


def test_small_motion_far_away_is_drawn_from_its_first_key() -> None:
    far = clips.track("translation", [0, 1, 2], BUMP * 0.01 + [0, 50, 0])
    assert "translation, m, from its first key  ·  linear, 3 keys" in drawn(select_tracks(document(far), ALL, limit=1))


def test_more_than_fit() -> None:
    found = select_tracks(opened_fixture("biped"), ALL, limit=5)
    assert len(found.shown) == 5
    assert found.more > 10


def test_signs_that_mean_nothing_are_not_drawn() -> None:
    q = about("x", [0, 40, 80, 120])
    q[2] *= -1
    shown = select_tracks(document(clips.track("rotation", range(4), q)), ALL, limit=1).shown[0]
    np.testing.assert_allclose(shown.track.values, about("x", [0, 40, 80, 120]), atol=1e-7)


def test_frames_are_marked_where_their_rate_is_known() -> None:
    t = np.arange(25) / 24
    walk = clips.track("translation", t, np.outer(np.sin(t), [1, 2, 3]))
    assert "fine ticks: frames at 24 fps" in drawn(select_tracks(document(walk), ALL, limit=1))
    poses = clips.track("translation", [0, 1, 2], BUMP)
    assert not any("frames" in text for text in drawn(select_tracks(document(poses), ALL, limit=1)))


def test_a_file_compared_with_itself() -> None:
    file = opened_fixture("interpolations")
    both, alone = compare_selection(select_tracks(file, ALL, limit=LIMIT), file)
    assert alone == 0
    said = drawn(both, Names("a.glb", "b.glb"))
    assert said.count("difference: none") == len(both.shown)
    assert {"a.glb", "b.glb"} <= set(said)


def test_the_difference_is_named_with_its_place() -> None:
    before = Clip("wave", (clips.track("translation", [0, 1, 2], BUMP * 0.01),))
    after = resample(before, fps=0.5)
    skeleton = clips.skeleton([-1, 0, 1])
    both, _ = compare_selection(
        select_tracks(build_document(skeleton, [before]), ALL, limit=1), build_document(skeleton, [after])
    )
    said = drawn(both, Names("a", "b"))
    assert "difference: at most 10 mm at 1 s" in said
    assert "translation, m, from its first key  ·  linear, 3 → 2 keys" not in said
    assert "translation, m  ·  linear, 3 → 2 keys" in said


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        (["face_smile", "face_blink", "face_jaw"], ["smile", "blink", "jaw"]),
        (["Key 1", "Key 2", "Key 3"], ["Key 1", "Key 2", "Key 3"]),
        (["one"], ["target 0", "target 1", "target 2"]),
        (None, ["target 0", "target 1", "target 2"]),
    ],
)
def test_weights_are_called_by_their_targets(names: list[str] | None, shown: list[str]) -> None:
    file = opened_fixture("morph_cube")
    extras = {"extras": {"targetNames": names}} if names else {}
    meshes = [{k: v for k, v in each.items() if k != "extras"} | extras for each in file.json["meshes"]]
    named = replace(file, json={**file.json, "meshes": meshes})
    found = select_tracks(named, Selection(paths=("weights",)), limit=1).shown[0].labels
    assert list(found) == shown


def test_partners_are_found_by_name_not_by_number() -> None:
    one = document(clips.track("translation", [0, 1, 2], BUMP, node=1), names=("a", "b", "c"))
    other = document(clips.track("translation", [0, 1, 2], BUMP, node=2), names=("c", "a", "b"))
    both, alone = compare_selection(select_tracks(one, ALL, limit=1), other)
    assert alone == 0
    assert both.shown[0].other is not None


def test_no_partner_at_all() -> None:
    one = document(clips.track("translation", [0, 1, 2], BUMP))
    with pytest.raises(NotFoundError, match="none of the tracks") as caught:
        compare_selection(
            select_tracks(one, ALL, limit=1), document(clips.track("translation", [0, 1, 2], BUMP), name="run")
        )
    assert caught.value.help == "its clips are 'run'"


def test_nothing_selected() -> None:
    one = document(clips.track("translation", [0, 1, 2], BUMP))
    with pytest.raises(NotFoundError, match="no track"):
        select_tracks(one, Selection(paths=("scale",)), limit=1)


@pytest.mark.parametrize("name", ["$x^2$", "骨盤", "a\x1b[0m\nb", "<&>\"'", "\ud800", "🦊" * 40])
def test_names_in_any_letters(name: str) -> None:
    file = document(clips.track("translation", [0, 1, 2], BUMP), name=name, names=(name, "", ""))
    shown = select_tracks(file, ALL, limit=1).shown
    said = words(track_plot(shown, title=name if name.isprintable() else "", kind="svg"))
    assert any(text[-3:] == shown[0].target[-3:] for text in said)
    assert png_size(track_plot(shown, title="", kind="png"))[0] > 900


@pytest.mark.parametrize("name", mark_slow(REAL, slow={*REAL} - {"Fox.glb", "InterpolationTest.gltf"}))
def test_real_files(asset: Callable[[str], Path], name: str) -> None:
    found = select_tracks(opened_path(asset(name)), ALL, limit=2)
    said = words(track_plot(found.shown, title=name, kind="svg"))
    assert name in said
    assert all(any(text[-12:] == each.target[-12:] for text in said) for each in found.shown)


@pytest.mark.parametrize("name", ["interpolations", "noop", "pointer", "morph_cube"])
def test_fixtures_as_png(name: str) -> None:
    found = select_tracks(opened_fixture(name), ALL, limit=4)
    assert png_size(track_plot(found.shown, title=name, kind="png")) > (900, 300)


def test_times_of_a_late_clip_are_kept_apart() -> None:
    """The ticks from 100 s to 100.5 s were all labeled 100."""
    late = document(clips.track("translation", [100, 100.5], BUMP[:2]))
    said = drawn(select_tracks(late, ALL, limit=1))
    assert {"100", "100.25", "100.5 s"} <= set(said)


def test_names_in_wide_letters_leave_space_for_the_next_track() -> None:
    two = [clips.track("translation", [0, 1], BUMP[:2], node=node) for node in (0, 1)]
    said = drawn(select_tracks(document(*two, names=("とても長い名前" * 6, "b", "c")), ALL, limit=2))
    name = next(each for each in said if each.startswith("…"))
    words = "translation, m  ·  linear, 2 keys"
    assert words in said
    with style("svg"):
        assert text_width(name, TITLE, "bold") + text_width(words, SMALL) < COLUMN


def test_one_key_is_singular() -> None:
    one = document(clips.track("translation", [1], [[1, 2, 3]]))
    assert "translation, m  ·  linear, 1 key" in drawn(select_tracks(one, ALL, limit=1))

"""The picture of a difference: which words it holds, and that it is the same every time."""

from __future__ import annotations

import numpy as np
import pytest

from anim.measure.error.error_curve import ErrorCurve, JointErrorCurve
from anim.show.plots.error_plot import LIMIT, error_plot
from tests.anim.show.reading import png_size, words

TIMES = np.linspace(0, 1, 5)


def _profile(name: str, top: float, *joints: str) -> ErrorCurve:
    error = top * np.array([0, 0.5, 1, 0.5, 0])
    return ErrorCurve(
        name, TIMES, error, tuple(JointErrorCurve(joint, error / (i + 1)) for i, joint in enumerate(joints))
    )


def test_clips_and_their_worst_joints_are_named() -> None:
    said = words(
        error_plot(
            [_profile("walk", 0.0042, "hand", "foot"), _profile("", 1.5, "x" * 40)], title="a → b", kind="svg", note="2"
        )
    )
    for expected in ("a → b", "2", "walk", "hand", "foot", "(no name)", f"…{'x' * 21}"):
        assert expected in said, expected
    assert "largest distance, mm over s  ·  max 4.2 mm" in said
    assert "largest distance, m over s  ·  max 1.5 m" in said


@pytest.mark.parametrize("kind", ["svg", "png"])
@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("$$", "$$"),
        (r"$\input{a}$", r"$\input{a}$"),
        ("\ud83d", "�"),
        ("a\0\nb", "a��b"),
        ("腕\u3000左", "腕\u3000左"),
        ("x" * 100_000, ""),
    ],
)
def test_names_of_any_characters_are_drawn(name: str, shown: str, kind: str) -> None:
    """Two dollars were taken for a formula, and a lone surrogate for a character of the font."""
    drawn = error_plot([_profile(name, 0.1, name, "hand")], title=name, kind=kind, note=name)
    if kind == "svg" and shown:
        assert words(drawn).count(shown) == 4


def test_as_many_clips_as_fit() -> None:
    said = words(error_plot([_profile(f"clip {i}", 0.01, "j") for i in range(LIMIT + 3)], title="t", kind="svg"))
    assert f"clip {LIMIT - 1}" in said
    assert f"clip {LIMIT}" not in said


def test_clips_that_do_not_differ_have_no_panel() -> None:
    still = [_profile(f"still {i}", 9e-12 * (i % 2)) for i in range(75)]  # rounding
    said = words(error_plot([*still, _profile("walk", 0.004, "hand")], title="t", kind="svg"))
    assert sum("largest distance" in text for text in said) == 1
    assert "walk" in said
    assert not any(text.startswith("still") for text in said)
    assert "no difference" in words(error_plot(still, title="t", kind="svg"))


@pytest.mark.parametrize("profiles", [[], [_profile("still", 0.0)], [ErrorCurve("pose", np.zeros(1), np.ones(1), ())]])
def test_nothing_to_see_is_drawn_all_the_same(profiles: list[ErrorCurve]) -> None:
    assert min(png_size(error_plot(profiles, title="t", kind="png", limit=0.5))) > 50


def test_a_limit_is_a_line_where_it_can_be_seen() -> None:
    one = [_profile("walk", 0.004, "hand")]
    plain, low, high = (error_plot(one, title="t", kind="svg", limit=limit) for limit in (None, 0.002, 0.1))
    assert plain == high
    assert plain != low


def test_the_same_picture_twice() -> None:
    one = [_profile("walk", 0.004, "hand")]
    assert error_plot(one, title="t", kind="png") == error_plot(one, title="t", kind="png")

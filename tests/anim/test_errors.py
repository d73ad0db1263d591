"""Refusals: one line that says where and what."""

from __future__ import annotations

import traceback

import pytest

from anim.errors import AnimError, FormatError, NotFoundError, RangeError, ShapeError, UnsupportedError

KINDS = (FormatError, UnsupportedError, NotFoundError, RangeError, ShapeError)


def test_the_place_grows_from_the_outside_in() -> None:
    error = FormatError("times not increasing", help="sort them")
    assert str(error) == "times not increasing"
    assert str(error.at("track 3")) == "track 3: times not increasing"
    assert str(error.at("clip 'walk'")) == "clip 'walk', track 3: times not increasing"
    assert str(error.at("walk.glb", ": ")) == "walk.glb: clip 'walk', track 3: times not increasing"
    assert (error.problem, error.help) == ("times not increasing", "sort them")


@pytest.mark.parametrize("kind", KINDS)
def test_the_tree_is_flat(kind: type[AnimError]) -> None:
    assert kind.__bases__ == (AnimError,)
    assert isinstance(kind("x").at("here"), kind)
    assert kind.__name__ in AnimError.__module__ or kind.__doc__


def test_tracebacks_show_the_help() -> None:
    error = FormatError("times not increasing", help="sort them").at("track 3")
    assert "help: sort them" in "".join(traceback.format_exception(error))
    assert not hasattr(FormatError("times not increasing"), "__notes__")

"""Time axes inside others: by hand, and against plain comparison of slices."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from anim.gltf.overlap import inside
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.gltf.writing.encoding import AccessorData
from anim.model import Clip
from fixtures.broken.pieces import animated, text
from tests.anim.gltf.writing.documents import check_same
from tests.clips import track
from tests.files import glb_of, opened

FLOAT = 5126


def _axis(*times: float) -> AccessorData:
    return _bits(np.array(times, "<f4"), bounds=(0.0, 1.0))


def _bits(numbers: ArrayLike, bounds: tuple[float, float] | None = None) -> AccessorData:
    return AccessorData(np.asarray(numbers).tobytes(), FLOAT, "SCALAR", bounds=bounds)


def test_prefixes_and_parts_lie_in_the_longest() -> None:
    axes = [_axis(0, 1), _axis(0, 1, 2, 3), _axis(2), _axis(1, 2), _axis(0, 2), _axis(2, 3, 4)]
    assert inside(axes) == {0: (1, 0), 2: (1, 8), 3: (1, 4)}


def test_what_lies_in_two_goes_to_the_first_of_the_longest() -> None:
    assert inside([_axis(0, 1, 5), _axis(0, 1, 2, 3), _axis(0, 1, 2, 4), _axis(0, 1)]) == {3: (1, 0)}


def test_an_axis_across_two_others_has_bytes_of_its_own() -> None:
    assert inside([_axis(0, 1, 2), _axis(3, 4, 5), _axis(2, 3)]) == {}


def test_bytes_that_fit_between_two_numbers_are_no_axis() -> None:
    """The needle's bytes occur in the hay at byte 2 only, then at byte 8 too."""
    needle = np.array([0x3F803F80], "<u4")
    hay = np.array([0x3F800000, 0x00003F80], "<u4")
    bounds = (0.0, 1.0)
    assert inside([_bits(hay, bounds), _bits(needle, bounds)]) == {}
    assert inside([_bits([*hay, *needle], bounds), _bits(needle, bounds)]) == {1: (0, 8)}


def test_values_are_neither_sought_nor_sought_in() -> None:
    assert inside([_bits(np.zeros(4, "<f4")), _axis(0), _bits(np.zeros(1, "<f4"))]) == {}


@given(st.lists(st.lists(st.integers(0, 3), min_size=1, max_size=6).map(tuple), unique=True, max_size=8))
def test_against_slices(rows: list[tuple[int, ...]]) -> None:
    found = inside([_axis(*row) for row in rows])
    for i, (owner, offset) in found.items():
        assert owner not in found
        assert rows[owner][offset // 4 : offset // 4 + len(rows[i])] == rows[i]
    for i, row in enumerate(rows):
        starts = range(6)
        fits = [k for k, hay in enumerate(rows) if k != i and any(hay[s : s + len(row)] == row for s in starts)]
        assert (i in found) is bool(fits)


def test_a_file_holds_the_bytes_once() -> None:
    long, short, late = [0.0, 0.5, 1.0, 1.5], [0.0, 0.5], [1.0, 1.5]
    clip = Clip(
        "walk",
        (
            track("translation", short, np.ones((2, 3))),
            track("scale", long, np.ones((4, 3))),
            track("rotation", late, np.tile((0.0, 0, 0, 1), (2, 1))),
        ),
    )
    after = opened(glb_of(writer.replace_clips(opened(text(animated())), {0: clip})))
    inputs = [after.json["accessors"][s["input"]] for s in after.json["animations"][0]["samplers"]]
    axis = inputs[1].get("byteOffset", 0)
    assert [about.get("byteOffset", 0) - axis for about in inputs] == [0, 0, 8]
    assert len(after.buffers[0].data) == 4 * (4 + 2 * 3 + 4 * 3 + 2 * 4)
    for mine, theirs in zip(clip.tracks, reader.clips(after)[0].tracks, strict=True):
        check_same(mine, theirs)

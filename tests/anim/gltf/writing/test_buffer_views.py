"""Where contents go: one plain view, or streams, by what is smaller in the end."""

from __future__ import annotations

import meshopt
import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.meshopt import storage as pack
from anim.gltf.writing.buffer_views import Layout, lay_out_views
from anim.gltf.writing.encoding import AccessorData, values
from anim.model import AccessorFormat
from tests.anim.gltf.meshopt.packing import EXTENSIONS, exponents
from tests.clips import track

KEYS = 120
RNG = np.random.default_rng(11)
EXT = EXTENSIONS[0]


def _weights(targets: int, keys: int = KEYS) -> AccessorData:
    """Filtered morph weights that go up and down, each at its own level."""
    rows = np.sin(np.arange(keys)[:, None] / 20 + np.arange(targets)) + 5.0 * np.arange(targets)
    return values(exponents(track("weights", np.arange(keys), rows)))


def _constants(count: int) -> list[AccessorData]:
    return [AccessorData(RNG.random(3).astype("<f4").tobytes(), 5126, "VEC3", key_size=12) for _ in range(count)]


def _bytes(layout: Layout, contents: list[AccessorData], number: int) -> bytes:
    """A content out of its view, by meshopt's own decoder."""
    view, offset = layout.places[number]
    found = layout.views[view]
    data = found.stored
    if found.stride:
        filter_ = None if found.filter == "NONE" else found.filter
        count = found.length // found.stride
        data = meshopt.decode_gltf_buffer(found.stored, count, found.stride, "ATTRIBUTES", filter_).tobytes()
    return data[offset : offset + len(contents[number].data)]


@pytest.mark.parametrize("extension", ["", EXT])
def test_nothing_needs_no_view(extension: str) -> None:
    assert lay_out_views([], extension, 0) == Layout((), ())


def test_plain_contents_lie_in_a_row_on_fours() -> None:
    odd = AccessorData(b"abcde", 5121, "SCALAR", key_size=1)
    contents = [odd, *_constants(2), odd]
    layout = lay_out_views(contents, "", 0)
    assert layout.places == ((0, 0), (0, 8), (0, 20), (0, 32))
    assert layout.views[0].stored == b"".join(each.data + bytes(-len(each.data) % 4) for each in contents)


@pytest.mark.parametrize("targets", [2, 8, 64])
def test_weights_are_encoded_key_by_key(targets: int) -> None:
    contents = [_weights(targets)]
    (view,) = lay_out_views(contents, EXT, 0).views
    assert (view.stride, view.length) == (4 * targets, 4 * targets * KEYS)
    assert _bytes(lay_out_views(contents, EXT, 0), contents, 0) == contents[0].data


def test_weights_too_wide_for_a_stream_are_encoded_one_by_one() -> None:
    (view,) = lay_out_views([_weights(73)], EXT, 0).views
    assert view.stride == 4


def test_contents_of_one_filter_and_size_share_a_stream() -> None:
    made = [exponents(track("translation", np.arange(KEYS), _wave(i))) for i in range(5)]
    contents = [values(each) for each in made]
    layout = lay_out_views(contents, EXT, 0)
    assert [(view.filter, view.stride) for view in layout.views] == [("EXPONENTIAL", 12)]
    assert sorted(offset for _, offset in layout.places) == [12 * KEYS * i for i in range(5)]
    assert [_bytes(layout, contents, i) for i in range(5)] == [each.data for each in contents]


def _wave(phase: int) -> Floats:
    return np.sin(np.arange(KEYS)[:, None] / 9 + phase + np.arange(3))


def test_streams_without_a_filter_where_they_pay() -> None:
    """Many equal-looking constants do, a few don't; int16 too."""
    steps = np.arange(4000, dtype="<i2")
    contents = [AccessorData(steps.tobytes(), 5122, "SCALAR", normalized=True, key_size=2), *_constants(3)]
    layout = lay_out_views(contents, EXT, 0)
    assert [(view.filter, view.stride) for view in layout.views] == [("NONE", 0), ("NONE", 4)]
    assert [_bytes(layout, contents, i) for i in range(4)] == [each.data for each in contents]


def test_what_comes_with_the_first_stream_is_counted() -> None:
    contents = [_weights(4)]
    layout = lay_out_views(contents, EXT, 0)
    gain = layout.views[0].length - len(layout.views[0].stored)
    assert lay_out_views(contents, EXT, gain).views[0].stride == 0
    assert lay_out_views(contents, EXT, gain) == lay_out_views(contents, "", 0)


def test_axes_are_in_one_stream() -> None:
    axes = [np.arange(n, dtype="<f4") / 32 for n in (300, 900)]
    contents = [AccessorData(each.tobytes(), 5126, "SCALAR", bounds=(0.0, 1.0)) for each in axes]
    layout = lay_out_views(contents, EXT, 0)
    assert [(view.stride, view.length) for view in layout.views] == [(4, 4800)]
    assert [_bytes(layout, contents, i) for i in range(2)] == [each.data for each in contents]


def test_a_value_stored_as_the_filter_gives_it_is_int16() -> None:
    """Whatever the track's own storage says."""
    row = np.tile((0.0, 0, 0, 1), (3, 1))
    codes = pack.FilteredValues("QUATERNION", meshopt.encode_filter_quat(row.astype("f4"), 8, 12).tobytes())
    for storage in (AccessorFormat(), AccessorFormat(5120, normalized=True)):
        found = values(pack.attach_codes(track("rotation", [0, 1, 2], row, storage=storage), codes))
        assert (found.component_type, found.normalized, found.element) == (5122, True, "VEC4")

"""Numbers out of files: every form of accessor, its bounds, and what is refused before anything is allocated."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest

from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Document
from anim.gltf.reading.accessors import Accessors
from fixtures.broken.pieces import animated, buffered, data_uri, text
from tests.files import opened, opened_fixture

Json = dict[str, Any]

DOCUMENT = opened_fixture("accessors")
DESCRIBED = [i for i, about in enumerate(DOCUMENT.json["accessors"]) if "extras" in about]
FLOAT, UINT8, UINT16, UINT32, INT8, INT16 = 5126, 5121, 5123, 5125, 5120, 5122
TWO_POINTS = [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize("index", DESCRIBED, ids=lambda i: DOCUMENT.json["accessors"][i]["extras"]["form"])
def test_every_form_has_the_values_that_it_says_it_has(index: int) -> None:
    about = DOCUMENT.json["accessors"][index]
    expected = np.array(about["extras"]["expected"], float)
    if about["type"].startswith("MAT"):  # described as rows, read as stored: column by column
        expected = np.swapaxes(expected, 1, 2)
    np.testing.assert_array_equal(Accessors(DOCUMENT).floats(index), expected.reshape(about["count"], -1))


def test_plain_floats_are_those_read_one_by_one() -> None:
    accessors = Accessors(DOCUMENT)
    found = accessors.plain_floats([*DESCRIBED, *DESCRIBED])
    forms = {DOCUMENT.json["accessors"][i]["extras"]["form"] for i in DESCRIBED if i not in found}
    assert found
    assert forms  # of integers, matrices, sparse and strided ones
    for index, values in found.items():
        np.testing.assert_array_equal(values, accessors.floats(index).reshape(-1))
        assert not values.flags.writeable


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_plain_floats_leaves_numbers_that_are_not_finite_to_others(number: float) -> None:
    document = _over(np.array([1, number], "<f4").tobytes(), count=2)
    assert Accessors(document).plain_floats([0]) == {}
    with pytest.raises(FormatError, match="holds NaN or infinity"):
        Accessors(document).floats(0)


def test_plain_floats_leaves_replaced_values_out() -> None:
    assert list(Accessors(_points()).plain_floats([0])) == [0]
    assert Accessors(_points()).over({0: np.zeros((2, 3))}).plain_floats([0]) == {}


def test_matrices_are_transposed_from_columns_to_rows() -> None:
    index = next(i for i in DESCRIBED if DOCUMENT.json["accessors"][i]["extras"]["form"].startswith("MAT4 of f4"))
    expected = DOCUMENT.json["accessors"][index]["extras"]["expected"]
    np.testing.assert_array_equal(Accessors(DOCUMENT).matrices(index), expected)


@pytest.mark.parametrize(
    ("component", "stored", "meant"),
    [
        (INT8, [-128, -127, 0, 127], [-1, -1, 0, 1]),
        (UINT8, [0, 51, 255], [0, 0.2, 1]),
        (INT16, [-32768, -32767, 0, 32767], [-1, -1, 0, 1]),
        (UINT16, [0, 13107, 65535], [0, 0.2, 1]),
    ],
)
def test_normalized_integers_are_fractions(component: int, stored: list[int], meant: list[float]) -> None:
    dtype = {INT8: "<i1", UINT8: "<u1", INT16: "<i2", UINT16: "<u2"}[component]
    document = _over(np.array(stored, dtype).tobytes(), count=len(stored), componentType=component, normalized=True)
    assert Accessors(document).floats(0)[:, 0].tolist() == meant
    assert Accessors(document).integers(0)[:, 0].tolist() == stored


def test_integers_refuses_floats() -> None:
    with pytest.raises(FormatError, match="accessor 0: holds floats"):
        Accessors(_points()).integers(0)


def test_stride_skips_what_lies_between() -> None:
    rows = np.array([[1, 2, 3, 99], [4, 5, 6, 99], [7, 8, 9, 99]], "<f4")
    document = _over(rows.tobytes()[:-4], count=3, type="VEC3", view={"byteStride": 16})  # the last row is cut short
    assert Accessors(document).floats(0).tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]


@pytest.mark.parametrize("base", [None, [[9, 9, 9], [8, 8, 8], [7, 7, 7]]])
@pytest.mark.parametrize("component", [UINT8, UINT16, UINT32])
def test_sparse_puts_values_over_a_base_or_over_zeros(base: list[list[int]] | None, component: int) -> None:
    document = _sparse([0, 2], [[1, 2, 3], [4, 5, 6]], base=base, component=component)
    middle = base[1] if base else [0, 0, 0]
    assert Accessors(opened(text(document))).floats(0).tolist() == [[1, 2, 3], middle, [4, 5, 6]]


@pytest.mark.parametrize("rows", [[0, 3], [1, 1], [2, 0], [0, 255]])
def test_sparse_indices_increase_and_stay_inside(rows: list[int]) -> None:
    with pytest.raises(FormatError, match="accessor 0: sparse indices"):
        Accessors(opened(text(_sparse(rows, [[1, 2, 3], [4, 5, 6]])))).raw(0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 3}, r"accessors\[0\].* ends at byte 36"),
        ({"count": 0}, r"accessors\[0\].count: is 0"),
        ({"count": -1}, r"accessors\[0\].count: is -1"),
        ({"count": 2.0}, r"accessors\[0\].count: is 2.0"),
        ({"count": True}, r"accessors\[0\].count: is a boolean"),
        ({"byteOffset": 4}, r"accessors\[0\].* ends at byte 28"),
        ({"byteOffset": 2}, r"accessors\[0\].byteOffset: is 2"),
        ({"byteOffset": -4}, r"accessors\[0\].byteOffset: is -4"),
        ({"byteOffset": 2**64}, r"accessors\[0\].* ends at byte"),
        ({"bufferView": 1}, r"accessors\[0\].bufferView: is 1"),
        ({"bufferView": -1}, r"accessors\[0\].bufferView: is -1"),
        ({"componentType": 5124}, r"accessors\[0\].componentType: is 5124"),
        ({"componentType": "5126"}, r"accessors\[0\].componentType: is a string"),
        ({"type": "VEC4"}, r"accessors\[0\].* ends at byte 32"),
        ({"type": 3}, r"accessors\[0\].type"),
        ({"normalized": 1}, r"accessors\[0\].normalized"),
        ({"sparse": []}, r"accessors\[0\].sparse"),
        ({"sparse": {"count": 1}}, r"accessors\[0\].sparse: has no 'indices'"),
    ],
)
def test_an_accessor_stays_in_its_view(change: Json, message: str) -> None:
    document = buffered(("VEC3", FLOAT, TWO_POINTS))
    document["accessors"][0] |= change
    with pytest.raises(FormatError, match=message):
        opened(text(document))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"byteLength": 25}, r"bufferViews\[0\].*ends at byte 25"),
        ({"byteLength": 0}, r"bufferViews\[0\].byteLength: is 0"),
        ({"byteOffset": 4}, r"bufferViews\[0\].*ends at byte 28"),
        ({"byteOffset": -1}, r"bufferViews\[0\].byteOffset: is -1"),
        ({"buffer": 1}, r"bufferViews\[0\].buffer: is 1"),
        ({"byteStride": 8}, r"accessors\[0\].*12 bytes.*byteStride is 8"),
        ({"byteStride": 14}, r"bufferViews\[0\].byteStride: is 14"),
        ({"byteStride": 256}, r"bufferViews\[0\].byteStride: is 256"),
        ({"byteStride": 16}, r"accessors\[0\].* ends at byte 28"),
        ({"byteOffset": 2, "byteLength": 22}, r"accessors\[0\]"),
    ],
)
def test_a_view_stays_in_its_buffer(change: Json, message: str) -> None:
    document = buffered(("VEC3", FLOAT, TWO_POINTS))
    document["bufferViews"][0] |= change
    with pytest.raises(FormatError, match=message):
        opened(text(document))


def test_a_view_at_an_odd_place_is_misaligned_for_floats() -> None:
    document = _plain(bytes(26), count=1, view={"byteOffset": 2, "byteLength": 24})
    with pytest.raises(FormatError, match=r"accessors\[0\].byteOffset: starts at byte 2"):
        opened(text(document))
    document["accessors"][0]["componentType"] = UINT16
    assert Accessors(opened(text(document))).floats(0).tolist() == [[0]]


def test_matrix_columns_start_on_four_bytes() -> None:
    stored = bytes([1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0])
    document = _over(stored, count=1, type="MAT3", componentType=UINT8)
    assert Accessors(document).floats(0).tolist() == [[1, 2, 3, 4, 5, 6, 7, 8, 9]]
    with pytest.raises(FormatError, match="ends at byte 12"):
        _over(stored[:-1], count=1, type="MAT3", componentType=UINT8)


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
def test_numbers_are_finite(number: float) -> None:
    values: list[list[float]] = [[0, 1, 2], [3, number, 5]]
    document = opened(text(buffered(("VEC3", FLOAT, values))))
    with pytest.raises(FormatError, match=r"accessor 0: holds NaN or infinity \(element 1\)"):
        Accessors(document).floats(0)


def test_unknown_types_are_refused_only_when_their_numbers_are_needed() -> None:
    document = buffered(("VEC3", FLOAT, TWO_POINTS))
    document["accessors"][0]["type"] = "VEC5"
    accessors = Accessors(opened(text(document)))
    with pytest.raises(FormatError, match="VEC5"):
        accessors.raw(0)


@pytest.mark.parametrize(
    "about",
    [
        {"type": "VEC3", "count": 4_000_000_000},
        {"type": "SCALAR", "count": 2**63},
        {"type": "MAT4", "count": 10**30},
        {"type": "SCALAR", "count": 4_000_000_000, "bufferView": 0},
        {"type": "SCALAR", "count": 10**30, "bufferView": 0},
        {"type": "SCALAR", "count": 2, "bufferView": 0, "byteOffset": 10**30},
    ],
)
def test_a_huge_count_is_refused_before_anything_is_allocated(about: Json) -> None:
    document = buffered(("VEC3", FLOAT, TWO_POINTS))
    document["accessors"] = [{"componentType": FLOAT, **about}]
    data = text(document)
    tracemalloc.start()
    with pytest.raises((FormatError, UnsupportedError)) as caught:
        Accessors(opened(data)).floats(0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e6
    assert "\n" not in str(caught.value)


def test_a_huge_sparse_count_is_refused_before_anything_is_allocated() -> None:
    document = _sparse([0, 2], [[1, 2, 3], [4, 5, 6]])
    document["accessors"][0]["sparse"]["count"] = 4_000_000_000
    with pytest.raises(FormatError, match=r"accessors\[0\].sparse.count: is 4000000000"):
        opened(text(document))


def test_zeros_without_data_take_no_memory_until_they_are_wanted() -> None:
    document = opened(text({"accessors": [{"componentType": FLOAT, "count": 2_000_000, "type": "VEC3"}]}))
    tracemalloc.start()
    raw = Accessors(document).raw(0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert raw.shape == (2_000_000, 3)
    assert not raw[::200_000].any()
    assert peak < 1e6


def test_stored_numbers_are_a_view_into_the_file_and_read_only() -> None:
    raw = Accessors(DOCUMENT).raw(DESCRIBED[0])
    assert raw.base is not None
    with pytest.raises(ValueError, match="read-only"):
        raw[0] = 1


def test_a_buffer_without_data_is_refused_only_when_its_numbers_are_needed() -> None:
    document = animated()
    del document["buffers"][0]["uri"]
    accessors = Accessors(opened(text(document)))
    with pytest.raises(FormatError, match="accessor 0, bufferView 0, buffer 0: has no data"):
        accessors.floats(0)


def test_data_hidden_by_an_unknown_extension_is_not_handled() -> None:
    document = animated()
    del document["buffers"][0]["uri"]
    document["bufferViews"][0]["extensions"] = {"ACME_zip": {"level": 9}}
    accessors = Accessors(opened(text(document)))
    with pytest.raises(UnsupportedError, match="ACME_zip"):
        accessors.floats(0)


def _points() -> Document:
    return opened(text(buffered(("VEC3", FLOAT, TWO_POINTS))))


def _plain(data: bytes, *, view: Json | None = None, **about: Any) -> Json:
    """Return one accessor over one view over one buffer of these bytes."""
    return {
        "buffers": [{"byteLength": len(data), "uri": data_uri(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data), **(view or {})}],
        "accessors": [{"bufferView": 0, "componentType": FLOAT, "type": "SCALAR", **about}],
    }


def _over(data: bytes, *, view: Json | None = None, **about: Any) -> Document:
    return opened(text(_plain(data, view=view, **about)))


def _sparse(
    rows: list[int], values: list[list[int]], *, base: list[list[int]] | None = None, component: int = UINT8
) -> Json:
    """Return a VEC3 accessor of three elements that replaces rows of a base, or of zeros."""
    places = np.array(rows, {UINT8: "<u1", UINT16: "<u2", UINT32: "<u4"}[component]).tobytes()
    vectors = [np.array(each, "<f4").tobytes() for each in (values, base or [])]
    pieces = [places + bytes(-len(places) % 4), *vectors]
    starts = np.cumsum([0, *map(len, pieces)]).tolist()
    views = [{"buffer": 0, "byteOffset": s, "byteLength": len(p)} for s, p in zip(starts, pieces, strict=False) if p]
    about: Json = {"componentType": FLOAT, "count": 3, "type": "VEC3"}
    about |= {"bufferView": 2} if base else {}
    about["sparse"] = {
        "count": len(rows),
        "indices": {"bufferView": 0, "componentType": component},
        "values": {"bufferView": 1},
    }
    data = b"".join(pieces)
    return {"accessors": [about], "bufferViews": views, "buffers": [{"byteLength": len(data), "uri": data_uri(data)}]}

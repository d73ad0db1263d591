"""Clips written into buffers that others use too: their bytes move together, or not at all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import writer
from anim.model import Clip
from fixtures.broken.pieces import animated, buffered, data_uri, text
from tests.anim.gltf.writing.documents import check_same, rewritten
from tests.clips import track
from tests.files import glb_of, opened, opened_fixture

Json = dict[str, Any]
Find = Callable[[str], Path]

FLOAT, UINT8 = 5126, 5121


def test_bytes_that_only_the_old_clip_used_leave_the_buffer() -> None:
    """mesh | times | values | mesh: the mesh's numbers move together, and the new ones come behind them."""
    content = buffered(
        ("VEC3", FLOAT, [[1, 2, 3]]),
        ("SCALAR", FLOAT, [0, 1]),
        ("VEC3", FLOAT, np.ones((2, 3))),
        ("VEC3", FLOAT, [[4, 5, 6]]),
    )
    content |= {key: value for key, value in animated().items() if key not in content}
    content["animations"][0]["samplers"] = [{"input": 1, "output": 2}]
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 3}}]}]
    document = opened(text(content))
    new = track("translation", [0.0], [[7, 8, 9]])
    after = writer.replace_clips(document, {0: Clip("walk", (new,))})
    assert after.buffers[0].data.view("<f4").tolist() == [1, 2, 3, 4, 5, 6, 0, 7, 8, 9]
    assert [view.get("byteOffset", 0) for view in after.json["bufferViews"]] == [0, 24, 0, 12]
    assert after.json["bufferViews"][2] == {"buffer": 0, "byteLength": 1}  # keeps the number of the last view


def test_a_number_in_the_middle_is_held_by_a_placeholder() -> None:
    content = buffered(
        ("SCALAR", FLOAT, [0, 1]),
        ("VEC3", FLOAT, np.ones((2, 3))),
        ("VEC3", FLOAT, np.zeros((2, 3))),
        ("VEC3", FLOAT, [[4, 5, 6]]),
    )
    content |= {key: value for key, value in animated().items() if key not in content}
    content["animations"][0]["samplers"] = [{"input": 0, "output": 1}, {"input": 0, "output": 2}]
    content["animations"][0]["channels"].append({"sampler": 1, "target": {"node": 0, "path": "scale"}})
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 3}}]}]
    document = opened(text(content))
    new = track("translation", [0.0], [[7, 8, 9]])
    after = writer.replace_clips(document, {0: Clip("walk", (new,))})
    assert after.json["accessors"][2] == {"componentType": UINT8, "count": 1, "type": "SCALAR"}
    assert Accessors(after).raw(3).tolist() == [[4, 5, 6]]


def test_placeholders_at_the_end_go() -> None:
    document = opened_fixture("interpolations")
    new = reader.clips(document)[0].tracks[0]
    after = writer.replace_clips(document, {0: Clip("move", (new,))})
    assert len(after.json["accessors"]) < len(document.json["accessors"]) - 5
    assert "type" in after.json["accessors"][-1]


def test_new_numbers_go_to_the_buffer_that_loses_most() -> None:
    content = animated()
    mesh = buffered(("VEC3", FLOAT, [[1, 2, 3]]))
    content["buffers"] = [mesh["buffers"][0], content["buffers"][0]]
    content["bufferViews"] = [view | {"buffer": 1} for view in content["bufferViews"]] + mesh["bufferViews"]
    content["accessors"] += [mesh["accessors"][0] | {"bufferView": 2}]
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 2}}]}]
    document = opened(text(content))
    after = rewritten(document)
    assert after.buffers[0] is document.buffers[0]
    assert after.json["buffers"] == content["buffers"]
    assert after.json["bufferViews"][0] == {"buffer": 1, "byteLength": 32}


def test_buffers_that_are_not_needed_are_not_opened() -> None:
    content = animated()
    content["buffers"].append({"byteLength": 99, "uri": "nowhere.bin"})
    after = rewritten(opened(text(content), {}))
    assert after.json["buffers"] == content["buffers"]


def test_a_file_without_data_gets_a_buffer() -> None:
    zeros = {"componentType": FLOAT, "count": 1}
    content = animated() | {"accessors": [{**zeros, "type": "SCALAR"}, {**zeros, "type": "VEC3"}]}
    del content["buffers"], content["bufferViews"]
    after = rewritten(opened(text(content)))
    assert after.json["bufferViews"] == [{"buffer": 0, "byteLength": 16}]
    assert after.json["buffers"] == [{"byteLength": 16}]
    assert reader.clips(opened(glb_of(after)))[0].tracks[0].values.tolist() == [[0, 0, 0]]


@pytest.mark.parametrize("strided", [True, False])
def test_a_view_shared_with_a_mesh_loses_only_the_clips_bytes(strided: bool) -> None:
    """times, values and positions are in one view: interleaved (whole rows stay), or one after another."""
    values, positions = np.ones((2, 3), "<f4"), np.array([[1, 2, 3], [4, 5, 6]], "<f4")
    parts = [np.array([[0], [1]], "<f4"), values, positions]
    if strided:
        data = np.concatenate(parts, axis=1).tobytes()
        view, starts = {"buffer": 0, "byteLength": len(data), "byteStride": 28}, [0, 4, 16]
    else:
        data = b"".join(part.tobytes() for part in parts)
        view, starts = {"buffer": 0, "byteLength": len(data)}, [0, 8, 32]
    about = {"bufferView": 0, "componentType": FLOAT, "count": 2}
    content = animated() | {"buffers": [{"byteLength": len(data), "uri": data_uri(data)}], "bufferViews": [view]}
    content["accessors"] = [
        {**about, "byteOffset": start, "type": kind}
        for start, kind in zip(starts, ("SCALAR", "VEC3", "VEC3"), strict=True)
    ]
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 2}, "mode": 0}]}]
    document = opened(text(content))
    after = rewritten(document)
    np.testing.assert_array_equal(Accessors(after).raw(2), positions)
    np.testing.assert_array_equal(reader.clips(after)[0].tracks[0].values, values)
    assert after.json["bufferViews"][0]["byteLength"] == (56 if strided else 24)
    assert after.json["accessors"][2].get("byteOffset", 0) == (16 if strided else 0)


def test_odd_starts_stay_aligned() -> None:
    """Bytes of a mesh right behind a clip's int8 values: what moves, moves by whole fours."""
    data = np.array([0, 1], "<f4").tobytes() + bytes(range(6)) + bytes([9, 9, 8, 8])
    content = animated() | {"buffers": [{"byteLength": len(data), "uri": data_uri(data)}], "nodes": [{"mesh": 0}]}
    content["bufferViews"] = [
        {"buffer": 0, "byteLength": 8},
        {"buffer": 0, "byteOffset": 8, "byteLength": 6},
        {"buffer": 0, "byteOffset": 14, "byteLength": 4},
    ]
    bytes_ = {"componentType": UINT8, "normalized": True, "type": "SCALAR"}
    content["accessors"] = [
        {"bufferView": 0, "componentType": FLOAT, "count": 2, "type": "SCALAR"},
        {"bufferView": 1, "count": 6, **bytes_},
        {"bufferView": 2, "count": 2, "componentType": 5123, "type": "SCALAR"},
        {"componentType": FLOAT, "count": 1, "type": "VEC3"},
    ]
    targets = [{"POSITION": 3}] * 3
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 3, "_N": 2}, "targets": targets, "mode": 0}]}]
    content["animations"][0]["channels"][0]["target"]["path"] = "weights"
    document = opened(text(content))
    assert Accessors(document).raw(2).tolist() == [[0x0909], [0x0808]]
    after = opened(glb_of(rewritten(document)))
    assert Accessors(after).raw(2).tolist() == [[0x0909], [0x0808]]
    check_same(reader.clips(document)[0].tracks[0], reader.clips(after)[0].tracks[0])
    assert len(after.buffers[0].data) <= 24

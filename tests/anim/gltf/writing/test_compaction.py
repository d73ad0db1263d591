"""Random files of overlapping, shared and interleaved views: after clips are replaced, everybody finds their numbers.

The model is brute force: every accessor's elements are cut out of the buffer one by one, before and after.
"""

from __future__ import annotations

import json
import struct
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.validation import buffer_layout
from anim.gltf.writing import writer
from anim.model import Clip
from fixtures.broken.pieces import glb, text
from tests.clips import track
from tests.files import glb_of, opened

Json = dict[str, Any]

SIZE = 96  # bytes of the buffer before the clip's own
TYPES = [(5121, "SCALAR"), (5123, "SCALAR"), (5126, "SCALAR"), (5121, "VEC3"), (5126, "VEC3"), (5121, "MAT2")]


@st.composite
def files(draw: st.DrawFn) -> Json:
    """A file of random views and accessors over one buffer; some accessors are a clip's, some a mesh's, some both."""
    views: list[Json] = []
    for _ in range(draw(st.integers(1, 5))):
        start = draw(st.integers(0, SIZE - 4))
        views.append({"buffer": 0, "byteOffset": start, "byteLength": draw(st.integers(4, SIZE - start))})
        if draw(st.booleans()):
            views[-1]["byteStride"] = draw(st.sampled_from([4, 8, 12, 16, 24]))
    accessors: list[Json] = []
    for _ in range(draw(st.integers(1, 7))):
        about = _accessor(draw, views)
        if about is not None:
            accessors.append(about)
    start = _add_clip_data(views, accessors)
    numbers = st.integers(0, len(accessors) - 1)
    samplers = [{"input": start, "output": start + 1}]
    samplers += [{"input": start, "output": i} for i in sorted(draw(st.sets(numbers, max_size=4)))]
    attributes = {f"_{i}": i for i in sorted(draw(st.sets(numbers, max_size=3)))}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    kept = draw(st.sampled_from([{}, {"extensions": {"ACME": {"view": draw(st.integers(0, len(views) - 1))}}}]))
    return {
        "nodes": [{}],
        "buffers": [{"byteLength": SIZE + 32}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": attributes}]}],
        "animations": [{"samplers": samplers, "channels": [channel]}],
        **kept,
    }


def _accessor(draw: st.DrawFn, views: list[Json]) -> Json | None:
    """An accessor somewhere in a random view, None where it doesn't fit."""
    number = draw(st.integers(0, len(views) - 1))
    view = views[number]
    component, kind = draw(st.sampled_from(TYPES))
    size, unit = buffer_layout.element_size(component, kind), buffer_layout.COMPONENT_SIZES[component]
    unit = 4 if kind == "MAT2" else unit
    stride = view.get("byteStride", size)
    offset = draw(st.integers(0, 12)) * unit
    most = (view["byteLength"] - offset - size) // stride + 1
    if most < 1 or stride < size or (view["byteOffset"] + offset) % unit:
        return None
    count = draw(st.integers(1, most))
    return {"bufferView": number, "byteOffset": offset, "componentType": component, "count": count, "type": kind}


def _add_clip_data(views: list[Json], accessors: list[Json]) -> int:
    views.append({"buffer": 0, "byteOffset": SIZE, "byteLength": 32})
    floats = {"bufferView": len(views) - 1, "componentType": 5126, "count": 2}
    accessors += [{**floats, "type": "SCALAR"}, {**floats, "byteOffset": 8, "type": "VEC3"}]
    return len(accessors) - 2


@settings(max_examples=150)
@given(content=files(), blob=st.binary(min_size=SIZE, max_size=SIZE), keys=st.integers(1, 9))
def test_everybody_finds_their_numbers(content: Json, blob: bytes, keys: int) -> None:
    blob += struct.pack("<8f", 0, 1, *range(6))
    document = opened(glb(text(content), blob))
    new = track("translation", range(keys), [[i, 2, 3] for i in range(keys)])
    after = writer.replace_clips(document, {0: Clip("", (new,))})
    written = opened(glb_of(after))  # which checks every bound again
    pinned = set(content["meshes"][0]["primitives"][0]["attributes"].values())
    view = content.get("extensions", {}).get("ACME", {}).get("view")
    if view is not None:
        assert _range(written, written.json["bufferViews"][view]) == _range(document, content["bufferViews"][view])
        pinned |= {view} if view < len(content["accessors"]) else set()
    used = {sampler[key] for sampler in content["animations"][0]["samplers"] for key in ("input", "output")}
    for i in (set(range(len(content["accessors"]))) - used) | pinned:
        assert _elements(written, i) == _elements(document, i)
    assert reader.clips(written)[0].tracks[0].values.tolist() == new.values.tolist()
    assert len(written.buffers[0].data) <= len(blob) + 16 * keys
    if view is None:  # a number in an unknown extension may pin a new accessor the second time
        again = writer.replace_clips(written, dict(enumerate(reader.clips(written))))
        assert glb_of(again) == glb_of(written)


def test_all_that_the_clip_alone_used_goes() -> None:
    """Two clips in views of their own, with a hole of padding between: nothing of both is left."""
    content = {
        "nodes": [{}],
        "buffers": [{"byteLength": 28}],
        "bufferViews": [{"buffer": 0, "byteLength": 6}, {"buffer": 0, "byteOffset": 8, "byteLength": 20}],
        "accessors": [
            {"bufferView": 1, "componentType": 5126, "count": 1, "type": "SCALAR"},
            {"bufferView": 1, "byteOffset": 4, "componentType": 5126, "count": 1, "type": "VEC3"},
            {"bufferView": 0, "componentType": 5121, "count": 6, "type": "SCALAR"},
        ],
        "animations": [
            {
                "samplers": [{"input": 0, "output": 1}, {"input": 0, "output": 2}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            }
        ],
    }
    document = opened(glb(text(content), bytes(28)))
    after = writer.replace_clips(document, {0: Clip("", (track("scale", [0.0], [[1, 1, 1]]),))})
    assert after.json["buffers"] == [{"byteLength": 16}]
    assert after.json["bufferViews"] == [{"buffer": 0, "byteLength": 16}]
    assert len(after.json["accessors"]) == 2


def test_a_placeholder_owns_no_byte() -> None:
    """Bytes that nobody names stay where they are, also if a placeholder of the last writing points at the first."""
    content: Json = {
        "nodes": [{}],
        "buffers": [{"byteLength": 24}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 1},
            {"buffer": 0, "byteOffset": 4, "byteLength": 4},
            {"buffer": 0, "byteOffset": 8, "byteLength": 16},
        ],
        "accessors": [
            {"bufferView": 1, "componentType": 5126, "count": 1, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 1, "type": "SCALAR"},
            {"bufferView": 2, "byteOffset": 4, "componentType": 5126, "count": 1, "type": "VEC3"},
        ],
        "meshes": [{"primitives": [{"attributes": {"_A": 0}}]}],
        "animations": [
            {
                "samplers": [{"input": 1, "output": 2}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            }
        ],
    }
    document = opened(glb(text(content), b"mine" + bytes(20)))
    after = writer.replace_clips(document, dict(enumerate(reader.clips(document))))
    assert after.buffers[0].data.tobytes()[:4] == b"mine"
    assert after.json["bufferViews"][1] == content["bufferViews"][1]


def _elements(document: Document, number: int) -> list[bytes]:
    """The bytes of each element of an accessor, cut out of the buffer."""
    about = document.json["accessors"][number]
    view = document.json["bufferViews"][about["bufferView"]]
    size = buffer_layout.element_size(about["componentType"], about["type"])
    start = view.get("byteOffset", 0) + about.get("byteOffset", 0)
    stride = view.get("byteStride", size)
    data = document.buffers[view["buffer"]].data.tobytes()
    assert start % buffer_layout.COMPONENT_SIZES[about["componentType"]] == 0
    return [data[start + i * stride : start + i * stride + size] for i in range(about["count"])]


def _range(document: Document, view: Json) -> bytes:
    start = view.get("byteOffset", 0)
    return document.buffers[0].data.tobytes()[start : start + view["byteLength"]]


def test_descriptions_stay_where_nothing_moved() -> None:
    content = {
        "nodes": [{}],
        "buffers": [{"byteLength": 44}],
        "bufferViews": [{"buffer": 0, "byteLength": 12}, {"buffer": 0, "byteOffset": 12, "byteLength": 32}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 1, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR"},
            {"bufferView": 1, "byteOffset": 8, "componentType": 5126, "count": 2, "type": "VEC3"},
        ],
        "animations": [
            {
                "samplers": [{"input": 1, "output": 2}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            }
        ],
    }
    document = opened(glb(text(content), bytes(12) + struct.pack("<8f", 0, 1, *range(6))))
    after = writer.replace_clips(document, dict(enumerate(reader.clips(document))))
    assert after.json["accessors"][0] == document.json["accessors"][0]
    assert after.json["bufferViews"][0] == document.json["bufferViews"][0]
    assert json.loads(json.dumps(after.json)) == after.json

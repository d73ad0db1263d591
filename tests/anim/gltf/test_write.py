"""Writing clips: the same keys come back, nothing else changes, nothing grows, and a second time changes nothing."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fixtures
from anim.errors import RangeError
from anim.gltf import read, write
from anim.gltf.accessors import Accessors
from anim.gltf.document import Document
from anim.model import Clip, Interpolation, Storage, Track
from fixtures.broken.pieces import animated, buffered, data_uri, glb, text
from tests.clips import STEP, track
from tests.files import REAL, glb_of, opened, opened_fixture, opened_path
from tests.fixtures.reading import decode, split
from tests.khronos import errors, needs_validator, validate_many

Json = dict[str, Any]
Find = Callable[[str], Path]

OURS = ("animations", "accessors", "bufferViews", "buffers")  # all that writing clips may change
EVERY = [*fixtures.FIXTURES, *REAL]
FLOAT, UINT8, INT8, INT16 = 5126, 5121, 5120, 5122


def rewritten(document: Document) -> Document:
    """Return the document with every clip replaced by itself."""
    return write.replace_clips(document, dict(enumerate(read.clips(document))))


@cache
def _document(path: Path) -> Document:
    return opened_path(path)


@pytest.fixture(params=EVERY)
def document(request: pytest.FixtureRequest, asset: Find) -> Document:
    """Every fixture and every real file."""
    name: str = request.param
    return opened_fixture(name) if name in fixtures.FIXTURES else _document(asset(name))


# Whole files


def test_every_track_comes_back_bit_by_bit(document: Document) -> None:
    for before, after in zip(read.clips(document), read.clips(opened(glb_of(rewritten(document)))), strict=True):
        assert before.name == after.name
        assert len(before.tracks) == len(after.tracks)
        for a, b in zip(before.tracks, after.tracks, strict=True):
            _check_same(a, b)


def test_a_second_time_changes_no_byte(document: Document) -> None:
    once = glb_of(rewritten(document))
    assert glb_of(rewritten(opened(once))) == once


def test_a_file_does_not_grow(document: Document) -> None:
    assert len(glb_of(rewritten(document))) <= len(glb_of(document))


def test_all_but_the_animations_stays_as_it_is(document: Document) -> None:
    after = rewritten(document).json
    assert list(after) == list(document.json)
    for key in set(after) - set(OURS):
        assert json.dumps(after[key]) == json.dumps(document.json[key]), key
    for before, view in zip(document.json.get("buffers", []), after.get("buffers", []), strict=True):
        assert {**before, "byteLength": 0} == {**view, "byteLength": 0}


def test_the_document_itself_is_never_changed(document: Document) -> None:
    before = json.dumps(document.json)
    rewritten(document)
    assert json.dumps(document.json) == before


def test_channels_keep_their_order_and_all_that_is_their_own(document: Document) -> None:
    for before, after in zip(
        document.json.get("animations", []), rewritten(document).json.get("animations", []), strict=True
    ):
        assert list(before) == list(after)
        assert [{**each, "sampler": 0} for each in before["channels"]] == [
            {**each, "sampler": 0} for each in after["channels"]
        ]


def test_vertices_and_matrices_are_where_they_are_looked_for(document: Document) -> None:
    after = rewritten(document)
    used = sorted(_of_meshes_and_skins(document.json))
    for index in used:
        a, b = Accessors(document).raw(index), Accessors(after).raw(index)
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
        assert {**after.json["accessors"][index], "byteOffset": 0} == {**_about(document, index), "byteOffset": 0}


def test_images_are_where_they_are_looked_for(document: Document) -> None:
    after = rewritten(document)
    for image in document.json.get("images", []):
        if "bufferView" in image:
            assert _viewed(document, image["bufferView"]) == _viewed(after, image["bufferView"])


def test_a_plain_reader_finds_the_keys(document: Document) -> None:
    """The independent route: our clips against one number at a time out of what was written."""
    if len(document.buffers) > 1:
        pytest.skip("the plain reader knows one buffer only")
    clips = read.clips(document)
    plain, blob = split(glb_of(rewritten(document)))
    for clip, animation in list(zip(clips, plain["animations"], strict=True))[:3]:
        channels = [channel for channel in animation["channels"] if "target" in channel]
        for ours, channel in list(zip(clip.tracks, channels, strict=True))[:5]:
            sampler = animation["samplers"][channel["sampler"]]
            assert decode(plain, blob, sampler["input"]) == ours.times.tolist()
            found = np.ravel(decode(plain, blob, sampler["output"])).reshape(len(ours.times), -1)
            assert sampler.get("interpolation", "LINEAR") == ours.interpolation
            if ours.in_tangents is not None:
                width = ours.values.shape[1]
                np.testing.assert_array_equal(found[:, :width], ours.in_tangents)
                np.testing.assert_array_equal(found[:, 2 * width :], ours.out_tangents)
                found = found[:, width : 2 * width]
            np.testing.assert_array_equal(found, ours.values)


@needs_validator
@pytest.mark.slow
def test_the_validator_finds_no_new_fault(asset: Find) -> None:
    documents = [opened_fixture(name) for name in fixtures.FIXTURES]
    documents += [_document(path) for path in map(asset, REAL)]
    data = [glb_of(document) for document in documents] + [glb_of(rewritten(document)) for document in documents]
    reports = validate_many(data, limit=0)
    for name, before, after in zip(EVERY, reports[: len(EVERY)], reports[len(EVERY) :], strict=True):
        for severity in (0, 1):
            new = _codes(after, severity) - _codes(before, severity)
            assert not new, (name, errors(after))


# Layout


def test_the_smallest_clip_by_hand() -> None:
    new = track("translation", [0.0, 1.5], [[0, 0, 0], [1, 2, 3]])
    after = write.replace_clips(opened(text(animated())), {0: Clip("run", (new,))})
    assert after.json["animations"] == [
        {
            "name": "run",
            "samplers": [{"input": 0, "output": 1}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        }
    ]
    assert after.json["accessors"] == [
        {"bufferView": 0, "componentType": FLOAT, "count": 2, "type": "SCALAR", "min": [0.0], "max": [1.5]},
        {"bufferView": 0, "byteOffset": 8, "componentType": FLOAT, "count": 2, "type": "VEC3"},
    ]
    assert after.json["bufferViews"] == [{"buffer": 0, "byteLength": 32}]
    assert after.json["buffers"][0]["byteLength"] == 32
    assert after.buffers[0].data.view("<f4").tolist() == [0, 1.5, 0, 0, 0, 1, 2, 3]


def test_one_input_for_each_axis_and_one_sampler_for_equal_ones() -> None:
    times, other = [0.0, 1.0], [0.0, 1.0, 2.0]
    same = [[0, 0, 0], [1, 1, 1]]
    tracks = (
        track("translation", times, same),
        track("scale", list(times), same),
        track("scale", times, same, STEP, node=1),
        track("translation", other, [*same, [2, 2, 2]], node=1),
    )
    document = opened(text(animated() | {"nodes": [{}, {}]}))
    animation = (after := write.replace_clips(document, {0: Clip("walk", tracks)})).json["animations"][0]
    assert [channel["sampler"] for channel in animation["channels"]] == [0, 0, 1, 2]
    assert [sampler["input"] for sampler in animation["samplers"]] == [0, 0, 2]
    assert [sampler["output"] for sampler in animation["samplers"]] == [1, 1, 3]
    assert animation["samplers"][1]["interpolation"] == "STEP"
    assert len(after.json["bufferViews"]) == 1


def test_defaults_are_left_out_and_bounds_are_short() -> None:
    document = opened(text(animated()))
    new = track("scale", np.array([0.1, 1 / 3, 25 / 24], np.float32), np.ones((3, 3)))
    after = write.replace_clips(document, {0: Clip("walk", (new,))}).json
    assert "interpolation" not in after["animations"][0]["samplers"][0]
    assert "byteOffset" not in after["accessors"][0]
    assert "normalized" not in after["accessors"][1]
    assert json.dumps(after["accessors"][0]["max"]) == "[1.0416666]"
    assert np.float32(after["accessors"][0]["max"][0]) == np.float32(25 / 24)


def test_keys_that_fall_together_in_float32_are_refused() -> None:
    new = track("scale", [1000.0, 1000.00001], np.ones((2, 3)))
    with pytest.raises(RangeError, match="scale of node 0: keys 0 and 1 fall together"):
        write.replace_clips(opened(text(animated())), {0: Clip("walk", (new,))})


def test_nothing_to_replace_is_nothing_to_do() -> None:
    document = opened(text(animated()))
    assert write.replace_clips(document, {}) is document


# Integers


@pytest.mark.parametrize(
    ("component", "stored"),
    [(INT8, [-128, -127, 0, 127]), (UINT8, [0, 1, 128, 255]), (INT16, [-32768, -1, 9, 32767])],
)
def test_normalized_integers_stay_integers_until_a_value_is_none(component: int, stored: list[int]) -> None:
    scale = {INT8: 127, UINT8: 255, INT16: 32767}[component]
    values = np.maximum(np.array(stored) / scale, -1.0)[None]
    storage = Storage(component, normalized=True, element="VEC4")
    document = opened(text(animated() | {"nodes": [{}]}))
    new = track("rotation", [0.0], values, storage=storage)
    after = write.replace_clips(document, {0: Clip("walk", (new,))})
    assert after.json["accessors"][1]["componentType"] == component
    assert after.json["accessors"][1]["normalized"] is True
    np.testing.assert_array_equal(read.clips(after)[0].tracks[0].values, values)
    moved = track("rotation", [0.0], values * 0.999, storage=storage)
    after = write.replace_clips(document, {0: Clip("walk", (moved,))})
    assert after.json["accessors"][1]["componentType"] == FLOAT
    np.testing.assert_array_equal(read.clips(after)[0].tracks[0].values, (values * 0.999).astype("f4"))


def test_bools_behind_a_pointer_stay_bytes() -> None:
    document = opened_fixture("pointer")
    number = next(i for i, clip in enumerate(read.clips(document)) if clip.name == "blink")
    after = rewritten(document)
    sampler = after.json["animations"][number]["samplers"][0]
    assert after.json["accessors"][sampler["output"]]["componentType"] == UINT8
    assert "normalized" not in after.json["accessors"][sampler["output"]]
    assert Accessors(after).raw(sampler["output"]).tolist() == [[1], [0], [1]]


# What belongs to others


def test_names_extras_and_extensions_survive() -> None:
    content = animated()
    own = {"extras": {"by": "me"}, "extensions": {"ACME_mark": {"text": "x"}}}
    animation = content["animations"][0]
    animation |= own
    animation["channels"][0] |= own
    animation["channels"][0]["target"] |= {"extras": [], "extensions": {"ACME_mark": "x"}}
    animation["samplers"][0] |= own
    del animation["name"]
    after = rewritten(opened(text(content))).json["animations"][0]
    assert after == {
        **animation,
        "samplers": [{key: value for key, value in animation["samplers"][0].items() if key != "interpolation"}],
    }


def test_samplers_with_something_of_their_own_are_not_shared() -> None:
    content = animated() | {"nodes": [{}, {}, {}]}
    animation = content["animations"][0]
    animation["samplers"] = [{"input": 0, "output": 1, "extras": i} for i in ("a", "a")] + [{"input": 0, "output": 1}]
    animation["channels"] = [{"sampler": i, "target": {"node": i, "path": "translation"}} for i in range(3)]
    after = rewritten(opened(text(content))).json["animations"][0]
    assert after == animation


def test_channels_without_a_known_target_stay_with_their_samplers() -> None:
    """And their samplers with the numbers that they had, though the clip's own channel used the same ones."""
    content = animated()
    strange = [{"sampler": 1, "target": {"path": "translation"}}, {"sampler": 1, "target": {"node": 0, "path": "mood"}}]
    content["animations"][0]["channels"] = [strange[0], *content["animations"][0]["channels"], strange[1]]
    content["animations"][0]["samplers"] *= 2
    document = opened(text(content))
    new = track("translation", [0, 3], [[7, 7, 7], [8, 8, 8]])
    after = write.replace_clips(document, {0: Clip("walk", (new,))})
    animation = after.json["animations"][0]
    assert [channel["sampler"] for channel in animation["channels"]] == [0, 1, 0]
    assert animation["samplers"][0] == {"input": 0, "output": 1, "interpolation": "LINEAR"}
    np.testing.assert_array_equal(Accessors(after).raw(0), Accessors(document).raw(0))
    np.testing.assert_array_equal(Accessors(after).raw(1), Accessors(document).raw(1))
    _check_same(read.clips(after)[0].tracks[0], new)


def test_a_track_that_is_gone_takes_its_channel_and_a_new_one_brings_one() -> None:
    document = opened_fixture("noop")
    number = next(i for i, clip in enumerate(read.clips(document)) if clip.name == "at_rest")
    clip = read.clips(document)[number]
    pointer = track("/materials/0/alphaCutoff", [0.0], [[1.0]], STEP)
    after = write.replace_clips(document, {number: Clip("other", (clip.tracks[2], pointer))})
    targets = [channel["target"] for channel in after.json["animations"][number]["channels"]]
    assert targets == [
        {"node": 0, "path": "scale"},
        {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}}},
    ]
    assert after.json["animations"][number]["name"] == "other"


def test_two_channels_of_one_pointer_keep_their_order() -> None:
    """Not legal, but real exporters write it."""
    content = animated()
    pointer = {"extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/emissiveFactor"}}}
    target = {"path": "pointer", **pointer}
    content["animations"][0]["channels"] = [{"sampler": i, "target": target} for i in range(2)]
    content["animations"][0]["samplers"] = [
        {"input": 0, "output": 1},
        {"input": 0, "output": 1, "interpolation": "STEP"},
    ]
    after = rewritten(opened(text(content)))
    assert [str(each.interpolation) for each in read.clips(after)[0].tracks] == ["LINEAR", "STEP"]


def test_clips_that_are_not_named_stay_as_they_are() -> None:
    document = opened_fixture("noop")
    clips = read.clips(document)
    after = write.replace_clips(document, {1: clips[1]})
    for i, animation in enumerate(document.json["animations"]):
        if i != 1:
            assert after.json["animations"][i] == animation
    for a, b in zip(clips, read.clips(after), strict=True):
        for x, y in zip(a.tracks, b.tracks, strict=True):
            _check_same(x, y)


def test_accessors_that_clips_share_with_others_stay() -> None:
    """Clip 0 and clip 1 use the same accessors, and so does (against all custom) a mesh; only clip 0 is replaced."""
    content = animated()
    content["animations"] *= 2
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 1}, "mode": 0}]}]
    document = opened(text(content))
    new = track("translation", [0.0, 2.0], [[7, 7, 7], [8, 8, 8]])
    after = write.replace_clips(document, {0: Clip("walk", (new,))})
    for index in (0, 1):
        np.testing.assert_array_equal(Accessors(after).raw(index), Accessors(document).raw(index))
    assert after.json["animations"][1] == content["animations"][1]
    assert read.clips(after)[0].tracks[0].values.tolist() == [[7, 7, 7], [8, 8, 8]]


@pytest.mark.parametrize(
    "pin",
    [
        {"extensions": {"ACME_paths": {"curves": [{"data": 1}]}}},
        {"extras": {"accessor": 1}},
        {"nodes": [{"extensions": {"ACME_paths": [1]}}]},
        {"nodes": [{"extras": 1}]},
        {"scenes": [{"extensions": {"ACME": {"deep": {"deeper": [[1]]}}}}]},
        {"materials": [{"pbrMetallicRoughness": {"extensions": {"ACME": {"lut": 1}}}}]},
        {"extensions": {"KHR_lights_punctual": {"lights": [{"extensions": {"ACME": 1}}]}}},
        {"extensions": {"KHR_lights_punctual": {"lights": [{"extras": [1]}]}}},
        {"meshes": [{"primitives": [{"attributes": {}, "extensions": {"ACME": {"attributes": {"X": 1}}}}]}]},
    ],
)
def test_whole_numbers_in_unknown_places_pin_accessors_and_views(pin: Json) -> None:
    document = opened(text(animated() | pin))
    new = track("translation", [0.0, 2.0], [[7, 7, 7], [8, 8, 8]])
    after = write.replace_clips(document, {0: Clip("walk", (new,))})
    np.testing.assert_array_equal(Accessors(after).raw(1), Accessors(document).raw(1))
    assert _viewed(after, 1) == _viewed(document, 1)
    assert after.json["accessors"][1] == document.json["accessors"][1]
    assert read.clips(after)[0].tracks[0].times.tolist() == [0, 2]


def test_numbers_in_known_places_pin_nothing() -> None:
    harmless = {
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 1}]}},
        "nodes": [{"extensions": {"KHR_lights_punctual": {"light": 1}}}],
        "extras": {"flag": True, "share": 1.0, "name": "1"},
    }
    document = opened(text(animated() | harmless))
    assert len(rewritten(document).json["accessors"]) == 2


# Buffers


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
    after = write.replace_clips(document, {0: Clip("walk", (new,))})
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
    after = write.replace_clips(document, {0: Clip("walk", (new,))})
    assert after.json["accessors"][2] == {"componentType": UINT8, "count": 1, "type": "SCALAR"}
    assert Accessors(after).raw(3).tolist() == [[4, 5, 6]]


def test_placeholders_at_the_end_go() -> None:
    document = opened_fixture("interpolations")
    new = read.clips(document)[0].tracks[0]
    after = write.replace_clips(document, {0: Clip("move", (new,))})
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
    assert read.clips(opened(glb_of(after)))[0].tracks[0].values.tolist() == [[0, 0, 0]]


@pytest.mark.parametrize("strided", [True, False])
def test_a_view_shared_with_a_mesh_loses_only_the_clips_bytes(strided: bool) -> None:
    """times, values and positions lie in one view: interleaved (only what is before the first goes), or in a row."""
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
    np.testing.assert_array_equal(read.clips(after)[0].tracks[0].values, values)
    assert after.json["bufferViews"][0]["byteLength"] == (40 if strided else 24)
    assert after.json["accessors"][2].get("byteOffset", 0) == 0


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
    _check_same(read.clips(document)[0].tracks[0], read.clips(after)[0].tracks[0])
    assert len(after.buffers[0].data) <= 24


# Random clips

WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}
SINGLE = st.floats(-1e6, 1e6, width=32)


@st.composite
def any_track(draw: st.DrawFn, target: tuple[int, str]) -> Track:
    """Any track on a node, its numbers as a file can hold them."""
    node, path = target
    mode = draw(st.sampled_from(Interpolation))
    cubic = mode is Interpolation.CUBICSPLINE
    times = sorted(draw(st.sets(st.floats(0, 1e4, width=32), min_size=1 + cubic, max_size=5)))
    count = len(times) * WIDTHS[path]
    rows = [draw(st.lists(SINGLE, min_size=count, max_size=count)) for _ in range(3 if cubic else 1)]
    keys, *sides = (np.reshape(row, (len(times), WIDTHS[path])) for row in rows)
    if path == "rotation":
        keys[:, 3] += 4e6
        keys = (keys / np.linalg.norm(keys, axis=1, keepdims=True)).astype(np.float32)
    return track(path, times, keys, mode, node=node, tangents=(sides[0], sides[1]) if cubic else None)


@st.composite
def any_clip(draw: st.DrawFn) -> Clip:
    """Any clip on three nodes."""
    targets = draw(st.sets(st.tuples(st.integers(0, 2), st.sampled_from(sorted(WIDTHS))), min_size=1, max_size=4))
    return Clip(draw(st.text(max_size=5)), tuple(draw(any_track(target)) for target in sorted(targets)))


@settings(max_examples=60, deadline=None)
@given(clips=st.lists(any_clip(), min_size=1, max_size=2), again=any_clip())
def test_random_clips_come_back(clips: list[Clip], again: Clip) -> None:
    content = animated() | {"nodes": [{}, {}, {}]}
    content["animations"] = [content["animations"][0]] * len(clips)
    document = write.replace_clips(opened(text(content)), dict(enumerate(clips)))
    document = opened(glb_of(write.replace_clips(document, {0: again})))
    for before, after in zip([again, *clips[1:]], read.clips(document), strict=True):
        assert before.name == after.name
        found = {each.target: each for each in after.tracks}
        assert len(found) == len(before.tracks)
        for each in before.tracks:
            _check_same(each, found[each.target])
    used = {s[key] for a in document.json["animations"] for s in a["samplers"] for key in ("input", "output")}
    sizes = sum(Accessors(document).raw(i).nbytes for i in used)
    assert len(document.buffers[0].data) == sizes
    assert glb_of(rewritten(document)) == glb_of(opened(glb_of(rewritten(document))))


@needs_validator
@settings(max_examples=1, deadline=None)
@given(clips=st.lists(any_clip(), min_size=40, max_size=40))
def test_random_clips_are_valid(clips: list[Clip]) -> None:
    content = glb(text(animated() | {"nodes": [{}, {}, {}], "scenes": [{"nodes": [0, 1, 2]}]}))
    written = [glb_of(write.replace_clips(opened(content), {0: clip})) for clip in clips]
    assert [errors(report) for report in validate_many(written)] == [[]] * len(clips)


def _check_same(a: Track, b: Track) -> None:
    """Two tracks that say the same, bit by bit."""
    assert (a.node, a.path, a.pointer, a.interpolation) == (b.node, b.path, b.pointer, b.interpolation)
    assert (a.storage.component_type, a.storage.normalized) == (b.storage.component_type, b.storage.normalized)
    for name in ("times", "values", "in_tangents", "out_tangents"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None) == (y is None)
        if x is not None:
            np.testing.assert_array_equal(x, y)


def _about(document: Document, accessor: int) -> Json:
    about: Json = document.json["accessors"][accessor]
    return about


def _viewed(document: Document, view: int) -> bytes:
    place = document.json["bufferViews"][view]
    start = place.get("byteOffset", 0)
    data = document.buffers[place["buffer"]].data
    return bytes(data[start : start + place["byteLength"]].tobytes())


def _of_meshes_and_skins(content: Json) -> set[int]:
    primitives = [primitive for mesh in content.get("meshes", []) for primitive in mesh["primitives"]]
    maps: Sequence[Json] = [p["attributes"] for p in primitives] + [t for p in primitives for t in p.get("targets", [])]
    found = set(chain.from_iterable(each.values() for each in maps))
    found |= {primitive["indices"] for primitive in primitives if "indices" in primitive}
    return found | {s["inverseBindMatrices"] for s in content.get("skins", []) if "inverseBindMatrices" in s}


def _codes(report: Json, severity: int) -> Counter[str]:
    return Counter(issue["code"] for issue in report["issues"]["messages"] if issue["severity"] == severity)

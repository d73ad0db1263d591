"""Clips written by hand: what stands in the JSON, integers that stay integers, and what belongs to others."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from anim.errors import AnimError, NotFoundError, ShapeError, UnsupportedError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import encoding, writer
from anim.model import AccessorFormat, Clip, Track
from anim.operations.resample import resample
from fixtures.broken.pieces import animated, text
from tests import many
from tests.anim.gltf.writing.documents import check_same, rewritten
from tests.clips import STEP, track
from tests.files import glb_of, opened, opened_fixture

Find = Callable[[str], Path]

FLOAT, UINT8, INT8, INT16 = 5126, 5121, 5120, 5122


def test_the_smallest_clip_by_hand() -> None:
    new = track("translation", [0.0, 1.5], [[0, 0, 0], [1, 2, 3]])
    after = writer.replace_clips(opened(text(animated())), {0: Clip("run", (new,))})
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
    animation = (after := writer.replace_clips(document, {0: Clip("walk", tracks)})).json["animations"][0]
    assert [channel["sampler"] for channel in animation["channels"]] == [0, 0, 1, 2]
    assert [sampler["input"] for sampler in animation["samplers"]] == [0, 0, 2]
    assert [sampler["output"] for sampler in animation["samplers"]] == [1, 1, 3]
    assert animation["samplers"][1]["interpolation"] == "STEP"
    assert len(after.json["bufferViews"]) == 1


def test_defaults_are_left_out_and_bounds_are_short() -> None:
    document = opened(text(animated()))
    new = track("scale", np.array([0.1, 1 / 3, 25 / 24], np.float32), np.ones((3, 3)))
    after = writer.replace_clips(document, {0: Clip("walk", (new,))}).json
    assert "interpolation" not in after["animations"][0]["samplers"][0]
    assert "byteOffset" not in after["accessors"][0]
    assert "normalized" not in after["accessors"][1]
    assert json.dumps(after["accessors"][0]["max"]) == "[1.0416666]"
    assert np.float32(after["accessors"][0]["max"][0]) == np.float32(25 / 24)


def test_keys_that_fall_together_in_float32_are_refused() -> None:
    new = track("scale", [1000.0, 1000.00001], np.ones((2, 3)))
    with pytest.raises(UnsupportedError, match="scale of node 0: keys 0 and 1 fall together"):
        writer.replace_clips(opened(text(animated())), {0: Clip("walk", (new,))})


def test_nothing_to_replace_is_nothing_to_do() -> None:
    document = opened(text(animated()))
    assert writer.replace_clips(document, {}) is document


# Integers


@pytest.mark.parametrize(
    ("component", "stored"),
    [(INT8, [-128, -127, 0, 127]), (UINT8, [0, 1, 128, 255]), (INT16, [-32768, -1, 9, 32767])],
)
def test_normalized_integers_stay_integers_until_a_value_is_none(component: int, stored: list[int]) -> None:
    scale = {INT8: 127, UINT8: 255, INT16: 32767}[component]
    values = np.maximum(np.array(stored) / scale, -1.0)[None]
    storage = AccessorFormat(component, normalized=True, element="VEC4")
    document = opened(text(animated() | {"materials": [{}]}))
    color = "/materials/0/pbrMetallicRoughness/baseColorFactor"
    new = track(color, [0.0], values, storage=storage)
    after = writer.replace_clips(document, {0: Clip("walk", (new,))})
    assert after.json["accessors"][1]["componentType"] == component
    assert after.json["accessors"][1]["normalized"] is True
    np.testing.assert_array_equal(reader.clips(after)[0].tracks[0].values, values)
    moved = track(color, [0.0], values * 0.999, storage=storage)
    after = writer.replace_clips(document, {0: Clip("walk", (moved,))})
    assert after.json["accessors"][1]["componentType"] == FLOAT
    np.testing.assert_array_equal(reader.clips(after)[0].tracks[0].values, (values * 0.999).astype("f4"))


def test_bools_behind_a_pointer_stay_bytes() -> None:
    document = opened_fixture("pointer")
    number = next(i for i, clip in enumerate(reader.clips(document)) if clip.name == "blink")
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
    after = writer.replace_clips(document, {0: Clip("walk", (new,))})
    animation = after.json["animations"][0]
    assert [channel["sampler"] for channel in animation["channels"]] == [0, 1, 0]
    assert animation["samplers"][0] == {"input": 0, "output": 1, "interpolation": "LINEAR"}
    np.testing.assert_array_equal(Accessors(after).raw(0), Accessors(document).raw(0))
    np.testing.assert_array_equal(Accessors(after).raw(1), Accessors(document).raw(1))
    check_same(reader.clips(after)[0].tracks[0], new)


def test_a_track_that_is_gone_takes_its_channel_and_a_new_one_brings_one() -> None:
    document = opened_fixture("noop")
    number = next(i for i, clip in enumerate(reader.clips(document)) if clip.name == "at_rest")
    clip = reader.clips(document)[number]
    pointer = track("/materials/0/alphaCutoff", [0.0], [[1.0]], STEP)
    after = writer.replace_clips(document, {number: Clip("other", (clip.tracks[2], pointer))})
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
    assert [str(each.interpolation) for each in reader.clips(after)[0].tracks] == ["LINEAR", "STEP"]


def test_clips_that_are_not_named_stay_as_they_are() -> None:
    document = opened_fixture("noop")
    clips = reader.clips(document)
    after = writer.replace_clips(document, {1: clips[1]})
    for i, animation in enumerate(document.json["animations"]):
        if i != 1:
            assert after.json["animations"][i] == animation
    for a, b in zip(clips, reader.clips(after), strict=True):
        for x, y in zip(a.tracks, b.tracks, strict=True):
            check_same(x, y)


@pytest.mark.parametrize("number", [-1, 1, 99])
def test_a_clip_that_is_not_there_is_said(number: int) -> None:
    new = track("translation", [0.0, 1.5], [[0, 0, 0], [1, 2, 3]])
    with pytest.raises(NotFoundError, match=f"no clip #{number} .the file has 1, from #0 on"):
        writer.replace_clips(opened(text(animated())), {number: Clip("run", (new,))})


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (track("scale", [0], [[1, 1, 1]], node=999), "scale of node 999: there is no node 999"),
        (track("weights", [0], [[1]], node=0), "weights of node 0: has 1 weights for 0 morph targets"),
    ],
)
def test_targets_that_the_file_lacks_are_refused(made: Track, message: str) -> None:
    document = opened_fixture("interpolations")
    (clip,) = reader.clips(document)
    with pytest.raises(AnimError, match=message):
        writer.replace_clips(document, {0: Clip(clip.name, (made,))})


def test_clips_are_replaced_by_number() -> None:
    document = opened_fixture("interpolations")
    with pytest.raises(ShapeError, match="key 'walk'"):
        writer.replace_clips(document, {"walk": reader.clips(document)[0]})  # type: ignore[dict-item]


def test_the_new_json_is_nobody_elses() -> None:
    document = opened(text(animated() | {"extras": {"by": [{"me": 1}]}}))
    before = json.dumps(document.json)
    after = rewritten(document)
    after.json["extras"]["by"][0]["me"] = 2
    after.json["nodes"][0]["name"] = "new"
    after.json["asset"]["generator"] = "new"
    after.json["animations"][0]["channels"][0]["target"]["path"] = "scale"
    assert json.dumps(document.json) == before


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_documents_can_be_sent_to_other_processes(copied: Callable[[Document], Document]) -> None:
    for name in ("arm", "gltf_embedded", "gltf_external"):
        document = opened_fixture(name)
        for each in (document, rewritten(document)):
            assert glb_of(copied(each)) == glb_of(each)


def test_clips_are_asked_for_by_whole_numbers() -> None:
    document = opened(text(animated()))
    (clip,) = reader.clips(document)
    assert writer.replace_clips(document, {np.int64(0): clip}).json["animations"]  # type: ignore[dict-item]
    with pytest.raises(ShapeError, match="clips has the key True"):
        writer.replace_clips(document, {True: clip})
    with pytest.raises(ShapeError, match="a clip is None"):
        writer.replace_clips(document, {0: None})  # type: ignore[dict-item]


def test_equal_tracks_are_encoded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened(many.channels(50))
    clips = {i: resample(clip, fps=4) for i, clip in enumerate(reader.clips(document))}
    encoded: list[Track] = []

    def values(track: Track) -> encoding.AccessorData:
        encoded.append(track)
        return encode(track)

    encode = encoding.values
    monkeypatch.setattr(encoding, "values", values)
    after = reader.clips(writer.replace_clips(document, clips))
    assert len(encoded) == 1  # of ten nodes in five clips
    assert [len(clip.key_times) for clip in after] == [5] * 5

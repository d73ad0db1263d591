"""Buffers that only stand for bytes: used again, grown, emptied and dropped; and files that other tools compressed."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Buffer, Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import writer
from anim.gltf.writing.byte_ranges import difference
from anim.gltf.writing.compaction import referenced_ranges
from anim.model import Clip
from fixtures.broken.pieces import animated, data_uri, glb, text
from tests.anim.gltf.meshopt.packing import EXTENSIONS, exponents, filtered_clips, gltfpack, packed, streams
from tests.anim.gltf.writing.documents import check_same, rewritten
from tests.clips import track
from tests.files import glb_of, opened, opened_path
from tests.khronos import errors, needs_validator, validate_many

Json = dict[str, Any]
Find = Callable[[str], Path]

EXT, KHR = EXTENSIONS
KEYS = 100
TIMES = np.sort(np.random.default_rng(2).random(KEYS)).astype(np.float32)  # too wild for the codec


def _clip(name: str, phase: float) -> Clip:
    rows = np.sin(np.arange(KEYS)[:, None] / 15 + phase + np.arange(3))
    return Clip(name, (track("translation", TIMES, rows),))


def _written(document: Document, clips: dict[int, Clip], extension: str) -> tuple[dict[int, Clip], Document]:
    """Clips as the filter keeps them, and the document with them, read anew."""
    made = {number: Clip(clip.name, (exponents(clip.tracks[0]),)) for number, clip in clips.items()}
    return made, opened(glb_of(writer.replace_clips(document, made, extension=extension)))


def _two(extension: str) -> tuple[dict[int, Clip], Document]:
    """Two clips, written one after the other, so that each has a view of its own."""
    content = animated() | {"nodes": [{}], "animations": animated()["animations"] * 2}
    first, document = _written(opened(glb_of(opened(text(content)))), {0: _clip("walk", 0)}, extension)
    second, document = _written(document, {1: _clip("run", 1)}, extension)
    return first | second, document


def _check(clips: dict[int, Clip], document: Document) -> None:
    found = reader.clips(document)
    for number, clip in clips.items():
        check_same(clip.tracks[0], found[number].tracks[0])


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_a_second_clip_grows_the_fallback_buffer(extension: str) -> None:
    clips, document = _two(extension)
    spans = [
        (view.get("byteOffset", 0), view["byteLength"]) for view in document.json["bufferViews"] if "extensions" in view
    ]
    assert sorted(spans) == [(0, 12 * KEYS), (12 * KEYS, 12 * KEYS)]
    assert len(document.json["buffers"]) == 2
    assert document.json["buffers"][1]["byteLength"] == 24 * KEYS
    assert document.json["extensionsUsed"] == [extension]
    _check(clips, document)


@pytest.mark.parametrize("number", [0, 1])
def test_what_a_clip_stood_for_is_taken_back(number: int) -> None:
    clips, document = _two(EXT)
    after = opened(glb_of(writer.replace_clips(document, {number: clips[number]})))
    assert after.json["buffers"][1] == {"byteLength": 12 * KEYS, "extensions": {EXT: {"fallback": True}}}
    (view,) = [view for view in after.json["bufferViews"] if "extensions" in view]
    assert view.get("byteOffset", 0) == 0
    _check(clips, after)


def test_the_last_packed_clip_takes_the_buffer_and_the_names_along() -> None:
    clips, document = _two(EXT)
    document = replace(document, json={**document.json, "extensionsUsed": ["ACME_a", EXT, "ACME_b"]})
    after = writer.replace_clips(document, clips)
    assert len(after.buffers) == len(after.json["buffers"]) == 1
    assert after.json["extensionsUsed"] == ["ACME_a", "ACME_b"]
    assert "extensionsRequired" not in after.json
    _check(clips, after)


def test_an_extension_changed_for_the_other_takes_its_buffer_over() -> None:
    clips, document = _two(EXT)
    raw = filtered_clips(list(clips.values()))
    after = writer.replace_clips(document, raw, extension=KHR)
    assert after.json["buffers"][1] == {"byteLength": 24 * KEYS, "extensions": {KHR: {"fallback": True}}}
    assert after.json["extensionsUsed"] == after.json["extensionsRequired"] == [KHR]
    assert len(after.json["buffers"]) == 2


def test_extensions_never_share_a_buffer() -> None:
    clips, document = _two(EXT)
    new, after = _written(document, {1: _clip("run", 2)}, KHR)
    assert [list(each.get("extensions", {})) for each in after.json["buffers"]] == [[], [EXT], [KHR]]
    assert after.json["extensionsUsed"] == [EXT, KHR]
    _check(clips | new, after)
    back = writer.replace_clips(after, {0: clips[0]})  # the first fallback is empty now, but not the last buffer
    assert [each["byteLength"] for each in back.json["buffers"][1:]] == [4, 12 * KEYS]
    assert back.json["extensionsUsed"] == [EXT, KHR]
    _check({**clips, **new}, opened(glb_of(back)))
    assert len(writer.replace_clips(back, new).json["buffers"]) == 2


@pytest.mark.parametrize(
    "change", [lambda buffer: buffer.pop("extensions"), lambda buffer: buffer.update(extras={"by": "me"})]
)
def test_a_fallback_buffer_of_another_tool_is_used_as_it_is(change: Callable[[Json], object]) -> None:
    """Unmarked, as the extension allows; or with something of its own."""
    clips, document = _two(EXT)
    json = copy.deepcopy(document.json)
    change(json["buffers"][1])
    new, after = _written(replace(document, json=json), {1: _clip("run", 3)}, EXT)
    assert after.json["buffers"][1] == json["buffers"][1]
    _check(clips | new, after)


def test_a_buffer_that_strangers_point_into_stays() -> None:
    clips, document = _two(EXT)
    json = {**document.json, "extensions": {"ACME_slices": {"buffer": 1, "at": "3.5"}}}
    new, after = _written(replace(document, json=json), {0: _clip("walk", 3)}, EXT)
    assert after.json["buffers"][1] == document.json["buffers"][1]
    assert len(after.json["buffers"]) == 3
    _check(clips | new, after)


def test_true_fallback_data_is_never_written_into() -> None:
    """A second buffer holds what the views decode to; new bytes go to the first, though the second loses more."""
    clips, document = _two(EXT)
    decoded = np.zeros(24 * KEYS, np.uint8)
    json = copy.deepcopy(document.json)
    json["buffers"][1]["uri"] = data_uri(decoded.tobytes())
    full = Buffer(24 * KEYS, json["buffers"][1]["uri"], lambda: decoded)
    document = Document(json, (document.buffers[0], full))
    after = writer.replace_clips(document, {0: clips[0]})
    assert {view["buffer"] for view in after.json["bufferViews"] if "extensions" not in view} == {0}
    assert after.json["buffers"][1]["byteLength"] == 12 * KEYS
    _check(clips, opened(glb_of(after)))
    assert len(rewritten(after).json["buffers"]) == 1


def test_a_file_without_data_gets_both_buffers() -> None:
    zeros = {"componentType": 5126, "count": 1}
    content = animated() | {"accessors": [{**zeros, "type": "SCALAR"}, {**zeros, "type": "VEC3"}]}
    del content["buffers"], content["bufferViews"]
    clips, after = _written(opened(glb(text(content))), {0: _clip("walk", 0)}, KHR)
    assert ["extensions" in each for each in after.json["buffers"]] == [False, True]
    _check(clips, after)


# Files that gltfpack compressed


@pytest.fixture(scope="module")
def fox(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Document:
    """Fox with meshes and animations compressed by gltfpack."""
    asset: Find = request.getfixturevalue("asset")
    return opened_path(gltfpack(asset("Fox.glb"), tmp_path_factory.mktemp("fox"), "-cc", "-kn", "-noq"))


@needs_validator
@pytest.mark.parametrize("extension", ["", *EXTENSIONS])
def test_meshes_that_gltfpack_compressed_stay_beside_our_clips(fox: Document, extension: str) -> None:
    clips, after = packed(fox, extension) if extension else (dict(enumerate(reader.clips(fox))), rewritten(fox))
    after = opened(glb_of(after))
    primitive = fox.json["meshes"][0]["primitives"][0]
    for number in (
        *primitive["attributes"].values(),
        primitive["indices"],
        fox.json["skins"][0]["inverseBindMatrices"],
    ):
        np.testing.assert_array_equal(Accessors(after).raw(number), Accessors(fox).raw(number))
    for number, clip in clips.items():
        found = {each.target: each for each in reader.clips(after)[number].tracks}
        for each in clip.tracks:
            np.testing.assert_array_equal(each.values, found[each.target].values)
    assert [errors(report) for report in validate_many([glb_of(after)])] == [[]]
    assert EXT in after.json["extensionsRequired"]


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_clips_packed_over_gltfpacks_leave_no_dead_byte(fox: Document, extension: str) -> None:
    _, after = packed(fox, extension)
    after = opened(glb_of(after))
    for number, buffer in enumerate(after.json["buffers"]):
        used = [span for view in after.json["bufferViews"] for at, span in referenced_ranges(view) if at == number]
        gaps = difference([(0, buffer["byteLength"])], used)
        assert all(end - start < 4 for start, end in gaps)
    assert streams(after, extension)

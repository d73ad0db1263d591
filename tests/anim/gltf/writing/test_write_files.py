"""Whole files rewritten: the same keys come back, nothing else changes, nothing grows, and twice is as once."""

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

import fixtures
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from tests.anim.gltf.writing.documents import check_same, rewritten, viewed
from tests.files import REAL, glb_of, mark_slow, opened, opened_fixture, opened_path
from tests.fixtures.reading import decode, split
from tests.khronos import errors, needs_validator, validate_many

Json = dict[str, Any]
Find = Callable[[str], Path]

OURS = ("animations", "accessors", "bufferViews", "buffers")  # all that writing clips may change
EVERY = [*fixtures.FIXTURES, *REAL]


@cache
def _document(path: Path) -> Document:
    return opened_path(path)


@pytest.fixture(params=mark_slow(EVERY))
def document(request: pytest.FixtureRequest, asset: Find) -> Document:
    """Every fixture and every real file."""
    name: str = request.param
    return opened_fixture(name) if name in fixtures.FIXTURES else _document(asset(name))


def test_every_track_comes_back_bit_by_bit(document: Document) -> None:
    for before, after in zip(reader.clips(document), reader.clips(opened(glb_of(rewritten(document)))), strict=True):
        assert before.name == after.name
        assert len(before.tracks) == len(after.tracks)
        for a, b in zip(before.tracks, after.tracks, strict=True):
            check_same(a, b)


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
            assert viewed(document, image["bufferView"]) == viewed(after, image["bufferView"])


def test_a_plain_reader_finds_the_keys(document: Document) -> None:
    """The independent route: our clips against one number at a time out of what was written."""
    if len(document.buffers) > 1:
        pytest.skip("the plain reader knows one buffer only")
    clips = reader.clips(document)
    plain, blob = split(glb_of(rewritten(document)))
    for clip, animation in list(zip(clips, plain.get("animations", []), strict=True))[:3]:
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


def _about(document: Document, accessor: int) -> Json:
    about: Json = document.json["accessors"][accessor]
    return about


def _of_meshes_and_skins(content: Json) -> set[int]:
    primitives = [primitive for mesh in content.get("meshes", []) for primitive in mesh["primitives"]]
    maps: Sequence[Json] = [p["attributes"] for p in primitives] + [t for p in primitives for t in p.get("targets", [])]
    found = set(chain.from_iterable(each.values() for each in maps))
    found |= {primitive["indices"] for primitive in primitives if "indices" in primitive}
    return found | {s["inverseBindMatrices"] for s in content.get("skins", []) if "inverseBindMatrices" in s}


def _codes(report: Json, severity: int) -> Counter[str]:
    return Counter(issue["code"] for issue in report["issues"]["messages"] if issue["severity"] == severity)

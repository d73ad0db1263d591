"""Accessors of replaced tracks: indices, names, and those shared with others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import writer
from anim.model import Clip
from fixtures.broken.pieces import animated, text
from tests.anim.gltf.writing.documents import rewritten, viewed
from tests.calls import count_calls
from tests.clips import track
from tests.files import opened

Json = dict[str, Any]


def test_accessors_that_clips_share_with_others_stay() -> None:
    """Clip 0 and clip 1 use the same accessors, and so does (against all custom) a mesh; only clip 0 is replaced."""
    content = animated()
    content["animations"] *= 2
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 1}, "mode": 0}]}]
    document = opened(text(content))
    new = track("translation", [0.0, 2.0], [[7, 7, 7], [8, 8, 8]])
    after = writer.replace_clips(document, {0: Clip("walk", (new,))})
    for index in (0, 1):
        np.testing.assert_array_equal(Accessors(after).raw(index), Accessors(document).raw(index))
    assert after.json["animations"][1] == content["animations"][1]
    assert reader.clips(after)[0].tracks[0].values.tolist() == [[7, 7, 7], [8, 8, 8]]


@pytest.mark.parametrize(
    "pin",
    [
        {"extensions": {"ACME_paths": {"curves": [{"data": 1}]}}},
        {"nodes": [{"extensions": {"ACME_paths": [1]}}]},
        {"scenes": [{"extensions": {"ACME": {"deep": {"deeper": [[1]]}}}}]},
        {"materials": [{"pbrMetallicRoughness": {"extensions": {"ACME": {"lut": 1}}}}]},
        {"extensions": {"KHR_lights_punctual": {"lights": [{"extensions": {"ACME": 1}}]}}},
        {"meshes": [{"primitives": [{"attributes": {}, "extensions": {"ACME": {"attributes": {"X": 1}}}}]}]},
    ],
)
def test_whole_numbers_in_unknown_places_pin_accessors_and_views(pin: Json) -> None:
    document = opened(text(animated() | pin))
    new = track("translation", [0.0, 2.0], [[7, 7, 7], [8, 8, 8]])
    after = writer.replace_clips(document, {0: Clip("walk", (new,))})
    np.testing.assert_array_equal(Accessors(after).raw(1), Accessors(document).raw(1))
    assert viewed(after, 1) == viewed(document, 1)
    assert after.json["accessors"][1] == document.json["accessors"][1]
    assert reader.clips(after)[0].tracks[0].times.tolist() == [0, 2]


def test_numbers_in_known_places_pin_nothing() -> None:
    harmless = {
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 1}]}},
        "nodes": [{"extensions": {"KHR_lights_punctual": {"light": 1}}}],
        "extras": {"id": 1, "buffer": 0, "all": [0, {"bufferView": 1}]},
        "scenes": [{"extensions": {"ACME": {"flag": True, "share": 0.5, "name": "1", "extras": {"id": 1}}}}],
    }
    document = opened(text(animated() | harmless))
    assert len(rewritten(document).json["accessors"]) == 2


def _named(document: Document, names: Mapping[int, str]) -> Document:
    """The document with names and extras of accessors."""
    accessors = [
        {**about, "name": names[i], "extras": [i]} if i in names else about
        for i, about in enumerate(document.json["accessors"])
    ]
    return replace(document, json={**document.json, "accessors": accessors})


def test_name_extras_and_number_of_an_accessor_stay_where_its_track_is_replaced() -> None:
    document = _named(opened(text(animated())), {0: "times", 1: "path"})
    new = track("translation", [0.0, 1.0, 3.0], [[7, 7, 7], [8, 8, 8], [9, 9, 9]])
    after = writer.replace_clips(document, {0: Clip("walk", (new,))})
    assert [(each["name"], each["extras"]) for each in after.json["accessors"]] == [("times", [0]), ("path", [1])]
    assert [each["count"] for each in after.json["accessors"]] == [3, 3]


def test_names_of_accessors_go_where_two_become_one() -> None:
    content = animated()
    content["animations"] *= 2
    content["accessors"] *= 2
    content["animations"][1] = {**content["animations"][1], "samplers": [{"input": 2, "output": 3}]}
    document = _named(opened(text(content)), {1: "one", 3: "other"})
    after = rewritten(document)
    assert len(after.json["accessors"]) == 2
    assert not any("name" in each for each in after.json["accessors"])


def test_keys_that_many_tracks_share_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    content = animated()
    content["nodes"] = [{}] * 3
    content["scenes"] = [{"nodes": [0, 1, 2]}]
    one, other = (track("translation", [0.0, 2.0], [[7, 7, x], [8, 8, 8]]) for x in (7, 6))
    new = Clip("walk", (one, one.on_node(1), other.on_node(2)))
    counted = count_calls(monkeypatch, writer, "_value_digest")
    after = writer.replace_clips(opened(text(content)), {0: new})
    assert len(counted) == 2
    assert [each.values.tolist() for each in reader.clips(after)[0].tracks] == [
        each.values.tolist() for each in new.tracks
    ]

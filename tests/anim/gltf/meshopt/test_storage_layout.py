"""Packed clips as they lie in a file: what pays is compressed, what does not stays plain, equal values share."""

from __future__ import annotations

from dataclasses import replace

import meshopt
import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip
from tests.anim.gltf.meshopt.packing import EXTENSIONS, exponents, packed, quaternions, streams
from tests.anim.gltf.meshopt.to_pack import (
    KEYS,
    PATHS,
    RNG,
    SMOOTH,
    TIMES,
    Find,
    check_clips,
    of_nodes,
    opened_any,
    packed_walk,
)
from tests.clips import CUBICSPLINE, track
from tests.files import glb_of


@pytest.mark.parametrize(
    ("extension", "version"), [("EXT_meshopt_compression", 0xA0), ("KHR_meshopt_compression", 0xA1)]
)
def test_the_json_of_a_packed_clip_by_hand(extension: str, version: int) -> None:
    _, after = packed_walk(extension)
    json, data = after.json, after.buffers[0].data
    first, second = streams(after, extension)
    plain = {"buffer": 0, "byteLength": 4 * KEYS}
    start = plain["byteLength"]
    length = first["byteLength"]
    assert json["bufferViews"] == [
        plain,
        {
            "buffer": 1,
            "byteLength": 12 * KEYS,
            "extensions": {
                extension: {
                    "buffer": 0,
                    "byteOffset": start,
                    "byteLength": length,
                    "byteStride": 12,
                    "count": KEYS,
                    "mode": "ATTRIBUTES",
                    "filter": "EXPONENTIAL",
                }
            },
        },
        {
            "buffer": 1,
            "byteOffset": 12 * KEYS,
            "byteLength": 8 * KEYS,
            "extensions": {
                extension: {
                    "buffer": 0,
                    "byteOffset": start + length + -length % 4,
                    "byteLength": second["byteLength"],
                    "byteStride": 8,
                    "count": KEYS,
                    "mode": "ATTRIBUTES",
                    "filter": "QUATERNION",
                }
            },
        },
    ]
    fallback = {"byteLength": 20 * KEYS, "extensions": {extension: {"fallback": True}}}
    assert [{**each, "uri": ""} for each in json["buffers"]] == [
        {"byteLength": len(data), "uri": ""},
        {**fallback, "uri": ""},
    ]
    assert "uri" not in json["buffers"][1]
    assert json["extensionsUsed"] == json["extensionsRequired"] == [extension]
    assert [data[stream["byteOffset"]] for stream in (first, second)] == [version, version]
    assert json["accessors"][1:] == [
        {"bufferView": 1, "componentType": 5126, "count": KEYS, "type": "VEC3"},
        {"bufferView": 2, "componentType": 5122, "normalized": True, "count": KEYS, "type": "VEC4"},
    ]
    assert "byteOffset" not in json["accessors"][0]


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_what_does_not_pay_stays_plain(extension: str) -> None:
    clip, after = packed_walk(extension, keys=4)
    plain = writer.replace_clips(of_nodes(1), {0: clip})
    assert glb_of(after) == glb_of(plain)
    assert "extensionsUsed" not in after.json


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", ["noop", *PATHS, "Robot.glb"])
def test_packing_never_costs_bytes(name: str, extension: str, asset: Find) -> None:
    document = opened_any(name, asset)
    clips, after = packed(document, extension)
    slack = 64  # digits of offsets that were guessed
    assert len(glb_of(after)) <= len(glb_of(writer.replace_clips(document, clips))) + slack


def test_calm_tracks_lie_together_where_that_is_smaller() -> None:
    """Tracks of noise and at rest in turn: sorted, the codec's groups are all the one or all the other."""
    calm = np.tile((0.0, 0.0, 0.0, 1.0), (10, 1))
    tracks = []
    for node in range(40):
        wild = RNG.normal(size=(10, 4))
        rows = wild if node % 2 else calm + 1e-3 * node
        tracks.append(quaternions(track("rotation", np.arange(10), rows, node=node)))
    after = writer.replace_clips(of_nodes(40), {0: Clip("walk", tuple(tracks))}, extension=EXTENSIONS[0])
    stored = np.frombuffer(b"".join(each.codes.codes for each in tracks), np.uint8).reshape(-1, 8)
    (stream,) = streams(after, EXTENSIONS[0])
    assert stream["byteLength"] < len(meshopt.encode_gltf_buffer(stored, "ATTRIBUTES", 0))
    check_clips({0: Clip("walk", tuple(tracks))}, after)


def test_equal_values_share_an_accessor_and_take_the_codes_of_either() -> None:
    bare = track("translation", TIMES, np.rint(64 * SMOOTH[:, :3]) / 64 + 0.0)
    made = exponents(replace(bare, node=1), -6)
    np.testing.assert_array_equal(made.values, bare.values)
    after = writer.replace_clips(
        of_nodes(2),
        {0: Clip("walk", (bare, made))},
        extension=EXTENSIONS[0],
    )
    assert [channel["sampler"] for channel in after.json["animations"][0]["channels"]] == [0, 0]
    assert [stream["filter"] for stream in streams(after, EXTENSIONS[0])] == ["EXPONENTIAL"]


def test_splines_are_filtered_with_their_tangents() -> None:
    rows = SMOOTH[:, :3]
    made = exponents(track("translation", TIMES, rows, CUBICSPLINE, tangents=(rows - 1, rows + 1)))
    after = writer.replace_clips(of_nodes(1), {0: Clip("walk", (made,))}, extension=EXTENSIONS[0])
    assert [stream["count"] for stream in streams(after, EXTENSIONS[0])] == [3 * KEYS]
    check_clips({0: Clip("walk", (made,))}, after)


def test_negative_zeros_do_no_harm() -> None:
    made = exponents(track("translation", TIMES, -1e-9 * np.ones((KEYS, 3))))
    assert np.signbit(made.values).all()
    after = writer.replace_clips(of_nodes(1), {0: Clip("walk", (made,))}, extension=EXTENSIONS[0])
    assert not reader.clips(after)[0].tracks[0].values.any()

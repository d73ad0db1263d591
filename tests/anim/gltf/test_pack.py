"""Clips packed under meshopt's extensions: what is read is what was given, bit by bit, by us and by three.js."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshopt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fixtures
from anim.errors import RangeError, ShapeError
from anim.gltf import pack, read, write
from anim.gltf.accessors import Accessors
from anim.gltf.document import Document
from anim.gltf.pack import Filtered
from anim.model import Clip, Storage, Track
from fixtures.broken.pieces import animated, glb, text
from tests.anim.gltf.packing import (
    EXTENSIONS,
    exponent_codes,
    exponents,
    filtered_clips,
    found_by_three,
    packed,
    quaternions,
    streams,
)
from tests.anim.gltf.writing import check_same, rewritten
from tests.clips import CUBICSPLINE, track
from tests.files import glb_of, opened, opened_fixture, opened_path
from tests.judge import needs_judge
from tests.khronos import errors, needs_validator, validate_many

Json = dict[str, Any]
Find = Callable[[str], Path]

RNG = np.random.default_rng(5)
KEYS = 60
TIMES = np.arange(KEYS, dtype=np.float32) / 30
SMOOTH = np.cumsum(RNG.normal(size=(KEYS, 4)), axis=0) / 50 + (0, 0, 0, 2)
PATHS = ("Fox.glb", "CesiumMan.glb", "BitmojiRun.glb", "MorphStressTest.glb", "CubicMorph/01_cs_morph.gltf")


def _open(name: str, asset: Find) -> Document:
    return opened_fixture(name) if name in fixtures.FIXTURES else opened_path(asset(name))


def _nodes(count: int) -> Document:
    return opened(glb(text(animated() | {"nodes": [{}] * count, "scenes": [{"nodes": list(range(count))}]})))


def _check_clips(clips: dict[int, Clip], document: Document) -> None:
    """Targets may be in another order, and there may be two tracks of one pointer."""
    found = read.clips(document)
    for number, clip in clips.items():
        assert len(clip.tracks) == len(found[number].tracks)
        for mine, theirs in zip(*(sorted(each.tracks, key=_target) for each in (clip, found[number])), strict=True):
            check_same(mine, theirs)


def _target(each: Track) -> str:
    return str(each.target)


# Round trips


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", ["interpolations", "pointer", "noop", "morph_cube", *PATHS])
def test_every_clip_comes_back_bit_by_bit(name: str, extension: str, asset: Find) -> None:
    clips, after = packed(_open(name, asset), extension)
    _check_clips({i: _as_float32(clip) for i, clip in clips.items()}, opened(glb_of(after)))


def _as_float32(clip: Clip) -> Clip:
    """Times as a file holds them; int16 only where the writer can."""
    return Clip(clip.name, tuple(replace(each, times=each.times.astype(np.float32)) for each in clip.tracks))


@pytest.mark.parametrize("extension", EXTENSIONS)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_any_codes_come_back_as_what_they_decode_to(extension: str, data: st.DataObject) -> None:
    """Any bytes are codes; a document of many equal keys makes compression pay, so streams are really used."""
    count = data.draw(st.integers(1, 40))
    bits = data.draw(st.integers(4, 16))
    numbers = st.lists(st.floats(-1, 1, width=32), min_size=4 * count, max_size=4 * count)
    unit = np.reshape(data.draw(numbers), (count, 4)) + np.array((0, 0, 0, 3))
    turn, turn_codes = quaternions(track("rotation", np.arange(count), unit), bits)
    power = data.draw(st.integers(-60, 60))
    whole = data.draw(st.lists(st.integers(-(2**23) + 1, 2**23 - 1), min_size=3 * count, max_size=3 * count))
    mantissa = np.reshape(whole, (count, 3)).astype(float)
    move = track("translation", np.arange(count), mantissa * 2.0**power)
    filler = [exponents(track("scale", np.arange(200), np.ones((200, 3)), node=node)) for node in (0, 1)]
    codes = {id(turn): turn_codes, id(move): Filtered("EXPONENTIAL", exponent_codes(mantissa, power))}
    codes |= {id(each): filtered for each, filtered in filler}
    clip = Clip("walk", (turn, move, *(each for each, _ in filler)))
    packing = pack.compressed(extension, codes)
    after = opened(glb_of(write.replace_clips(_nodes(2), {0: clip}, packing=packing)))
    assert "EXPONENTIAL" in [stream.get("filter") for stream in streams(after, extension)]
    found = {each.target: each for each in read.clips(after)[0].tracks}
    for each in clip.tracks:
        check_same(replace(each, storage=found[each.target].storage), found[each.target])


@needs_judge
@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", ["Fox.glb", "BitmojiRun.glb", "MorphStressTest.glb"])
def test_three_js_decodes_the_same_numbers(name: str, extension: str, asset: Find, tmp_path: Path) -> None:
    """The independent route: another JSON reader, another build of the decoder."""
    _, after = packed(opened_path(asset(name)), extension)
    assert streams(after, extension)
    ours = Accessors(after)
    for number, theirs in found_by_three(after, tmp_path).items():
        mine = ours.raw(number).ravel()
        np.testing.assert_array_equal(mine, theirs.astype(mine.dtype))


@needs_validator
@pytest.mark.parametrize("extension", EXTENSIONS)
def test_the_validator_finds_no_error(extension: str, asset: Find) -> None:
    """None but those that the file had before."""
    documents = [_open(name, asset) for name in ("interpolations", "pointer", *PATHS[:4])]
    after = [packed(document, extension)[1] for document in documents]
    reports = validate_many([glb_of(each) for each in documents + after])
    for old, new in zip(reports, reports[len(documents) :], strict=False):
        assert errors(new) == errors(old)


# What is written


def _walk(extension: str, *, keys: int = KEYS) -> tuple[Clip, Document]:
    """One rotation and one translation, packed into a file of one node."""
    turn, turn_codes = quaternions(track("rotation", TIMES[:keys], SMOOTH[:keys]))
    move, move_codes = exponents(track("translation", TIMES[:keys], SMOOTH[:keys, :3]))
    clip = Clip("walk", (turn, move))
    packing = pack.compressed(extension, {id(turn): turn_codes, id(move): move_codes})
    return clip, write.replace_clips(_nodes(1), {0: clip}, packing=packing)


@pytest.mark.parametrize(
    ("extension", "version"), [("EXT_meshopt_compression", 0xA0), ("KHR_meshopt_compression", 0xA1)]
)
def test_the_json_of_a_packed_clip_by_hand(extension: str, version: int) -> None:
    _, after = _walk(extension)
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
    clip, after = _walk(extension, keys=4)
    plain = write.replace_clips(_nodes(1), {0: clip})
    assert glb_of(after) == glb_of(plain)
    assert "extensionsUsed" not in after.json


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", ["noop", *PATHS, "Robot.glb"])
def test_packing_never_costs_bytes(name: str, extension: str, asset: Find) -> None:
    document = _open(name, asset)
    clips, after = packed(document, extension)
    slack = 64  # digits of offsets that were guessed
    assert len(glb_of(after)) <= len(glb_of(write.replace_clips(document, clips))) + slack


def test_calm_tracks_lie_together_where_that_is_smaller() -> None:
    """Tracks of noise and at rest in turn: sorted, the codec's groups are all the one or all the other."""
    calm = np.tile((0.0, 0.0, 0.0, 1.0), (10, 1))
    tracks, codes = [], {}
    for node in range(40):
        wild = RNG.normal(size=(10, 4))
        made, filtered = quaternions(
            track("rotation", np.arange(10), wild if node % 2 else calm + 1e-3 * node, node=node)
        )
        tracks.append(made)
        codes[id(made)] = filtered
    packing = pack.compressed(EXTENSIONS[0], codes)
    after = write.replace_clips(_nodes(40), {0: Clip("walk", tuple(tracks))}, packing=packing)
    rows = np.frombuffer(b"".join(codes[id(each)].codes for each in tracks), np.uint8).reshape(-1, 8)
    (stream,) = streams(after, EXTENSIONS[0])
    assert stream["byteLength"] < len(meshopt.encode_gltf_buffer(rows, "ATTRIBUTES", 0))
    _check_clips({0: Clip("walk", tuple(tracks))}, after)


def test_equal_values_share_an_accessor_and_take_the_codes_of_either() -> None:
    bare = track("translation", TIMES, np.rint(64 * SMOOTH[:, :3]) / 64 + 0.0)
    made, filtered = exponents(replace(bare, node=1), -6)
    np.testing.assert_array_equal(made.values, bare.values)
    after = write.replace_clips(
        _nodes(2), {0: Clip("walk", (bare, made))}, packing=pack.compressed(EXTENSIONS[0], {id(made): filtered})
    )
    assert [channel["sampler"] for channel in after.json["animations"][0]["channels"]] == [0, 0]
    assert [stream["filter"] for stream in streams(after, EXTENSIONS[0])] == ["EXPONENTIAL"]


def test_splines_are_filtered_with_their_tangents() -> None:
    rows = SMOOTH[:, :3]
    made, filtered = exponents(track("translation", TIMES, rows, CUBICSPLINE, tangents=(rows - 1, rows + 1)))
    packing = pack.compressed(EXTENSIONS[0], {id(made): filtered})
    after = write.replace_clips(_nodes(1), {0: Clip("walk", (made,))}, packing=packing)
    assert [stream["count"] for stream in streams(after, EXTENSIONS[0])] == [3 * KEYS]
    _check_clips({0: Clip("walk", (made,))}, after)


def test_negative_zeros_do_no_harm() -> None:
    made, filtered = exponents(track("translation", TIMES, -1e-9 * np.ones((KEYS, 3))))
    assert np.signbit(made.values).all()
    packing = pack.compressed(EXTENSIONS[0], {id(made): filtered})
    after = write.replace_clips(_nodes(1), {0: Clip("walk", (made,))}, packing=packing)
    assert not read.clips(after)[0].tracks[0].values.any()


# Rewriting


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", PATHS[:4])
def test_packing_again_changes_no_byte(name: str, extension: str, asset: Find) -> None:
    document = opened_path(asset(name))
    clips, codes = filtered_clips(read.clips(document))
    packing = pack.compressed(extension, codes)
    once = glb_of(write.replace_clips(document, clips, packing=packing))
    assert glb_of(write.replace_clips(opened(once), clips, packing=packing)) == once


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", PATHS[:4])
def test_plain_after_packed_is_as_if_never_packed(name: str, extension: str, asset: Find) -> None:
    """No dead byte, no buffer, no name of an extension is left."""
    document = opened_path(asset(name))
    clips, after = packed(document, extension)
    direct, back = write.replace_clips(document, clips), write.replace_clips(opened(glb_of(after)), clips)
    assert back.json["buffers"] == direct.json["buffers"]
    assert back.json.get("extensionsUsed") == direct.json.get("extensionsUsed")
    assert back.json.get("extensionsRequired") == direct.json.get("extensionsRequired")
    assert len(glb_of(back)) == len(glb_of(direct))
    _check_clips({i: _as_float32(clip) for i, clip in clips.items()}, back)


def test_other_clips_of_a_packed_file_stay() -> None:
    """Two clips in the same streams; one is written anew, the other still finds its numbers."""
    walk, _ = _walk(EXTENSIONS[0])
    document = opened(glb(text(animated() | {"nodes": [{}], "animations": animated()["animations"] * 2})))
    run = Clip("run", (replace(walk.tracks[0], values=walk.tracks[0].values[::-1]), walk.tracks[1]))
    clips, codes = filtered_clips([walk, run])
    after = write.replace_clips(document, clips, packing=pack.compressed(EXTENSIONS[0], codes))
    again = opened(glb_of(write.replace_clips(after, {0: clips[0]})))
    _check_clips(clips, again)
    assert len(streams(again, EXTENSIONS[0])) == 2
    assert "extensionsRequired" not in rewritten(again).json


# Refusals


def test_codes_of_other_values_are_refused() -> None:
    made, filtered = quaternions(track("rotation", TIMES, SMOOTH))
    wrong = replace(made, values=made.values[::-1])
    packing = pack.compressed(EXTENSIONS[0], {id(wrong): filtered})
    with pytest.raises(ShapeError, match="rotation of node 0: values are not what their QUATERNION codes decode to"):
        write.replace_clips(_nodes(1), {0: Clip("walk", (wrong,))}, packing=packing)


@pytest.mark.parametrize("path", ["rotation", "translation"])
def test_codes_of_another_length_or_kind_are_refused(path: str) -> None:
    values = SMOOTH if path == "rotation" else SMOOTH[:, :3]
    made, filtered = exponents(track(path, TIMES, values))
    for wrong in (Filtered("EXPONENTIAL", filtered.codes[:-4]), Filtered("QUATERNION", filtered.codes)):
        packing = pack.compressed(EXTENSIONS[0], {id(made): wrong})
        with pytest.raises(ShapeError, match="codes decode to"):
            write.replace_clips(_nodes(1), {0: Clip("walk", (made,))}, packing=packing)


def test_what_a_packing_can_not_be() -> None:
    with pytest.raises(RangeError, match="extension 'ACME_zip'"):
        pack.compressed("ACME_zip", {})
    with pytest.raises(RangeError, match="filter 'OCTAHEDRAL'"):
        Filtered("OCTAHEDRAL", bytes(8))
    for name, codes in (("QUATERNION", bytes(12)), ("EXPONENTIAL", bytes(3)), ("EXPONENTIAL", b"")):
        with pytest.raises(ShapeError, match=f"{len(codes)} bytes of codes"):
            Filtered(name, codes)


def test_decoded_quaternions_by_closed_form() -> None:
    """The three smallest of the components from their codes, the largest from the unit length."""
    made, filtered = quaternions(track("rotation", TIMES, SMOOTH), 16)
    unit = SMOOTH / np.linalg.norm(SMOOTH, axis=1, keepdims=True)
    np.testing.assert_allclose(pack.decoded(filtered, 4), unit, atol=1e-4)
    rows = np.frombuffer(filtered.codes, "<i2").reshape(-1, 4).astype(float)
    three = rows[:, :3] / np.sqrt(2) / (rows[:, 3:].astype(int) | 3)
    largest = np.sqrt(1 - (three**2).sum(axis=1))
    np.testing.assert_allclose(pack.decoded(filtered, 4)[:, 3], largest, atol=1.01 / 32767)
    assert Storage(5122, normalized=True) == made.storage

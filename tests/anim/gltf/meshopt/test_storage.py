"""Clips packed under meshopt's extensions: what is read is what was given, bit by bit, by us and by three.js."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anim.errors import RangeError, ShapeError
from anim.gltf.meshopt import storage
from anim.gltf.meshopt.storage import FilteredValues, attach_codes
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import writer
from anim.model import AccessorFormat, Clip
from tests.anim.gltf.meshopt.packing import (
    EXTENSIONS,
    exponent_codes,
    exponents,
    found_by_three,
    packed,
    quaternions,
    streams,
)
from tests.anim.gltf.meshopt.to_pack import PATHS, SMOOTH, TIMES, Find, as_float32, check_clips, of_nodes, opened_any
from tests.anim.gltf.writing.documents import check_same
from tests.clips import track
from tests.files import glb_of, opened, opened_path
from tests.judge import needs_judge
from tests.khronos import errors, needs_validator, validate_many

# Round trips


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("name", ["interpolations", "pointer", "noop", "morph_cube", *PATHS])
def test_every_clip_comes_back_bit_by_bit(name: str, extension: str, asset: Find) -> None:
    clips, after = packed(opened_any(name, asset), extension)
    check_clips({i: as_float32(clip) for i, clip in clips.items()}, opened(glb_of(after)))


@pytest.mark.parametrize("extension", EXTENSIONS)
@settings(max_examples=40)
@given(data=st.data())
def test_any_codes_come_back_as_what_they_decode_to(extension: str, data: st.DataObject) -> None:
    """Any bytes are codes; a document of many equal keys makes compression pay, so streams are really used."""
    count = data.draw(st.integers(1, 40))
    bits = data.draw(st.integers(4, 16))
    numbers = st.lists(st.floats(-1, 1, width=32), min_size=4 * count, max_size=4 * count)
    unit = np.reshape(data.draw(numbers), (count, 4)) + np.array((0, 0, 0, 3))
    turn = quaternions(track("rotation", np.arange(count), unit), bits)
    power = data.draw(st.integers(-60, 60))
    whole = data.draw(st.lists(st.integers(-(2**23) + 1, 2**23 - 1), min_size=3 * count, max_size=3 * count))
    mantissa = np.reshape(whole, (count, 3)).astype(float)
    move = track("translation", np.arange(count), mantissa * 2.0**power)
    filler = [exponents(track("scale", np.arange(200), np.ones((200, 3)), node=node)) for node in (0, 1)]
    codes = FilteredValues("EXPONENTIAL", exponent_codes(mantissa, power))
    clip = Clip("walk", (turn, attach_codes(move, codes), *filler))
    after = opened(glb_of(writer.replace_clips(of_nodes(2), {0: clip}, extension=extension)))
    assert "EXPONENTIAL" in [stream.get("filter") for stream in streams(after, extension)]
    found = {each.target: each for each in reader.clips(after)[0].tracks}
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
    documents = [opened_any(name, asset) for name in ("interpolations", "pointer", *PATHS[:4])]
    after = [packed(document, extension)[1] for document in documents]
    reports = validate_many([glb_of(each) for each in documents + after])
    for old, new in zip(reports, reports[len(documents) :], strict=False):
        assert errors(new) == errors(old)


# Refusals


def test_codes_of_other_values_are_refused() -> None:
    made = quaternions(track("rotation", TIMES, SMOOTH))
    wrong = attach_codes(made.with_keys(made.time_axis, made.values[::-1]), made.codes)
    with pytest.raises(ShapeError, match="rotation of node 0: values are not what their QUATERNION codes decode to"):
        writer.replace_clips(of_nodes(1), {0: Clip("walk", (wrong,))}, extension=EXTENSIONS[0])


@pytest.mark.parametrize("path", ["rotation", "translation"])
def test_codes_of_another_length_or_kind_are_refused(path: str) -> None:
    values = SMOOTH if path == "rotation" else SMOOTH[:, :3]
    made = exponents(track(path, TIMES, values))
    codes = made.codes.codes
    for wrong in (FilteredValues("EXPONENTIAL", codes[:-4]), FilteredValues("QUATERNION", codes)):
        with pytest.raises(ShapeError, match="codes decode to"):
            writer.replace_clips(of_nodes(1), {0: Clip("walk", (attach_codes(made, wrong),))}, extension=EXTENSIONS[0])


def test_what_a_packing_can_not_be() -> None:
    with pytest.raises(RangeError, match="extension 'ACME_zip'"):
        writer.replace_clips(of_nodes(1), {0: Clip("walk", ())}, extension="ACME_zip")
    with pytest.raises(RangeError, match="filter 'OCTAHEDRAL'"):
        FilteredValues("OCTAHEDRAL", bytes(8))
    for name, codes in (("QUATERNION", bytes(12)), ("EXPONENTIAL", bytes(3)), ("EXPONENTIAL", b"")):
        with pytest.raises(ShapeError, match=f"{len(codes)} bytes of codes"):
            FilteredValues(name, codes)


def test_decoded_quaternions_by_closed_form() -> None:
    """The three smallest of the components from their codes, the largest from the unit length."""
    made = quaternions(track("rotation", TIMES, SMOOTH), 16)
    unit = SMOOTH / np.linalg.norm(SMOOTH, axis=1, keepdims=True)
    np.testing.assert_allclose(storage.decompress_document(made.codes, 4), unit, atol=1e-4)
    rows = np.frombuffer(made.codes.codes, "<i2").reshape(-1, 4).astype(float)
    three = rows[:, :3] / np.sqrt(2) / (rows[:, 3:].astype(int) | 3)
    largest = np.sqrt(1 - (three**2).sum(axis=1))
    np.testing.assert_allclose(storage.decompress_document(made.codes, 4)[:, 3], largest, atol=1.01 / 32767)
    assert AccessorFormat(5122, normalized=True) == made.storage

"""Compressed views: what the encoder put in comes out, in every mode and filter, under both extensions."""

from __future__ import annotations

import struct
from typing import Any
from unittest.mock import Mock

import meshopt
import numpy as np
import pytest
from numpy.typing import NDArray

from anim.errors import FormatError, UnsupportedError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.gltf.writing import writer
from fixtures.broken.pieces import glb, text
from tests.files import glb_of, opened

Json = dict[str, Any]
Array = NDArray[Any]

EXTENSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
COMPONENT_TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
RNG = np.random.default_rng(7)
UNIT = RNG.normal(size=(37, 4))
UNIT /= np.linalg.norm(UNIT, axis=1, keepdims=True)

# Encoded bytes (count, stride) of each filter, the decoded type of a component, the numbers meant, and the bits kept.
NORMALS = np.concatenate((UNIT[:, :3] / np.linalg.norm(UNIT[:, :3], axis=1, keepdims=True), np.ones((37, 1))), axis=1)
COLORS = RNG.random((37, 4))
FILTERED = {
    "OCTAHEDRAL-8": ("OCTAHEDRAL", meshopt.encode_filter_oct(NORMALS, 4, 8), "i1", NORMALS, 7),
    "OCTAHEDRAL-16": ("OCTAHEDRAL", meshopt.encode_filter_oct(NORMALS, 8, 12), "i2", NORMALS, 11),
    "QUATERNION": ("QUATERNION", meshopt.encode_filter_quat(UNIT, 8, 16), "i2", UNIT, 15),
    "EXPONENTIAL": ("EXPONENTIAL", meshopt.encode_filter_exp(UNIT, 20), "f4", UNIT, 18),
    "COLOR-8": ("COLOR", meshopt.encode_filter_color(COLORS, 4, 8), "u1", COLORS, 6),
    "COLOR-16": ("COLOR", meshopt.encode_filter_color(COLORS, 8, 12), "u2", COLORS, 10),
}


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("fallback", [True, False], ids=["fallback", "no uri"])
@pytest.mark.parametrize(("dtype", "components"), [("u1", 4), ("i2", 4), ("u2", 2), ("f4", 3), ("f4", 1), ("u4", 1)])
def test_attributes_come_back_exactly(extension: str, fallback: bool, dtype: str, components: int) -> None:
    values = RNG.integers(0, 100, size=(300, components)).astype(f"<{dtype}")
    stored = meshopt.encode_gltf_buffer(values, "ATTRIBUTES")
    document = _document(extension, stored, values, mode="ATTRIBUTES", fallback=fallback)
    np.testing.assert_array_equal(Accessors(document).raw(0), values)


def test_both_versions_of_the_stream_are_read() -> None:
    values = RNG.normal(size=(300, 3)).astype("<f4")
    for version in (0, 1):
        stored = meshopt.encode_gltf_buffer(values, "ATTRIBUTES", version)
        document = _document("KHR_meshopt_compression", stored, values, mode="ATTRIBUTES")
        np.testing.assert_array_equal(Accessors(document).raw(0), values)


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("dtype", ["u2", "u4"])
@pytest.mark.parametrize("mode", ["TRIANGLES", "INDICES"])
def test_indices_come_back(extension: str, dtype: str, mode: str) -> None:
    indices = RNG.integers(0, 500, size=300).astype(f"<{dtype}")
    document = _document(extension, meshopt.encode_gltf_buffer(indices, mode), indices[:, None], mode=mode)
    found = Accessors(document).integers(0)[:, 0]
    if mode == "TRIANGLES":  # the codec may turn a triangle round, not over
        assert [_turned(each) for each in found.reshape(-1, 3)] == [_turned(each) for each in indices.reshape(-1, 3)]
    else:
        np.testing.assert_array_equal(found, indices)


@pytest.mark.parametrize("name", FILTERED)
@pytest.mark.parametrize("extension", EXTENSIONS)
def test_filters_give_the_numbers_back_to_their_bits(extension: str, name: str) -> None:
    chosen, encoded, dtype, meant, bits = FILTERED[name]
    shape = np.zeros((len(meant), meant.shape[1]), f"<{dtype}")
    stored = meshopt.encode_gltf_buffer(encoded, "ATTRIBUTES")
    document = _document(extension, stored, shape, mode="ATTRIBUTES", filter=chosen, normalized=dtype != "f4")
    found = Accessors(document).floats(0)
    if chosen == "QUATERNION":  # q and −q are one rotation
        meant = meant * np.where((found * meant).sum(axis=1, keepdims=True) < 0, -1, 1)
    columns = slice(0, 3) if chosen == "OCTAHEDRAL" else slice(None)
    np.testing.assert_allclose(found[:, columns], meant[:, columns], atol=2.0 ** (1 - bits))


def test_a_compressed_clip_is_read_and_rewritten_plain() -> None:
    times, values = np.arange(50, dtype="<f4") / 25, RNG.normal(size=(50, 3)).astype("<f4")
    document = _clip(times, values)
    (clip,) = reader.clips(document)
    np.testing.assert_array_equal(clip.tracks[0].times, times)
    np.testing.assert_array_equal(clip.tracks[0].values, values)
    again = opened(glb_of(writer.replace_clips(document, {0: clip})))
    np.testing.assert_array_equal(reader.clips(again)[0].tracks[0].values, values)
    assert [view for view in again.json["bufferViews"] if "extensions" in view] == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 0}, "'count'"),
        ({"count": "9"}, "'count'"),
        ({"byteStride": 6}, "byteStride 6"),
        ({"byteStride": 260}, "byteStride 260"),
        ({"byteLength": 0}, "'byteLength'"),
        ({"byteLength": 10**9}, "ends at byte"),
        ({"byteOffset": -1}, "byteOffset"),
        ({"buffer": 7}, "buffer is 7"),
        ({"count": 4_000_000_000}, "not possible"),
        ({"filter": "OCTAHEDRAL"}, "filter OCTAHEDRAL"),
        ({"filter": "QUATERNION"}, "filter QUATERNION"),
        ({"mode": "TRIANGLES"}, "TRIANGLES"),
        ({"mode": "INDICES"}, "INDICES"),
    ],
)
def test_a_description_that_does_not_fit_is_refused(change: Json, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        Accessors(_points(change)).floats(0)


@pytest.mark.parametrize("change", [{"mode": "SCRIBBLES"}, {"mode": None}, {"filter": "WARP"}])
def test_unknown_modes_and_filters_are_not_handled(change: Json) -> None:
    with pytest.raises(UnsupportedError, match="bufferView 0: meshopt mode"):
        Accessors(_points(change)).floats(0)


@pytest.mark.parametrize("description", [5, "zip", [], {}])
def test_a_description_that_is_none_is_refused(description: object) -> None:
    document = _points({})
    document.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] = description
    with pytest.raises(FormatError, match="meshopt"):
        opened(text(document.json))


def test_a_broken_stream_is_refused() -> None:
    document = _points({})
    stored = document.buffers[0].data.tobytes()
    json = {key: value for key, value in document.json.items() if key != "asset"}
    messages = set()
    for place in range(0, len(stored), 3):
        torn = stored[:place] + bytes([stored[place] ^ 0xFF]) + stored[place + 1 :]
        try:
            Accessors(opened(glb(text(json), torn))).raw(0)
        except FormatError as error:
            messages.add(str(error).partition(" (")[0])
    assert messages == {"accessor 0, bufferView 0: meshopt stream is broken"}


def test_a_view_is_decoded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    decode = Mock(side_effect=meshopt.decode_gltf_buffer)
    monkeypatch.setattr(meshopt, "decode_gltf_buffer", decode)
    accessors = Accessors(_points({}))
    accessors.floats(0)
    accessors.floats(0)
    assert decode.call_count == 1


def _turned(triangle: Array) -> tuple[int, ...]:
    first = int(triangle.argmin())
    return tuple(np.roll(triangle, -first).tolist())


def _points(change: Json) -> Document:
    values = RNG.integers(0, 9, size=(40, 3)).astype("<f4")
    stored = meshopt.encode_gltf_buffer(values, "ATTRIBUTES")
    return _document("EXT_meshopt_compression", stored, values, **{"mode": "ATTRIBUTES", **change})


def _document(
    extension: str, stored: bytes, values: Array, *, fallback: bool = True, normalized: bool = False, **about: Any
) -> Document:
    """Return a GLB with one accessor of `values`, whose view lies compressed in buffer 0; buffer 1 has no bytes."""
    kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[values.shape[1]]
    stride = values.itemsize * values.shape[1]
    description = {"buffer": 0, "byteLength": len(stored), "byteStride": stride, "count": len(values), **about}
    view = {"buffer": 1, "byteLength": stride * len(values), "extensions": {extension: description}}
    accessor = {"bufferView": 0, "componentType": COMPONENT_TYPES[values.dtype.str[1:]], "type": kind}
    document = {
        "extensionsUsed": [extension],
        "extensionsRequired": [extension],
        "buffers": [{"byteLength": len(stored)}, _fallback(extension, stride * len(values), marked=fallback)],
        "bufferViews": [view],
        "accessors": [{**accessor, "count": len(values), "normalized": normalized}],
    }
    return opened(glb(text(document), stored))


def _fallback(extension: str, length: int, *, marked: bool) -> Json:
    return {"byteLength": length, **({"extensions": {extension: {"fallback": True}}} if marked else {})}


def _clip(times: Array, values: Array) -> Document:
    packed = [meshopt.encode_gltf_buffer(each, "ATTRIBUTES") for each in (times[:, None], values)]
    starts, plain = (0, len(packed[0]) + -len(packed[0]) % 4), (times.nbytes, values.nbytes)
    blob = packed[0].ljust(starts[1], b"\0") + packed[1]
    views = [
        {
            "buffer": 1,
            "byteOffset": sum(plain[:i]),
            "byteLength": plain[i],
            "extensions": {
                "EXT_meshopt_compression": {
                    "buffer": 0,
                    "byteOffset": starts[i],
                    "byteLength": len(packed[i]),
                    "byteStride": plain[i] // len(times),
                    "count": len(times),
                    "mode": "ATTRIBUTES",
                }
            },
        }
        for i in range(2)
    ]
    bounds = {"min": [0], "max": [struct.unpack("<f", times[-1:].tobytes())[0]]}
    floats = {"componentType": 5126, "count": len(times)}
    document = {
        "nodes": [{}],
        "extensionsUsed": ["EXT_meshopt_compression"],
        "buffers": [{"byteLength": len(blob)}, _fallback("EXT_meshopt_compression", sum(plain), marked=True)],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "type": "SCALAR", **floats, **bounds},
            {"bufferView": 1, "type": "VEC3", **floats},
        ],
        "animations": [
            {
                "samplers": [{"input": 0, "output": 1}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            }
        ],
    }
    return opened(glb(text(document), blob))

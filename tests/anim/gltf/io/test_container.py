"""GLB and .gltf: what goes in comes out, buffers are opened late, and nothing outside the folder is reached."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fixtures
from anim.errors import FormatError, ShapeError, UnsupportedError
from anim.gltf.document import Buffer, Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from fixtures.broken.pieces import data_uri, text
from tests.files import REAL, glb_of, joined, mark_slow, opened, opened_fixture, opened_path

Json = dict[str, Any]

JSON, BIN, NOTE = b"JSON", b"BIN\0", b"NOTE"
HELD: Json = {"buffers": [{"byteLength": 5}]}


def test_a_glb_by_hand() -> None:
    document = opened(_glb((JSON, text(HELD)), (BIN, b"hello\0\0\0")))
    assert document.json == {"asset": {"version": "2.0"}, **HELD}
    assert document.buffers[0].data.tobytes() == b"hello"
    assert joined(container.glb(document)) == _glb((JSON, _compact(HELD)), (BIN, b"hello\0\0\0"))


def test_json_keeps_its_keys_its_order_and_its_numbers() -> None:
    numbers = b"[1.0,1,-0.0,0.1,1e-07,12345678901234567890]"
    content = b'{"z":1,"asset":{"version":"2.0","n":%s},"a":{"y":null,"b":"\xc3\xa4\\n"}}' % numbers
    written = joined(container.glb(opened(content)))
    assert written[20:].rstrip(b" ") == content


def test_unknown_chunks_are_kept_in_their_order() -> None:
    data = _glb((JSON, _compact(HELD)), (BIN, b"hello\0\0\0"), (NOTE, b"one!"), (b"MORE", b""), (NOTE, b"two!"))
    assert joined(container.glb(opened(data))) == data


def test_bytes_behind_the_end_are_dropped() -> None:
    data = _glb((JSON, _compact(HELD)), (BIN, b"hello\0\0\0"))
    assert joined(container.glb(opened(data + b"trailing"))) == data


def test_a_bin_chunk_may_be_padded_and_its_padding_is_no_data() -> None:
    document = opened(_glb((JSON, text(HELD)), (BIN, b"hello\0\0\0")))
    assert len(document.buffers[0].data) == 5


def test_buffers_are_views_into_the_input_and_read_only() -> None:
    data = np.frombuffer(_glb((JSON, text(HELD)), (BIN, b"hello\0\0\0")), np.uint8)
    found = container.read(data).buffers[0].data
    assert np.shares_memory(found, data)
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 0


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is empty"),
        (b"hello", "starts with b'hell'"),
        (b"glTF", "header is cut off"),
        (b"glTF" + struct.pack("<II", 2, 12), "no JSON chunk"),
        (b"glTF" + struct.pack("<II", 1, 12), "version is 1"),
        (b"glTF" + struct.pack("<II", 2, 13), "truncated"),
        (b"glTF" + struct.pack("<II", 2, 8), "wrong length"),
        (b"glTF" + struct.pack("<II", 2, 2**32 - 1), "truncated"),
        (b"glTF" + struct.pack("<II", 2, 20) + struct.pack("<I4s", 4, JSON), "truncated"),
        (b"glTF" + struct.pack("<III", 2, 16, 0), "cut off"),
        (b"glTF" + struct.pack("<III4s", 2, 22, 2, b"JSON") + b"{}", "multiple of 4"),
        (b"[]", "starts with"),
        (b'"a"', "starts with"),
        (b"{", "JSON is broken at line 1, column 2"),
        (b'{"asset":{"version":"2.0"}}}', "JSON is broken at line 1, column 28"),
        (b'{"asset":{"version":"2.0"},"a":Infinity}', "Infinity"),
        (b'{"asset":{"version":"2.0"},"a":-Infinity}', "-Infinity"),
        (b'{"a\xff":1}', "not UTF-8"),
        (b"{}", "no 'asset'"),
        (b'{"asset":null}', "asset: is null"),
        (b'{"asset":{}}', "asset: has no 'version'"),
        (b'{"asset":{"version":2.0}}', "asset.version"),
        (b'{"asset":{"version":"3.0"}}', "asset.version: is '3.0'"),
    ],
)
def test_what_is_no_gltf_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(FormatError) as caught:
        opened(data)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("chunks", "message"),
    [
        ([(BIN, b"")], "first chunk"),
        ([(NOTE, b""), (JSON, b"{}  ")], "first chunk"),
        ([(JSON, b"    ")], "JSON is broken"),
        ([(JSON, b"\xef\xbb\xbf{}   ")], "byte order mark"),
        ([(JSON, text({})), (JSON, text({}))], "second or misplaced JSON"),
        ([(JSON, text({})), (BIN, b""), (BIN, b"")], "second or misplaced BIN"),
        ([(JSON, text({})), (NOTE, b""), (BIN, b"")], "second or misplaced BIN"),
        ([(JSON, text(HELD))], "no BIN chunk"),
        ([(JSON, text(HELD)), (BIN, b"hell")], "BIN chunk holds 4 bytes"),
    ],
)
def test_chunks_that_do_not_fit_are_refused(chunks: list[tuple[bytes, bytes]], message: str) -> None:
    with pytest.raises(FormatError) as caught:
        opened(_glb(*chunks))
    assert message in str(caught.value)


def test_a_pointer_of_git_lfs_says_how_to_fetch_the_file() -> None:
    with pytest.raises(FormatError) as caught:
        opened(fixtures.BROKEN["lfs_pointer"].data)
    assert caught.value.help == "git lfs pull"


def test_buffers_are_opened_only_when_they_are_needed() -> None:
    asked: list[str] = []

    def resolve(path: str) -> np.ndarray[Any, np.dtype[np.uint8]]:
        asked.append(path)
        return np.zeros(8, np.uint8)

    content = text({"buffers": [{"byteLength": 5, "uri": "a%20b/c.bin"}, {"byteLength": 9, "uri": "missing.bin"}]})
    document = container.read(np.frombuffer(content, np.uint8), resolve)
    assert asked == []
    assert len(document.buffers[0].data) == 5
    assert document.buffers[0].data is document.buffers[0].data
    assert asked == ["a b/c.bin"]
    with pytest.raises(FormatError, match="buffer 1: holds 8 bytes"):
        _ = document.buffers[1].data


def test_a_glb_holds_the_first_buffer_and_the_others_as_data_uris() -> None:
    files = {"a.bin": b"first", "b.bin": b"other"}
    buffers = [{"byteLength": 5, "uri": "a.bin", "name": "a"}, {"byteLength": 5, "uri": "b.bin", "name": "b"}]
    written = glb_of(opened(text({"buffers": buffers}), files))
    again = opened(written)
    assert [buffer.data.tobytes() for buffer in again.buffers] == [b"first", b"other"]
    assert again.json["buffers"][0] == {"byteLength": 5, "name": "a"}
    assert again.json["buffers"][1]["uri"] == data_uri(b"other")
    assert glb_of(again) == written


def test_a_gltf_has_its_buffers_beside_it_and_its_indent() -> None:
    buffers = [{"byteLength": 5, "uri": "a.bin"}]
    source = json.dumps({"asset": {"version": "2.0"}, "buffers": buffers, "x": [[]]}, indent=3)
    files = _gltf(opened(source.encode(), {"a.bin": b"first"}), stem="my walk")
    assert list(files) == ["my walk.bin", "my walk.gltf"]
    assert files["my walk.bin"] == b"first"
    expected = json.loads(source) | {"buffers": [{"byteLength": 5, "uri": "my%20walk.bin"}]}
    assert json.loads(files["my walk.gltf"]) == expected
    assert b'\n   "asset": {\n      "version"' in files["my walk.gltf"]


def test_an_unchanged_external_buffer_stays_the_file_that_it_is() -> None:
    source = text({"buffers": [{"byteLength": 5, "uri": "a.bin"}]})
    files = _gltf(opened(source, {"a.bin": b"first"}), keep_external=True)
    assert list(files) == ["x.gltf"]
    assert json.loads(files["x.gltf"])["buffers"] == [{"byteLength": 5, "uri": "a.bin"}]


def test_a_changed_external_buffer_is_written_anew() -> None:
    source = text({"buffers": [{"byteLength": 5, "uri": "a.bin"}]})
    document = opened(source, {"a.bin": b"first"})
    changed = replace(document, buffers=(Buffer(5, "a.bin", lambda: np.frombuffer(b"other", np.uint8), replaced=True),))
    files = _gltf(changed, keep_external=True)
    assert files["x.bin"] == b"other"
    assert json.loads(files["x.gltf"])["buffers"] == [{"byteLength": 5, "uri": "x.bin"}]


def test_a_glb_of_more_than_four_gibibytes_is_refused() -> None:
    length = 2**32 - 4
    huge = np.broadcast_to(np.zeros((), np.uint8), (length,))  # takes no memory
    document = Document(json.loads(text({"buffers": [{"byteLength": length}]})), (Buffer(length, None, lambda: huge),))
    with pytest.raises(UnsupportedError, match="can't hold") as caught:
        container.glb(document)
    assert ".gltf" in caught.value.help


@pytest.mark.parametrize("name", fixtures.FIXTURES)
def test_there_and_back_leaves_fixtures_as_they_were(name: str) -> None:
    _check_there_and_back(opened_fixture(name))


@pytest.mark.parametrize("name", mark_slow(REAL))
def test_there_and_back_leaves_real_files_as_they_were(name: str, asset: Any) -> None:
    path: Path = asset(name)
    _check_there_and_back(opened_path(path))


def _check_there_and_back(document: Document) -> None:
    """GLB → .gltf → GLB and .gltf → GLB → .gltf: equal JSON but for buffers, in the same order, and equal bytes."""
    data = glb_of(document)
    files = _gltf(opened(data))
    back = opened(files["x.gltf"], files)
    assert glb_of(back) == data
    assert _gltf(opened(glb_of(back))).keys() == files.keys()
    assert _without_buffers(back.json) == _without_buffers(document.json)
    assert json.dumps(_without_buffers(back.json)) == json.dumps(_without_buffers(document.json))
    for before, after in zip(document.buffers, back.buffers, strict=True):
        assert before.data.tobytes() == after.data.tobytes()


def _without_buffers(content: Json) -> Json:
    return {key: value for key, value in content.items() if key != "buffers"}


def _gltf(document: Document, *, stem: str = "x", keep_external: bool = False) -> dict[str, bytes]:
    files = container.gltf(document, stem, keep_external=keep_external)
    return {name: joined(pieces) for name, pieces in files.items()}


def _compact(content: Json) -> bytes:
    return json.dumps({"asset": {"version": "2.0"}, **content}, separators=(",", ":")).encode()


def _glb(*chunks: tuple[bytes, bytes]) -> bytes:
    body = b""
    for kind, content in chunks:
        content += b" " * (-len(content) % 4)
        body += struct.pack("<I4s", len(content), kind) + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def test_bytes_are_taken_as_they_are() -> None:
    data = fixtures.build("arm")
    for given in (data, bytearray(data), memoryview(data)):
        assert container.read(given).json == container.read(np.frombuffer(data, np.uint8)).json


@pytest.mark.parametrize("given", ["walk.glb", Path("walk.glb"), None, np.zeros(3), np.zeros((2, 2), np.uint8)])
def test_a_path_is_no_bytes_and_the_error_says_what_to_do(given: Any) -> None:
    with pytest.raises(ShapeError, match="expected a uint8 array or bytes") as caught:
        container.read(given)
    assert "np.fromfile" in caught.value.help


def test_an_array_that_is_no_bytes_is_named_by_type_and_shape() -> None:
    with pytest.raises(ShapeError, match=r"got an array of float64 with shape \(2, 3\)"):
        container.read(np.zeros((2, 3)))  # type: ignore[arg-type]


def test_without_resolve_the_error_names_it_all_the_way_up() -> None:
    data = fixtures.build("gltf_external")
    with pytest.raises(FormatError, match="are not given") as caught:
        reader.clips(container.read(data))
    assert "resolve=" in caught.value.help


@pytest.mark.parametrize(
    ("resolve", "message"),
    [("folder", "resolve is str"), (lambda _: None, "resolve gives None for 'walk data.bin'")],
)
def test_what_does_not_resolve_is_refused(resolve: Any, message: str) -> None:
    with pytest.raises(ShapeError, match=message):
        _ = container.read(fixtures.build("gltf_external"), resolve).buffers[0].data


def test_resolve_may_give_plain_bytes() -> None:
    document = container.read(fixtures.build("gltf_external"), lambda _: bytes(968))
    assert document.buffers[0].data.tobytes() == bytes(968)


def test_a_path_is_no_document() -> None:
    with pytest.raises(ShapeError, match="document is str"):
        reader.clips("walk.glb")  # type: ignore[arg-type]

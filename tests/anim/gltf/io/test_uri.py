"""URIs of buffers: decoded, confined to the file's own folder, or holding the bytes themselves."""

from __future__ import annotations

import json
from collections import defaultdict

import pytest

from anim.errors import FormatError
from anim.gltf.io import container
from fixtures.broken.pieces import text
from tests.files import joined, opened


@pytest.mark.parametrize(
    ("uri", "path"),
    [
        ("walk.bin", "walk.bin"),
        ("./walk.bin", "./walk.bin"),
        ("walk%20data.bin", "walk data.bin"),
        ("w%C3%A4lk.bin", "wälk.bin"),
        ("wälk.bin", "wälk.bin"),
        ("100%25.bin", "100%.bin"),
        ("data/walk+1.bin", "data/walk+1.bin"),
        ("a..b.bin", "a..b.bin"),
        ("dot/../walk.bin", "walk.bin"),
        ("./dot/../walk.bin", "walk.bin"),
        ("a/b/../../c/./walk.bin", "c/walk.bin"),
        ("a/b%2Fc/../walk.bin", "a/walk.bin"),
        ("datawalk.bin", "datawalk.bin"),
        ("n%0Al%09%1B.bin", "n\nl\t\x1b.bin"),
        ("no%C2%A0break.bin", "no\u00a0break.bin"),
        ("bad%FF.bin", "bad\udcff.bin"),  # as os.fsdecode has it
    ],
)
def test_relative_paths_are_percent_decoded(uri: str, path: str) -> None:
    content = text({"buffers": [{"byteLength": 3, "uri": uri}]})
    assert opened(content, {path: b"abc"}).buffers[0].data.tobytes() == b"abc"


@pytest.mark.parametrize(
    "uri",
    [
        "",
        "/etc/passwd",
        "//host/share.bin",
        "\\\\host\\share.bin",
        "%2Fetc%2Fpasswd",
        "..",
        "../secret.bin",
        "..\\secret.bin",
        "a/../../secret.bin",
        "a/..",
        "./../secret.bin",
        "a//../../../secret.bin",
        "a/..%2F../secret.bin",
        "/a/../secret.bin",
        "%2e%2e/secret.bin",
        "%2e%2e%2fsecret.bin",
        "a/%2e%2e/secret.bin",
        "a%5C..%5C..%5Csecret.bin",
        "C:/secret.bin",
        "C%3A/secret.bin",
        "C:\\secret.bin",
        "file:///etc/passwd",
        "FILE:secret.bin",
        "http://example.com/walk.bin",
        "a%00b.bin",
        "a\0b.bin",
        "\ud83d.bin",
    ],
)
def test_nothing_outside_the_folder_is_asked_for(uri: str) -> None:
    files: dict[str, bytes] = defaultdict(lambda: b"abc")  # whatever is asked for is there, and remembered
    document = opened(text({"buffers": [{"byteLength": 3, "uri": uri}]}), files)
    with pytest.raises(FormatError, match="buffer 0: URI"):
        _ = document.buffers[0].data
    assert not files


def test_a_pipe_has_nothing_beside_it() -> None:
    document = opened(text({"buffers": [{"byteLength": 3, "uri": "walk.bin"}]}))
    with pytest.raises(FormatError, match="are not given") as caught:
        _ = document.buffers[0].data
    assert "resolve=" in caught.value.help


@pytest.mark.parametrize(
    "uri",
    [
        "data:application/octet-stream;base64,AAEC",
        "data:application/gltf-buffer;base64,AAEC",
        "DATA:Application/Octet-Stream;BASE64,AAEC",
        "data:application/octet-stream;charset=x;base64,AAEC",
        "data:application/octet-stream;base64,AAE%43",
        "data:application/octet-stream,%00%01%02",
    ],
)
def test_data_uris(uri: str) -> None:
    document = opened(text({"buffers": [{"byteLength": 3, "uri": uri}]}))
    assert document.buffers[0].data.tobytes() == b"\0\1\2"
    assert json.loads(joined(container.gltf(document, "x")["x.gltf"]))["buffers"][0]["uri"] == uri


@pytest.mark.parametrize(
    "uri",
    [
        "data:",
        "data:,",
        "data:;base64,AAEC",
        "data:image/png;base64,AAEC",
        "data:application/octet-stream;base64",
        "data:application/octet-stream;base64,AAE",
        "data:application/octet-stream;base64,AA*C",
        "data:application/octet-stream;base64,AA EC",
        "data:application/octet-stream;;base64,AAEC",
        "data:application/octet-stream;base64,ä",
        "data:application/octet-stream;base64,AA==",
    ],
)
def test_broken_data_uris_are_refused_when_they_are_needed(uri: str) -> None:
    document = opened(text({"buffers": [{"byteLength": 3, "uri": uri}]}))
    with pytest.raises(FormatError, match="buffer 0"):
        _ = document.buffers[0].data

"""URIs of buffers and images: decode data URIs, confine relative ones to the file's folder."""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Sequence
from urllib.parse import quote, unquote, unquote_to_bytes

from anim.errors import FormatError

BUFFER_TYPES = ("application/octet-stream", "application/gltf-buffer")  # glTF 2.0, 3.6.1.1
IMAGE_TYPES = ("image/png", "image/jpeg", "image/jpg", "image/webp")  # the third is invalid, but frequent
_DATA = r"(?ai)data:([\w.+-]+/[\w.+-]+)?((?:;[\w.+-]+=[^;,]*)*)(;base64)?,"
_SCHEME = r"(?ai)[a-z][a-z0-9+.-]*:"


def is_data(uri: str) -> bool:
    """Return True for a data URI."""
    return uri[:5].lower() == "data:"


def decode_data(uri: str, types: Sequence[str] = BUFFER_TYPES) -> bytes:
    """Return the bytes of a data URI.

    types: allowed media types; glTF's for buffers. Raises FormatError for an invalid URI, or another type.
    decode_data("data:application/octet-stream;base64,AAE=") → b"\\0\\1"
    """
    match = re.match(_DATA, uri)
    if match is None:
        raise FormatError(f"broken data URI ({_short(uri)})")
    media = (match[1] or "").lower()
    if media not in types:
        raise FormatError(f"data URI has media type '{media}' (expected {' or '.join(types)})")
    try:
        payload = unquote_to_bytes(uri[match.end() :])
    except UnicodeEncodeError:
        raise FormatError("data URI holds half of a surrogate pair") from None
    if not match[3]:
        return payload
    try:
        return base64.b64decode(payload, validate=True)
    except binascii.Error as error:
        raise FormatError(f"broken base64 in a data URI ({str(error).lower()})") from None


def encode_data(data: bytes, media: str = BUFFER_TYPES[0]) -> str:
    """Return `data` as a base64 data URI."""
    return f"data:{media};base64,{base64.b64encode(data).decode('ascii')}"


def relative_path(uri: str) -> str:
    """Return the path of a relative URI, percent-decoded, with forward slashes.

    Bytes that are not UTF-8 are decoded with `os.fsdecode`, so that the path names the file with these bytes.
    Raises FormatError unless the path is in the file's folder: no scheme, no absolute path, no ".." that leads out.
    relative_path("walk%20data.bin") → "walk data.bin"; relative_path("a/../walk.bin") → "walk.bin"
    """
    if re.match(_SCHEME, uri):
        raise FormatError(f"URI '{_short(uri)}' has a scheme (only files beside this one are read)")
    path = unquote(_without_dot_segments(uri), errors="surrogateescape")
    if not path or "\0" in path or not _is_encodable(path):
        raise FormatError(f"URI '{_short(uri)}' names no file")
    if path[0] in "/\\" or re.match(_SCHEME, path):
        raise FormatError(f"URI '{_short(uri)}' is absolute (only files beside this one are read)")
    if ".." in re.split(r"[/\\]", path):
        raise FormatError(f"URI '{_short(uri)}' leaves the file's folder (only files beside this one are read)")
    return path


def _without_dot_segments(uri: str) -> str:
    """The URI without ".." that cancel a folder before them (RFC 3986, 5.2.4); those that lead out remain."""
    found: list[str] = []
    segments = uri.split("/")
    for segment in segments:
        if segment == ".." and found and found[-1] not in ("", ".."):
            found.pop()
        elif segment != "." or ".." not in segments:
            found.append(segment)
    return "/".join(found)


def from_path(path: str) -> str:
    """Return the relative URI of a file name, percent-encoded, also if not UTF-8 (`os.fsdecode`)."""
    return quote(path, errors="surrogateescape")


def _is_encodable(path: str) -> bool:
    """True if a path can be encoded: a lone surrogate, valid in JSON, cannot."""
    try:
        path.encode(errors="surrogateescape")
    except UnicodeEncodeError:
        return False
    return True


def _short(uri: str) -> str:
    return uri if len(uri) <= 60 else uri[:57] + "..."

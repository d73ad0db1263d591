"""Bytes ↔ Document: read GLB and .gltf without copying buffers, write them as chunks."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count
from typing import TypeAlias

from anim.errors import FormatError, ShapeError, UnsupportedError
from anim.gltf.document import Buffer, Bytes, Document, Json, json_array
from anim.gltf.io import json_text, uri
from anim.gltf.io.buffers import Resolve, as_array, as_bytes, buffers_of, describe_type
from anim.gltf.reading.node_matrix import expand_matrices
from anim.gltf.validation import schema

SUFFIXES = (".glb", ".gltf", ".vrm", ".vrma")
MAGIC = b"glTF"
JSON_CHUNK = 0x4E4F534A
BIN_CHUNK = 0x004E4942
MAX_GLB_BYTES = 2**32 - 1  # bytes; the header's length field has 32 bits
CACHE_HELP = "if it is a vertex cache: view and render show it, convert-cache makes .glb of it, diff compares it"
OTHER_FORMATS = {  # first bytes, and the commands that read them
    b"HIERARCHY": "gltf-anim from-euler makes glTF of BVH",
    **dict.fromkeys((b"PK", b"POINTCACHE2", b"PXR-USDC", b"#USDA"), CACHE_HELP),  # PK: .npz and .usdz
}
LFS_POINTER = b"version https://git-lfs"

Choose: TypeAlias = Callable[[int, str, Bytes], str]


def read(data: Bytes | bytes | bytearray | memoryview, resolve: Resolve | None = None) -> Document:
    """Return the document in `data`, a GLB or a .gltf text.

    data: bytes, or a uint8 array; a GLB's BIN chunk is not copied.
    resolve: returns the bytes of a file in the input's folder by its relative path, on first use; None if the input has
    no folder.
    Raises FormatError with the fault and its position, ShapeError if `data` is not bytes.
    """
    content = as_array(data)
    if content is None:
        raise ShapeError(
            f"data is no bytes (got {describe_type(data)}, expected a uint8 array or bytes)",
            help='the library opens no files: container.read(np.fromfile("walk.glb", np.uint8))',
        )
    if resolve is not None and not callable(resolve):
        raise ShapeError(
            f"resolve is {describe_type(resolve)} (expected a function from a relative path to bytes)",
            help='container.read(data, resolve=lambda name: np.fromfile(f"folder/{name}", np.uint8))',
        )
    head = content[:4096].tobytes()
    if head[:4] == MAGIC:
        return _read_glb(content, resolve)
    if head.startswith(LFS_POINTER):
        raise FormatError("is a Git LFS pointer, not the file itself", help="git lfs pull")
    if not len(content):
        raise FormatError("is empty (expected glTF)")
    json_text.check_mark(head)
    if head.lstrip()[:1] != b"{":
        start = head.lstrip()[:16].upper()
        raise FormatError(
            f"is no glTF: starts with {head[:4]!r} (expected b'glTF' or a JSON object)",
            help=next((help for begin, help in OTHER_FORMATS.items() if start.startswith(begin)), ""),
        )
    raw = content.tobytes()
    parsed, expanded = _parse(raw)
    return Document(parsed, buffers_of(parsed, None, resolve, glb=False), (), json_text.indent_of(raw), expanded)


def check_edits(document: Document) -> Document:
    """Return a document with the buffers that were appended to its JSON by edits in place.

    Raises FormatError for invalid JSON, as on reading, and for removed buffers.
    """
    schema.validate(document.json)
    count, known = len(json_array(document.json, "buffers")), len(document.buffers)
    if count < known:
        raise FormatError(f"has {count} buffers (expected the document's {known}, or more)", where="buffers")
    if count == known:
        return document
    return replace(document, buffers=(*document.buffers, *buffers_of(document.json, None, None, glb=False)[known:]))


def is_glb(data: Bytes) -> bool:
    """Return True if the bytes are a complete GLB, by its header."""
    return data[:4].tobytes() == MAGIC and int.from_bytes(data[8:12].tobytes(), "little") == len(data)


def glb(document: Document) -> list[Bytes]:
    """Return the chunks of a self-contained GLB: buffer 0 as BIN, other buffers as data URIs.

    Raises UnsupportedError above 4 GiB, FormatError if a buffer's bytes cannot be read.
    """
    content = dict(document.json)
    described = json_array(content, "buffers")
    if described:
        content["buffers"] = [
            _in_glb(i, d, b) for i, (d, b) in enumerate(zip(described, document.buffers, strict=True))
        ]
    pieces = [_chunk_head(0, JSON_CHUNK), *_padded(json_text.dump(content), b" ")]
    pieces[0] = _chunk_head(_size(pieces[1:]), JSON_CHUNK)
    chunks: list[tuple[int, list[Bytes]]] = []
    if described and document.buffers[0].byte_length > MAX_GLB_BYTES:
        raise _too_large(document.buffers[0].byte_length)
    if described:
        chunks.append((BIN_CHUNK, _padded(document.buffers[0].data, b"\0")))
    chunks += [(kind, [as_bytes(content)]) for kind, content in document.chunks]
    for kind, body in chunks:
        pieces += [_chunk_head(_size(body), kind), *body]
    total = 12 + _size(pieces)
    if total > MAX_GLB_BYTES:
        raise _too_large(total)
    return [as_bytes(struct.pack("<4sII", MAGIC, 2, total)), *pieces]


def gltf(
    document: Document, stem: str, *, keep_external: bool = False, choose: Choose = lambda _, name, __: name
) -> dict[str, list[Bytes]]:
    """Return the files of a .gltf by name: first the new .bin files, then `stem`.gltf.

    A data URI remains one; other buffers become `stem`.bin, `stem`-1.bin, … With `keep_external` an unchanged external
    buffer keeps its file. choose: takes the index, this name and the bytes of each buffer that becomes a file, and
    returns its name.
    """
    content = dict(document.json)
    described = json_array(content, "buffers")
    files: dict[str, list[Bytes]] = {}
    taken = {uri.relative_path(b.uri) for b in document.buffers if keep_external and _stays(b) and b.uri is not None}
    beside = []
    for i, (about, buffer) in enumerate(zip(described, document.buffers, strict=True)):
        about = dict(about)
        if buffer.uri is not None and uri.is_data(buffer.uri):
            about["uri"] = _data_uri(buffer)
        elif buffer.has_data and not (keep_external and _stays(buffer)):
            name = choose(i, next(n for n in _names(stem, i) if n not in taken), buffer.data)
            taken.add(name)
            about["uri"] = uri.from_path(name)
            files[name] = [buffer.data]
        beside.append(about)
    if described:
        content["buffers"] = beside
    files[f"{stem}.gltf"] = [as_bytes(json_text.dump(content, indent=document.indent) + b"\n")]
    return files


def embed_buffers(document: Document) -> Document:
    """Return the document with all buffers as data URIs, where it is written as a .gltf."""
    return replace(document, buffers=tuple(map(_embedded, document.buffers)))


def _embedded(buffer: Buffer) -> Buffer:
    if not buffer.has_data or (buffer.uri is not None and uri.is_data(buffer.uri)):
        return buffer
    return Buffer(buffer.byte_length, uri.encode_data(b""), lambda: buffer.data, replaced=True)


def _too_large(size: int) -> UnsupportedError:
    return UnsupportedError(f"a GLB can't hold {size} bytes (its limit is {MAX_GLB_BYTES})", help="write a .gltf")


def _stays(buffer: Buffer) -> bool:
    """True for an unchanged external buffer."""
    return buffer.uri is not None and not uri.is_data(buffer.uri) and not buffer.replaced


def _names(stem: str, number: int) -> Iterator[str]:
    """File names for a buffer, the preferred one first."""
    yield f"{stem}.bin" if number == 0 else f"{stem}-{number}.bin"
    yield from (f"{stem}-{number}-{k}.bin" for k in count(1))


def _read_glb(data: Bytes, resolve: Resolve | None) -> Document:
    if len(data) < 12:
        raise FormatError(f"GLB header is cut off ({len(data)} bytes of 12)")
    version, total = struct.unpack("<II", data[4:12].tobytes())
    if version != 2:
        raise FormatError(f"GLB version is {version} (expected 2)")
    if not 12 <= total <= len(data):
        state = "is truncated" if total > len(data) else "has a wrong length in its header"
        raise FormatError(f"GLB {state} ({len(data)} bytes, the header says {total})")
    parsed: Json | None = None
    expanded: tuple[int, ...] = ()
    binary: Bytes | None = None
    others: list[tuple[int, bytes]] = []
    for number, (kind, body) in enumerate(_chunks(data[:total])):
        if number == 0:
            if kind != JSON_CHUNK:
                raise FormatError(f"GLB's first chunk has type {kind:#010x} (expected JSON, {JSON_CHUNK:#010x})")
            parsed, expanded = _parse(body.tobytes())
        elif kind == BIN_CHUNK and number == 1:
            binary = body
        elif kind in (JSON_CHUNK, BIN_CHUNK):
            raise FormatError(f"GLB chunk {number} is a second or misplaced {'JSON' if kind == JSON_CHUNK else 'BIN'}")
        else:
            others.append((kind, body.tobytes()))
    if parsed is None:
        raise FormatError("GLB has no JSON chunk")
    return Document(parsed, buffers_of(parsed, binary, resolve, glb=True), tuple(others), None, expanded)


def _chunks(data: Bytes) -> list[tuple[int, Bytes]]:
    chunks = []
    at = 12
    while at < len(data):
        if at + 8 > len(data):
            raise FormatError(f"GLB chunk header at byte {at} is cut off")
        size, kind = struct.unpack("<II", data[at : at + 8].tobytes())
        if size % 4:
            raise FormatError(f"GLB chunk at byte {at} has {size} bytes (expected a multiple of 4)")
        if at + 8 + size > len(data):
            raise FormatError(f"GLB chunk at byte {at} is truncated ({len(data) - at - 8} bytes of {size})")
        chunks.append((kind, data[at + 8 : at + 8 + size]))
        at += 8 + size
    return chunks


def _parse(raw: bytes) -> tuple[Json, tuple[int, ...]]:
    """The JSON, and the indices of animated nodes that had a matrix in it."""
    json_text.check_mark(raw)
    parsed = json_text.parse(raw)
    schema.validate(parsed)
    return expand_matrices(parsed)


def _in_glb(number: int, about: Json, buffer: Buffer) -> Json:
    if number == 0:
        if not buffer.has_data:
            raise UnsupportedError("has no data, so it can't be a GLB's BIN chunk", where="buffer 0")
        return {key: value for key, value in about.items() if key != "uri"}
    if buffer.uri is None:
        return about
    return {**about, "uri": _data_uri(buffer)}


def _data_uri(buffer: Buffer) -> str:
    """The original URI if it already encodes these bytes, else a new one with its media type."""
    if buffer.uri is not None and uri.is_data(buffer.uri) and not buffer.replaced:
        return buffer.uri
    media = re.match(r"data:([^;,]+)", buffer.uri or "", re.IGNORECASE)
    return uri.encode_data(buffer.data.tobytes(), media[1] if media else uri.BUFFER_TYPES[0])


def _chunk_head(size: int, kind: int) -> Bytes:
    return as_bytes(struct.pack("<II", size, kind))


def _padded(content: bytes | Bytes, filler: bytes) -> list[Bytes]:
    rest = -len(content) % 4
    body = as_bytes(content) if isinstance(content, bytes) else content
    return [body, as_bytes(filler * rest)] if rest else [body]


def _size(pieces: list[Bytes]) -> int:
    return sum(len(piece) for piece in pieces)
